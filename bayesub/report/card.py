"""What the cards of an equation set, of a vehicle and of the data of a study have in common."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable


class Card(Protocol):
    """What ``bayesub check`` says of a file: in words and as JSON."""

    def lines(self) -> list[str]:
        """The card in words."""

    def to_json(self) -> dict:
        """The card as JSON types."""


@runtime_checkable
class DrawnCard(Card, Protocol):
    """A card that is one page of figures too."""

    def draw(self, path: Path | Sequence[Path]) -> None:
        """Draw the card to one path, or to several of different formats."""

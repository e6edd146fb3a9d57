"""What the cards of a vehicle and of the data of a study have in common."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol


class Card(Protocol):
    """What ``bayesub check`` says of a file: in words, as JSON, and as one page of figures."""

    def lines(self) -> list[str]:
        """The card in words."""

    def to_json(self) -> dict:
        """The card as JSON types."""

    def draw(self, path: Path | Sequence[Path]) -> None:
        """Draw the card to one path, or to several of different formats."""

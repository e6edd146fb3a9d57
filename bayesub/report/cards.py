"""The cards of ``bayesub check`` that are a page of figures: those of a vehicle, and of the data of a study."""

from collections.abc import Sequence
from functools import singledispatch
from pathlib import Path

from bayesub.findings.data_card import DataCard
from bayesub.findings.vehicle_card import VehicleCard
from bayesub.plots import data_card, vehicle_card


@singledispatch
def draw(card: object, path: Path | Sequence[Path]) -> None:  # noqa: ARG001
    """Draw a card to one path, or to several of different formats."""
    raise TypeError(f"a {type(card).__name__} is in words only")


@draw.register
def _(card: VehicleCard, path: Path | Sequence[Path]) -> None:
    vehicle_card.draw(path, card)


@draw.register
def _(card: DataCard, path: Path | Sequence[Path]) -> None:
    data_card.draw(path, card)


def is_drawn(card: object) -> bool:
    """Whether a card, or what stands for none, is of a kind that :func:`draw` knows."""
    return draw.dispatch(type(card)) is not draw.dispatch(object)

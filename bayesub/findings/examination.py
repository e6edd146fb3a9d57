"""What an examination of a vehicle gives, and how it writes a coefficient."""

from dataclasses import dataclass, field

from bayesub.model.equations import Term
from bayesub.model.trajectory import Trajectory


@dataclass(frozen=True)
class CardWarning:
    """What is unlike a boat.

    Attributes
    ----------
    text : str
        What is wrong, with the numbers that show it.
    remedy : str
        What to look at.
    """

    text: str
    remedy: str


@dataclass(frozen=True)
class Examination:
    """One part of a card.

    Attributes
    ----------
    numbers : dict
        Section of the card -> its content; None where there is none.
    warnings : list of CardWarning
        What is unlike a boat.
    flights : dict of str to Trajectory
        What was flown.
    skipped : dict of str to str
        Section -> why the equations of the vehicle leave it out.
    """

    numbers: dict
    warnings: list[CardWarning] = field(default_factory=list)
    flights: dict[str, Trajectory] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)


def number_and_unit(value: float, term: Term) -> str:
    """The value of a coefficient, with the unit of a dimensional one."""
    return f"{value:.3g} {term.unit}" if term.unit else f"{value:.3g}"

"""The equations of motion as they stand in the kernels, written out as lines of another language.

They are lane functions (:mod:`bayesub.kernels.lanes`), which compute with whatever adds and multiplies; here it writes
a line for each operation. Nothing is changed: terms and equations stand in the kernels alone, whoever computes them.
"""

import operator
from collections.abc import Callable
from typing import NamedTuple

from bayesub.kernels.dynamics import Boat, InverseMass, euler_derivative
from bayesub.kernels.families import Family
from bayesub.kernels.lanes import Rows, choose, sine_cosine, sqrt
from bayesub.kernels.workspace import BODY_ROWS, COEFFICIENTS, INVERSE_MASS, STATE


class Language(NamedTuple):
    """How something is written; braces stand for operands."""

    assigned: str
    size: str
    root: str
    chosen: str
    row: str
    control: str


CPP = Language(
    "const double {} = {};", "std::fabs({})", "std::sqrt({})", "({} ? {} : {})", "work[{}][i]", "control[{}]"
)
PYTHON = Language("{} = {}", "abs({})", "math.sqrt({})", "({1} if {0} else {2})", "work[{}]", "control[{}]")


class Written:
    """A number, or whether something holds, in another language; what is done to it is added to `lines`."""

    def __init__(self, text: str, lines: list[str], language: Language):
        self.text, self.lines, self.language = text, lines, language

    def __repr__(self):
        return self.text

    def new(self, expression: str) -> "Written":
        """A number that is computed once, in a line of its own."""
        name = f"t{len(self.lines)}"
        self.lines.append(self.language.assigned.format(name, expression))
        return self.same(name)

    def same(self, text: str) -> "Written":
        """An expression in the same lines."""
        return Written(text, self.lines, self.language)

    def __neg__(self):
        return self.new(f"-{self}")

    def __abs__(self):
        return self.new(self.language.size.format(self))


for _name, _sign in {"add": "+", "sub": "-", "mul": "*", "truediv": "/"}.items():
    setattr(Written, f"__{_name}__", lambda a, b, sign=_sign: a.new(f"{a} {sign} {b!r}"))
    setattr(Written, f"__r{_name}__", lambda a, b, sign=_sign: a.new(f"{b!r} {sign} {a}"))
for _name, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "ne": "!=", "or": "|", "and": "&"}.items():
    setattr(Written, f"__{_name}__", lambda a, b, sign=_sign: a.same(f"({a} {sign} {b!r})"))


@choose.register
def _(test: Written, a, b):
    if isinstance(a, tuple):
        return tuple(choose(test, *pair) for pair in zip(a, b, strict=True))
    return test.new(test.language.chosen.format(test, repr(a), repr(b)))


@sqrt.register
def _(x: Written):
    return x.new(x.language.root.format(x))


class _Numbers:
    """Numbers of an array that is read."""

    def __init__(self, text: str, lines: list[str], language: Language):
        self.text, self.lines, self.language = text, lines, language

    def __getitem__(self, k):
        return Written(self.text.format(operator.index(k)), self.lines, self.language)


def boat(family: Family, rows, state, controls) -> Boat:
    """What the equations of motion ask for, of all rows of a workspace, and a state and controls of its own."""
    first = COEFFICIENTS + family.equations.N_COEFFICIENTS
    constants = first + family.equations.N_CONTROLS
    inverse_mass = InverseMass(Rows(rows, INVERSE_MASS))
    return Boat(
        family.equations, state, Rows(rows, BODY_ROWS), inverse_mass, Rows(rows, COEFFICIENTS), Rows(rows, constants),
        controls,
    )  # fmt: skip


def written(family: Family, language: Language, sines: Callable | None = None) -> tuple[list[str], list[str]]:
    """Lines that compute the rates from the rows `work` of a boat and its `control`; and the twelve rates.

    `sines`, if given, takes an angle and returns the texts of its sine and cosine; otherwise they are the kernels'.
    """
    lines: list[str] = []
    kind = Written if sines is None else type("Written", (Written,), {})
    rows, controls = (_Numbers(text, lines, language) for text in (language.row, language.control))
    state = [kind(rows[STATE + k].text, lines, language) for k in range(12)]
    if sines is not None:
        sine_cosine.register(kind, lambda angle: tuple(angle.same(text) for text in sines(angle.text)))
    rates = euler_derivative(boat(family, rows, state, controls))
    return lines, [repr(rate) for rate in rates]

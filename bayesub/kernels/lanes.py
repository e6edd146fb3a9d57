"""Lane functions: straight-line arithmetic on vectors of LANES lanes, as machine code by LLVM or at once by NumPy.

A lane function is Python without loops over data and without branches on values: sums, products, quotients, roots,
sizes, and choices between values. Run once on :class:`Lanes`, it writes down what is done to them, and what is written
is ``void unit(double *work, double *control, double *out, double a, double b)`` of LLVM. Run on arrays it computes.

Rows of `work` and `out` hold one number for each lane; those of `control` are the same for all lanes.
"""

import math
import struct
from collections.abc import Callable
from functools import singledispatch
from types import SimpleNamespace

import numpy as np

from bayesub.kernels.workspace import LANES

_SYMBOLS = {"work": "noalias", "control": "noalias readonly", "out": "noalias"}


@singledispatch
def choose(test, a, b):
    """`a` where the test holds and `b` elsewhere; both may be tuples, whose parts are then chosen one by one."""
    return _by_parts(np.where, test, a, b)


@singledispatch
def sqrt(x):
    """Square root."""
    return np.sqrt(x)


def _by_parts(chosen, test, a, b):
    if isinstance(a, tuple):
        return tuple(_by_parts(chosen, test, *pair) for pair in zip(a, b, strict=True))
    return chosen(test, a, b)


class Truths:
    """Whether something holds, lane by lane, in a function that is being written."""

    __slots__ = ("name", "writer")

    def __init__(self, writer: "_Writer", name: str):
        self.writer, self.name = writer, name

    def __or__(self, other):
        return self.writer.truths(f"or {self.writer.truth} {self.name}, {other.name}")

    def __and__(self, other):
        return self.writer.truths(f"and {self.writer.truth} {self.name}, {other.name}")

    def __bool__(self):
        raise TypeError("a lane function cannot branch on what differs from lane to lane: use choose(test, a, b)")


class Lanes:
    """A number for each lane in a function that is being written."""

    __slots__ = ("name", "writer")
    __hash__ = None  # type: ignore[assignment]  # as of whatever can be compared

    def __init__(self, writer: "_Writer", name: str):
        self.writer, self.name = writer, name

    def __neg__(self):
        return self.writer.lanes(f"fneg contract {self.writer.vector} {self.name}")

    def __abs__(self):
        return self.writer.call("fabs", self)


def _arithmetic(instruction):
    def forwards(self, other):
        writer = self.writer
        return writer.lanes(f"{instruction} contract {writer.vector} {self.name}, {writer.operand(other)}")

    def backwards(self, other):
        writer = self.writer
        return writer.lanes(f"{instruction} contract {writer.vector} {writer.operand(other)}, {self.name}")

    return forwards, backwards


def _comparison(condition):
    def compare(self, other):
        writer = self.writer
        return writer.truths(f"fcmp {condition} {writer.vector} {self.name}, {writer.operand(other)}")

    return compare


for _name, _instruction in {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}.items():
    _forwards, _backwards = _arithmetic(_instruction)
    setattr(Lanes, f"__{_name}__", _forwards)
    setattr(Lanes, f"__r{_name}__", _backwards)
for _name, _condition in {"gt": "ogt", "ge": "oge", "lt": "olt", "le": "ole", "eq": "oeq", "ne": "une"}.items():
    setattr(Lanes, f"__{_name}__", _comparison(_condition))


@choose.register
def _(test: Truths, a, b):
    return _by_parts(test.writer.select, test, a, b)


@sqrt.register
def _(x: Lanes):
    return x.writer.call("sqrt", x)


class Rows:
    """Consecutive rows of a larger array of rows, of a vector, or of anything that has numbers by position."""

    def __init__(self, rows, first: int = 0):
        self.rows, self.first = rows, first

    def __getitem__(self, k):
        return self.rows[self.first + k]


class _Writer:
    """The text of a function of LLVM, for vectors of `width` lanes, in a loop over the LANES of a block.

    The width, 2, 4 or 8, is how many numbers the processor takes at once; `typed_pointers` are those of LLVM 15.
    """

    def __init__(self, width: int, typed_pointers: bool):
        self.width = width
        self.lines: list[str] = []
        self.known: dict[str, str] = {}  # instruction -> name of what it gives
        self.called: set[str] = set()
        self.vector, self.truth = f"<{width} x double>", f"<{width} x i1>"
        self.pointer, self.to_vector = ("double*", f"{self.vector}*") if typed_pointers else ("ptr", "ptr")
        self.work, self.out = _WrittenRows(self, "work"), _WrittenRows(self, "out")
        self.control = _SharedNumbers(self)
        self.a, self.b = self.everywhere("%a"), self.everywhere("%b")

    def value(self, instruction: str) -> str:
        """The name of what an instruction gives, which is written once."""
        if instruction not in self.known:
            self.known[instruction] = f"%v{len(self.known)}"
            self.lines.append(f"{self.known[instruction]} = {instruction}")
        return self.known[instruction]

    def lanes(self, instruction: str) -> Lanes:
        return Lanes(self, self.value(instruction))

    def truths(self, instruction: str) -> Truths:
        return Truths(self, self.value(instruction))

    def operand(self, number) -> str:
        """The name of lanes, or a number that is the same in all."""
        if isinstance(number, Lanes):
            return number.name
        text = "double 0x" + struct.pack(">d", number).hex()
        return f"<{', '.join([text] * self.width)}>"

    def everywhere(self, scalar: str) -> Lanes:
        """A scalar, the same in all lanes."""
        first = self.value(f"insertelement {self.vector} undef, double {scalar}, i32 0")
        return self.lanes(
            f"shufflevector {self.vector} {first}, {self.vector} undef, <{self.width} x i32> zeroinitializer"
        )

    def select(self, test: Truths, a, b):
        kind = self.truth if isinstance(a, Truths) else self.vector
        names = (each.name if isinstance(each, Truths) else self.operand(each) for each in (a, b))
        made = self.truths if isinstance(a, Truths) else self.lanes
        return made(f"select {self.truth} {test.name}, " + ", ".join(f"{kind} {name}" for name in names))

    def call(self, function: str, x: Lanes) -> Lanes:
        name = f"@llvm.{function}.v{self.width}f64"
        self.called.add(f"declare {self.vector} {name}({self.vector})")
        return self.lanes(f"call {self.vector} {name}({self.vector} {x.name})")

    def text(self, name: str) -> str:
        """The module with this function."""
        arguments = ", ".join(f"{self.pointer} {given} %{symbol}" for symbol, given in _SYMBOLS.items())
        head = f'define void @{name}({arguments}, double %a, double %b) nounwind "prefer-vector-width"="512" {{'
        begin = ["entry:", "br label %block", "block:", "%lane = phi i64 [0, %entry], [%following, %block]"]
        step = [f"%following = add nuw nsw i64 %lane, {self.width}", f"%more = icmp ult i64 %following, {LANES}"]
        end = ["br i1 %more, label %block, label %end", "end:", "ret void", "}"]
        return "\n".join([head, *begin, *self.lines, *step, *end, *sorted(self.called)])


class _WrittenRows:
    """Rows of lanes behind a pointer: what was read or written once is known."""

    def __init__(self, writer: _Writer, symbol: str):
        self.writer, self.symbol = writer, symbol
        self.values: dict[int, Lanes] = {}

    def _place(self, row: int) -> str:
        writer = self.writer
        position = writer.value(f"add nuw nsw i64 %lane, {row * LANES}")
        place = writer.value(f"getelementptr double, {writer.pointer} %{self.symbol}, i64 {position}")
        return writer.value(f"bitcast {writer.pointer} {place} to {writer.to_vector}")

    def __getitem__(self, row):
        if row not in self.values:
            writer = self.writer
            self.values[row] = writer.lanes(
                f"load {writer.vector}, {writer.to_vector} {self._place(row)}, align {8 * writer.width}"
            )
        return self.values[row]

    def __setitem__(self, row, number):
        writer = self.writer
        self.values[row] = number if isinstance(number, Lanes) else Lanes(writer, writer.operand(number))
        writer.lines.append(
            f"store {writer.vector} {self.values[row].name}, {writer.to_vector} {self._place(row)}, align 8"
        )


class _SharedNumbers:
    """Numbers behind the pointer `control`, each the same in all lanes."""

    def __init__(self, writer: _Writer):
        self.writer = writer

    def __getitem__(self, k):
        writer = self.writer
        place = writer.value(f"getelementptr double, {writer.pointer} %control, i64 {k}")
        return writer.everywhere(writer.value(f"load double, {writer.pointer} {place}, align 8"))


class _ArrayRows:
    """Rows of lanes in a flat array."""

    def __init__(self, numbers):
        self.rows = numbers.reshape(-1, LANES)

    def __getitem__(self, row):
        return self.rows[row].copy()

    def __setitem__(self, row, numbers):
        self.rows[row] = numbers


def written(function: Callable, name: str, width: int, *, typed_pointers: bool = False) -> str:
    """A lane function as a module of LLVM, in which it has a name, for vectors of 2, 4 or 8 lanes.

    The function takes one argument, whose `work` and `out` are rows, `control` numbers, and `a` and `b` two numbers
    more; `typed_pointers` are those of LLVM 15 and older.
    """
    writer = _Writer(width, typed_pointers)
    function(writer)
    return writer.text(name)


def interpreted(function: Callable) -> Callable:
    """A lane function as one of NumPy, ``unit(work, control, out, a, b)`` on flat arrays."""

    def unit(work, control, out, a, b):
        with np.errstate(all="ignore"):  # as in machine code
            function(SimpleNamespace(work=_ArrayRows(work), out=_ArrayRows(out), control=control, a=a, b=b))

    return unit


# pi/2 in two parts; the first has 20 trailing zero bits, so that its multiples up to 2^20 are exact (Cody & Waite).
_HALF_PI_HIGH = 1.57079632673412561417e00
_HALF_PI_LOW = 6.07710050650619224932e-11
_TWO_OVER_PI = 2.0 / math.pi
_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest integer
_S3, _S5, _S7, _S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
_S11, _S13, _S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
_C2, _C4, _C6, _C8 = -1 / 2, 1 / 24, -1 / 720, 1 / 40320
_C10, _C12, _C14, _C16 = -1 / 3628800, 1 / 479001600, -1 / 87178291200, 1 / 20922789888000


@singledispatch
def sine_cosine(angle):
    """Sine and cosine of `angle` (rad): Taylor series on [-pi/4, pi/4], to 2e-16 while abs(angle) < 1e6."""
    turns = (angle * _TWO_OVER_PI + _ROUND) - _ROUND
    x = (angle - turns * _HALF_PI_HIGH) - turns * _HALF_PI_LOW
    x2 = x * x
    s = x + x * x2 * (_S3 + x2 * (_S5 + x2 * (_S7 + x2 * (_S9 + x2 * (_S11 + x2 * (_S13 + x2 * _S15))))))
    c = 1.0 + x2 * (_C2 + x2 * (_C4 + x2 * (_C6 + x2 * (_C8 + x2 * (_C10 + x2 * (_C12 + x2 * (_C14 + x2 * _C16)))))))
    half = turns * 0.5
    odd = half != (half + _ROUND) - _ROUND  # an odd number of quarter turns swaps sine and cosine
    pair = turns - 4.0 * ((turns * 0.25 + _ROUND) - _ROUND)  # quarter turns in -2 .. 2
    sine, cosine = choose(odd, (c, s), (s, c))
    sine = choose((pair > 1.5) | (pair < -0.5), -sine, sine)
    cosine = choose((pair > 0.5) | (pair < -1.5), -cosine, cosine)
    return sine, cosine

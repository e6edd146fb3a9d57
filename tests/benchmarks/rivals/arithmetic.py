"""The arithmetic of the processor: how fast the right-hand side of the equations of motion could be at best."""

import re
import timeit
from collections import Counter

import numba
import numpy as np

from bayesub.kernels import families
from bayesub.kernels.jit import widest_vectors

_CHAIN = 16
_PASSES = 1000
_COUNTED = ("fma", "mul", "add", "sub", "div", "sqrt")


@numba.njit(fastmath={"contract"})
def _multiply_add(values, times):
    """`times` passes of four chains of multiply-adds on each of `values`: 4 * _CHAIN of them a value and pass."""
    widest_vectors()
    for _ in range(times):
        for j in range(values.shape[0]):
            x = values[j]
            a, b, c, d = x, x + 0.1, x + 0.2, x + 0.3
            for _ in range(_CHAIN):
                a = a * x + 0.25
                b = b * x + 0.25
                c = c * x + 0.25
                d = d * x + 0.25
            values[j] = 0.1 * (a + b + c + d)


def packed_instructions(assembly: str) -> tuple[Counter, int]:
    """Packed double-precision instructions of machine code by kind, and its widest vectors in bits (0: none)."""
    kinds = Counter()
    for name in re.findall(r"^\s+v([a-z0-9]+)pd\s.*[yz]mm", assembly, flags=re.MULTILINE):
        if kind := re.match(r"fn?m(?:add|sub)|mul|add|sub|div|sqrt|cmp|blend", name):
            kinds["fma" if kind[0].startswith("f") else kind[0]] += 1
    return kinds, 512 if "zmm" in assembly else 256 if "ymm" in assembly else 0


def limit(kernels: families.Family, evaluations: int) -> dict:
    """The shortest time (s) of `evaluations` right-hand sides of these kernels on one core, and what it follows from.

    Every packed multiply-add, multiplication, addition, subtraction, division and root in the compiled stage counts as
    one multiply-add at the measured peak rate; comparisons, choices, loads and stores count as nothing.
    """
    values = np.full(512, 0.5)
    _multiply_add(values, 1)
    shortest = min(timeit.repeat(lambda: _multiply_add(values, _PASSES), number=1, repeat=20))
    rate = _PASSES * values.size * 4 * _CHAIN / shortest
    kinds, bits = packed_instructions(kernels.assembly("stage"))
    of_peak = next(iter(_multiply_add.inspect_asm().values())).split(".Lfunc_end0")[0]
    turns = 512 // bits if bits else 1  # of the loop over the eight lanes
    return {
        "instructions": {kind: turns * n for kind, n in kinds.items()},
        "vector_bits": bits,
        "peak_vector_bits": packed_instructions(of_peak)[1],
        "fma_per_s": rate,
        "limit_s": evaluations * turns * sum(kinds[kind] for kind in _COUNTED) / rate,
    }

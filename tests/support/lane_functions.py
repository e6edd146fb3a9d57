"""Lane functions as machine code, called from Python."""

import ctypes
from collections.abc import Callable

import numpy as np

from bayesub.kernels import jit
from bayesub.kernels.workspace import LANES

_UNIT = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3, ctypes.c_double, ctypes.c_double)


def aligned(n_rows: int) -> np.ndarray:
    """Zeros (n_rows, LANES), each row in a cache line of its own, as machine code takes it for granted."""
    memory = np.zeros((n_rows + 1) * LANES)
    start = (-(memory.ctypes.data // memory.itemsize)) % LANES
    return memory[start : start + n_rows * LANES].reshape(n_rows, LANES)


def compiled(function: Callable, *names: str) -> Callable:
    """``unit(work, control, out, a, b)`` on arrays; `names` as of :func:`bayesub.kernels.jit.unit_address`."""
    unit = _UNIT(jit.unit_address(function, *names))

    def run(work, control, out, a, b):
        unit(work.ctypes.data, control.ctypes.data, out.ctypes.data, a, b)

    return run


def mapped(function: Callable, name: str) -> Callable:
    """A function of a number as one of arrays (n,), by machine code; it returns a tuple."""

    def unit(given):
        for k, value in enumerate(function(given.work[0])):
            given.out[k] = value

    run = compiled(unit, name)

    def of_array(numbers):
        blocks = -(-len(numbers) // LANES)
        padded, work, out, found = np.zeros(blocks * LANES), aligned(1), aligned(2), []
        padded[: len(numbers)] = numbers
        for block in padded.reshape(blocks, LANES):
            work[0] = block
            run(work, np.zeros(1), out, 0.0, 0.0)
            found.append(out.T.copy())
        return np.concatenate(found)[: len(numbers)]

    return of_array

"""Arrays as loops take them; and freed memory is kept for the next arrays of the same size.

The C library gives arrays of more than 128 kB back to the system as soon as they are freed, and each of their pages is
asked for and zeroed again with the next batch. That is as much work as a planar simulation itself.
"""

import ctypes
import os
import sys

import numpy as np

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of `mallopt` of the GNU C library
_KEPT, _LARGEST = 2**28, 2**25  # bytes: that are kept at most, and of an array that is kept


def keep_freed_memory() -> bool:
    """Let this process keep what it frees, and say whether it does.

    Not where the environment says how (``MALLOC_TRIM_THRESHOLD_`` and others), nor with another C library than GNU's.
    """
    if not sys.platform.startswith("linux") or any(name.startswith("MALLOC_") for name in os.environ):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_MMAP_THRESHOLD, _LARGEST) and mallopt(_TRIM_THRESHOLD, _KEPT))


def plain(array: np.ndarray, kind: type = float) -> np.ndarray:
    """The array as loops are compiled for it: contiguous, of that type, and not read-only; a copy if need be."""
    array = np.ascontiguousarray(array, kind)
    return array if array.flags.writeable else array.copy()

"""How walks on a surrogate are compiled and cached."""

import hashlib
from pathlib import Path

import numba

_MODULES = ("polynomial.py", "bend.py", "flights.py")  # whose functions call one another
_SOURCES = b"".join((Path(__file__).parent / name).read_bytes() for name in _MODULES)
_DIGEST = hashlib.sha256(_SOURCES).hexdigest()[:12]


def compiled(function):
    """Compile a function that is called without the interpreter's lock.

    numba holds a cached function for current while its own file is unchanged, but machine code of other files is part
    of it. The name under which it is cached therefore carries a digest of all of them.
    """
    function.__qualname__ += f"_{_DIGEST}"
    return numba.njit(cache=True, nogil=True)(function)

"""Compile the kernels in a process of their own, so that every process that computes loads the same machine code.

A kernel that was compiled in the running process may call another copy of an inner function than one that was loaded
from the cache, optimised once more or once less, and round the last digit differently. If all processes load, a study
gives the same bits on its first run as on any other. This holds on the same machine and with the same versions of
bayesub, Python, NumPy, SciPy, numba and LLVM: for another processor other instructions are chosen, and last digits
differ.

The products of :mod:`bayesub.sampling.polynomial` are compiled apart, where they are used. They are single products and
sums that the compiler may not contract or reorder, and have the same bits whoever compiles them.
"""

import contextlib
import hashlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import filelock
import numba
from numba.core.registry import cpu_target

from bayesub.kernels.jit import DIGEST
from bayesub.kernels.noise import gathered

_COMPILING = "BAYESUB_COMPILING"  # environment variable of the process that compiles


def ensure(script: str, name: str) -> None:
    """Run a script that calls kernels in another process, unless this was done before for this installation.

    If the script fails, or nothing can be cached, the kernels are compiled where they are used. A line on standard
    error tells a user at a terminal what takes so long.

    Parameters
    ----------
    script : str
        Python source.
    name : str
        What it compiles.
    """
    if numba.config.DISABLE_JIT or _COMPILING in os.environ or name in _done:
        return
    _done.add(name)
    versions = (name, DIGEST, numba.__version__, platform.python_version(), _processor())
    stamp = Path(gathered.variants[0].stats.cache_path) / f"compiled-{'-'.join(versions)}"
    if stamp.exists():
        return
    writable = os.access(stamp.parent, os.W_OK)
    lock = stamp.with_name(f".{stamp.name}.lock")
    with filelock.FileLock(lock) if writable else contextlib.nullcontext():
        if stamp.exists():  # by now, of another process
            return
        if sys.stderr.isatty():
            print("bayesub: compiling, once for these equations: about half a minute", file=sys.stderr)
        finished = subprocess.run(
            [sys.executable, "-c", script], env=os.environ | {_COMPILING: "1"}, capture_output=True, check=False
        )
        if finished.returncode == 0 and stamp.parent.is_dir():
            stamp.touch()


_done: set[str] = set()


def _processor() -> str:
    """Digest of the processor for which numba compiles: that of the machine, or that of NUMBA_CPU_NAME."""
    target = cpu_target.target_context.codegen().magic_tuple()
    return hashlib.sha256(repr(target).encode()).hexdigest()[:12]

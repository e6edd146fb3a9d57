"""Compile the kernels in a process of their own, so that every process that computes loads the same machine code.

A kernel that was compiled in the running process may call another copy of an inner function than one that was loaded
from the cache, optimised once more or once less, and round the last digit differently. If all processes load, a
study gives the same bits on its first run as on any other.
"""

import os
import platform
import subprocess
import sys
from pathlib import Path

import llvmlite.binding
import numba

from bayesub.kernels.integrate import integrate
from bayesub.kernels.jit import DIGEST

_COMPILING = "BAYESUB_COMPILING"  # environment variable that tells the process that compiles


def ensure(script: str) -> None:
    """Run `script`, Python that calls every kernel, in another process, unless it has been run for this installation.

    If that fails, or nothing can be cached, the kernels are compiled where they are used. At a terminal it says so.
    """
    if numba.config.DISABLE_JIT or _COMPILING in os.environ or ensure.done:
        return
    ensure.done = True
    versions = (DIGEST, numba.__version__, platform.python_version(), llvmlite.binding.get_host_cpu_name())
    stamp = Path(integrate.stats.cache_path) / f"compiled-{'-'.join(versions)}"
    if stamp.exists():
        return
    if sys.stderr.isatty():
        print("bayesub: compiling, once for this installation: about half a minute", file=sys.stderr)
    finished = subprocess.run(
        [sys.executable, "-c", script], env=os.environ | {_COMPILING: "1"}, capture_output=True, check=False
    )
    if finished.returncode == 0 and stamp.parent.is_dir():
        stamp.touch()


ensure.done = False

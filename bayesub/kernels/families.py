"""Families of kernels: those of :mod:`bayesub.kernels.motion`, compiled for the forces of one equation set.

A family is a package of its own. Its path is the folder of the generated ``hydrodynamics.py`` and, after it, that of
the modules that all families share, so that a relative import finds the one in the first and the others in the second.
"""

import functools
import hashlib
import importlib
import sys
from pathlib import Path
from types import ModuleType

from bayesub.kernels import compilation
from bayesub.kernels.jit import DIGEST, FAMILY

_MOTION = Path(__file__).parent / "motion"
_SHARED = b"".join(path.read_bytes() for path in sorted(_MOTION.rglob("*.py")))


class Family:
    """The kernels of motion for one generated module of forces; compiled when they are first asked for.

    Attributes
    ----------
    integrate, sensitivities, mass : module
        :mod:`bayesub.kernels.motion.integrate` and so on, for these forces.
    """

    def __init__(self, package: str):
        self.package = package

    def __getattr__(self, name: str) -> ModuleType:
        return importlib.import_module(f"{self.package}.{name}")


@functools.cache
def family(folder: str, quaternions: bool = False) -> Family:
    """The kernels for the forces in ``hydrodynamics.py`` of a folder, with Euler angles or quaternions."""
    forces = (Path(folder) / "hydrodynamics.py").read_bytes()
    sources = DIGEST.encode() + _SHARED + forces + str(quaternions).encode()
    package = ModuleType(f"{FAMILY}{hashlib.sha256(sources).hexdigest()[:12]}")
    package.__path__ = [folder, *([str(_MOTION / "quaternions")] if quaternions else []), str(_MOTION)]
    sys.modules[package.__name__] = package
    return Family(package.__name__)


def compiled(folder: str, quaternions: bool = False) -> Family:
    """The kernels for the forces in a folder, compiled in another process (:mod:`bayesub.kernels.compilation`)."""
    kernels = family(folder, quaternions)
    called = f"family({folder!r}, {quaternions}).first_calls.call_all()"
    compilation.ensure(f"from bayesub.kernels.families import family; {called}", kernels.package)
    return kernels

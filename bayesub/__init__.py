"""Say which hydrodynamic coefficients of a submarine free-swimming trials determine, how well, and why not the others.

Public names are listed in ``__init__.pyi`` in the order of the data flow: a vehicle and a manoeuvre give a trajectory,
sensors make it a record, the record and a prior make a problem, and the problem goes to baselines, identifiability and
sampling. Each is imported when it is first asked for, so that a command which computes nothing starts at once.
"""

from importlib import metadata

import lazy_loader

__version__ = metadata.version("bayesub")
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

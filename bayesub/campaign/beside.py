"""Modules that lie beside a study script: how they are imported here, and how they come to other processes.

Processes of this machine import them from the folder of the study. On a cluster that folder may not be there: what is
sent to a worker holds the modules by value (:func:`by_value`), as far as they have been imported here.
"""

import functools
import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

_folders: list[str] = []  # of the studies of this process, the last one first


def folders() -> tuple[str, ...]:
    """The folders of the studies that this process has loaded, the last one first."""
    return tuple(_folders)


def importable(*places: str | Path) -> None:
    """Put folders of studies first among those that modules are imported from.

    Where that changes the order, modules of all such folders are forgotten, lest one goes on with a namesake.
    """
    folders = [str(Path(place).resolve()) for place in places]
    if _folders[: len(folders)] == folders and set(folders) <= set(sys.path):
        return
    for name in _modules():
        del sys.modules[name]
    for known in (_folders, sys.path):
        known[:] = [*folders, *(folder for folder in known if folder not in folders)]


def by_value() -> Callable[[Any], bytes]:
    """What pickles functions and data with the modules beside a study that they need, whom no worker of a cluster has.

    Those are meant that have been imported by now; finding them takes longer than pickling a piece.
    """
    import cloudpickle

    class Pickler(cloudpickle.Pickler):
        """Functions that keep what they have returned go by value too, without what they have kept."""

        def reducer_override(self, obj):
            if isinstance(obj, functools._lru_cache_wrapper) and obj.__module__.partition(".")[0] in tops:
                return _cached, (obj.__wrapped__, obj.cache_parameters())
            return super().reducer_override(obj)

    tops = {name.partition(".")[0] for name in _modules()}
    modules = [sys.modules[top] for top in tops if top in sys.modules]

    def pickled(content: Any) -> bytes:
        for module in modules:
            cloudpickle.register_pickle_by_value(module)
        try:
            file = io.BytesIO()
            Pickler(file).dump(content)
            return file.getvalue()
        finally:
            for module in modules:
                cloudpickle.unregister_pickle_by_value(module)

    return pickled


def _cached(function, parameters):
    return functools.lru_cache(**parameters)(function)


def _modules() -> list[str]:
    """Names of the imported modules that lie in the folder of a study and are imported from it, as scripts are not."""
    names = []
    for name, module in list(sys.modules.items()):
        file = Path(getattr(module, "__file__", None) or "")
        place = file.parent if file.name.startswith("__init__.") else file.parent / file.name.partition(".")[0]
        if name != "__main__" and any(place == Path(folder, *name.split(".")) for folder in _folders):
            names.append(name)
    return names

"""Modules that lie beside a study script: how they are imported here, and how they come to other processes.

Processes of this machine import them from the folder of the study. On a cluster that folder may not be there: what is
sent to a worker holds the modules by value (:func:`by_value`), as far as they have been imported here.
"""

import functools
import io
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

_folders: list[str] = []  # of the studies of this process, the last one first


def folders() -> tuple[str, ...]:
    """The folders of the studies that this process has loaded, the last one first."""
    return tuple(_folders)


def importable(*places: str | Path) -> None:
    """Put folders of studies first among those that modules are imported from.

    A module that came from the folder of another study is forgotten if these have one of its name.
    """
    for folder in reversed([str(Path(place).resolve()) for place in places]):
        if _folders[:1] == [folder] and folder in sys.path:
            continue
        for name in [name for name, home in _homes() if home != folder and _has(Path(folder), name)]:
            del sys.modules[name]
        for known in (_folders, sys.path):
            if folder in known:
                known.remove(folder)
            known.insert(0, folder)


def by_value() -> Callable[[Any], bytes]:
    """What pickles functions and data with the modules beside a study that they need, whom no worker of a cluster has.

    Those are meant that have been imported by now; finding them takes longer than pickling a piece.
    """
    import cloudpickle

    class Pickler(cloudpickle.Pickler):
        """Functions that keep what they have returned go by value too, without what they have kept."""

        def reducer_override(self, obj):
            if isinstance(obj, functools._lru_cache_wrapper) and obj.__module__.partition(".")[0] in names:
                return _cached, (obj.__wrapped__, obj.cache_parameters())
            return super().reducer_override(obj)

    names = {name.partition(".")[0] for name, _ in _homes()}
    modules = [sys.modules[name] for name in names if name in sys.modules]

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


def _homes() -> Iterable[tuple[str, str]]:
    """Name and folder of each imported module that lies in the folder of a study."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        above = name.count(".") + Path(file or "").name.startswith("__init__.")
        homes = [str(folder) for folder in Path(file or "").parents[above : above + 1]]
        if name != "__main__" and homes and homes[0] in _folders:
            yield name, homes[0]


def _has(folder: Path, name: str) -> bool:
    """Whether a folder has a module or package of this top-level name."""
    top = name.partition(".")[0]
    return (folder / f"{top}.py").is_file() or (folder / top).is_dir()

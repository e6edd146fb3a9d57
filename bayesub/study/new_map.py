"""New map files for `bayesub convert`: the example of a kind of log, with the signals of one if it is at hand."""

from pathlib import Path

from bayesub.io import templates, toml_files


def example(kind: str, path: Path, data: Path | None = None) -> str:
    """The text of a map file `path` for logs of a kind.

    Parameters
    ----------
    kind : str
        As :data:`bayesub.logs.readers.KINDS`.
    path : Path
        Where it will stand.
    data : Path or None
        A log whose signals are listed in it.
    """
    text = toml_files.read_text(toml_files.built_in("maps")[kind])
    signals = []
    if data is not None:
        from bayesub.logs import readers

        signals = [(name, signal.unit) for name, signal in readers.read(kind, [data]).signals.items()]
    values = {"kind": kind, "path": path, "source": data, "signals": signals, "example": text.rstrip()}
    return templates.fill("bayesub.study", "new_map.toml", **values)

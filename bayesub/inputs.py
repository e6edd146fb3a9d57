"""Reading input files: TOML validated against a pydantic model, with one clear line when it does not fit."""

import tomllib
import typing
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Annotated, TypeVar

import pydantic

from bayesub.coefficients import nearest
from bayesub.errors import InputError
from bayesub.files import reason

DATA = resources.files("bayesub") / "data"


class Section(pydantic.BaseModel):
    """A table of an input file: unknown keys are errors, and so are numbers that are not finite."""

    model_config = pydantic.ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


Positive = Annotated[float, pydantic.Field(gt=0)]
Model = TypeVar("Model", bound=Section)


def built_in(kind: str) -> dict[str, Path]:
    """Name -> file of the built-in ``vehicles`` or ``manoeuvres``."""
    return {Path(f.name).stem: Path(str(f)) for f in sorted((DATA / kind).iterdir(), key=lambda f: f.name)}


def find(name: str, kind: str) -> Path:
    """The file of a built-in name or of a path; InputError if there is neither."""
    files = built_in(kind)
    if name in files:
        return files[name]
    path = Path(name)
    if path.suffix == "":
        raise InputError(
            f"no {kind.removesuffix('s')} '{name}'{nearest(name, files)}; built in are {', '.join(files)}; "
            "anything else must be the path of a file"
        )
    return path


def read_text(path: Path) -> str:
    """The text of a file, or an InputError that says why not."""
    with reading(path):
        return path.read_text(encoding="utf-8-sig")


def read_line(path: Path) -> str:
    """The first line of a text file without the spaces around it, or an InputError that says why not."""
    with reading(path), path.open(encoding="utf-8-sig") as file:
        return file.readline().strip()


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """What cannot be read or is not UTF-8 text inside the block is an InputError that names `path`."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {reason(error)}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text") from None


def read_toml(path: Path, model: type[Model]) -> Model:
    """Read `path` into `model`; the InputError names file, key, what was found and what was expected."""
    return validate(read_toml_table(path), model, str(path))


def read_toml_table(path: Path) -> dict:
    """The plain content of a TOML file."""
    try:
        return tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None


def validate(content: dict, model: type[Model], source: str) -> Model:
    """Build `model` from `content`; `source` names the origin in the error."""
    try:
        return model.model_validate(content)
    except pydantic.ValidationError as error:
        raise InputError(f"{source}: {_sentence(error, model)}") from None


def _sentence(error: pydantic.ValidationError, model: type[Section]) -> str:
    # A mistyped key is both unknown and missing; the unknown one tells more.
    first, *others = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    keys, siblings = _followed(first["loc"], model) if first["loc"] else ([], [])
    if first["type"] == "value_error" and siblings and keys[-1] not in siblings and not keys[-1].isdigit():
        keys.pop()  # the tag of a section that is wrong as a whole
    key = ".".join(keys)
    more = f" (and {len(others)} more)" if others else ""
    if first["type"] == "missing":
        return f"key '{key}' is missing{more}"
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'{nearest(keys[-1], siblings)}{more}"
    message = first["msg"].removeprefix("Value error, ")
    if not keys:
        return f"{message}{more}"
    found = repr(first["input"])
    told = found in message or isinstance(first["input"], dict)
    shown = "" if told or len(found) >= 80 else f", found {found}"
    return f"key '{key}': {message[0].lower()}{message[1:]}{shown}{more}"


def _followed(location: tuple, model: type[Section]) -> tuple[list[str], list[str]]:
    """The keys of pydantic's `location`, without the tags of unions, and the keys valid where it ends."""
    keys, models, free = [], [model], False  # free: any key may follow
    for part in location[:-1]:
        fields = [] if free else [m.model_fields[part].annotation for m in models if part in m.model_fields]
        if fields or free or isinstance(part, int):
            keys.append(str(part))
        free = any(typing.get_origin(annotation) is dict for annotation in fields)
        if fields:
            models = [section for annotation in fields for section in _sections(annotation)]
    return [*keys, str(location[-1])], [key for m in models for key in m.model_fields]


def _sections(annotation) -> list[type[Section]]:
    """The sections that an annotation admits."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [section for part in typing.get_args(annotation) for section in _sections(part)]

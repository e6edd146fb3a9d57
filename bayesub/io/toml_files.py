"""Reading input files: TOML validated against a pydantic model, with one clear line when it does not fit."""

import functools
import gzip
import inspect
import math
import operator
import re
import stat
import tomllib
import types
import typing
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import pydantic
from pydantic_core import CoreSchema, core_schema

from bayesub.io.atomic import reason
from bayesub.io.errors import InputError, check_known, nearest, printable

DATA = resources.files("bayesub") / "data"

# Unit at the end of a name -> largest size that a number with that name may have, far above anything that floats.
LARGEST = {"rpm_per_mps": 1e5, "deg_s": 1e4, "m": 1e7, "mps": 1e3, "kn": 2e3, "mps2": 1e4, "deg": 1e6, "degps": 1e5}
LARGEST |= {"degps2": 1e7, "rad": 1e5, "radps": 1e4, "radps2": 1e6, "s": 1e10, "kg": 1e10, "kgm2": 1e15, "kgm3": 1e5}
LARGEST |= {"n": 1e12, "bar": 1e6, "kpa": 1e9, "pa": 1e12, "rpm": 1e6}
MOST_TEXT, MOST_LOG = 1e8, 1e9  # bytes of a file of ours and of a log; of the latter some ten million rows
_DENSEST = 1032  # bytes in one of a .gz, at most
LARGEST |= dict.fromkeys(("mean", "sd", "lower", "upper", "median", "value"), 1e15)


def largest(name: str) -> float:
    """The largest size of a number of that name, by its unit; infinite without one."""
    return next((size for unit, size in LARGEST.items() if name == unit or name.endswith(f"_{unit}")), math.inf)


class Section(pydantic.BaseModel):
    """A table of an input file.

    Errors are unknown keys, values of another type than the key's, numbers that are not finite or too large for their
    unit, and texts of more than one line or with characters that cannot be seen.
    """

    model_config = pydantic.ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, strict=True)

    @pydantic.model_validator(mode="before")
    @classmethod
    def _with_tuples(cls, content):
        return {key: _as_tuple(value) for key, value in content.items()} if isinstance(content, dict) else content

    @pydantic.model_validator(mode="after")
    def _checked(self):
        self._check()
        return self

    def _check(self) -> None:
        """Raise ValueError or InputError if the keys of the table do not go together."""

    @pydantic.field_validator("*")
    @classmethod
    def _sensible(cls, value, info: pydantic.ValidationInfo):
        for one in _single(value):
            if isinstance(one, str) and printable(seen := one.replace("\xa0", " ")) != seen:
                raise ValueError(f"must be one line without control characters, found {one!r}")
            most = largest(info.field_name or "")
            if isinstance(one, float) and abs(one) > most:
                raise InputError(f"{one:g} is beyond {most:g}; check the unit", "unit")
        return value


class KindSection(Section):
    """A table whose key `kind` names what it describes, and whose other keys are the arguments of that in Python.

    It is read as the section of its kind. Kinds may be registered at any time, also after the model of such a file.
    """

    make: ClassVar[Callable[..., Any]]  # of the kind of a section
    not_keys: ClassVar[tuple[str, ...]] = ()  # arguments that are no keys of their own

    @classmethod
    def registered(cls) -> Mapping[str, Callable[..., Any]]:
        """Kind -> the function or class whose arguments are the keys."""
        raise NotImplementedError

    @classmethod
    def kinds(cls) -> tuple[type["KindSection"], ...]:
        """The section of each kind."""
        return tuple(_section_of(cls, kind, make) for kind, make in cls.registered().items())

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: pydantic.GetCoreSchemaHandler) -> CoreSchema:
        if "kind" in cls.model_fields:
            return handler(source)
        return core_schema.no_info_plain_validator_function(lambda content: _any_of(cls.kinds())(content))


@functools.cache
def _section_of(base: type[KindSection], kind: str, make: Callable[..., Any]) -> type[KindSection]:
    arguments = [a for a in inspect.signature(make, eval_str=True).parameters.values() if a.name not in base.not_keys]
    keys: dict[str, Any] = {a.name: (a.annotation, ... if a.default is a.empty else a.default) for a in arguments}
    keys = {"kind": (Literal[kind], ...)} | keys
    section = pydantic.create_model(f"{kind}_section", __base__=base, **keys)
    section.make = staticmethod(make)
    return section


@functools.cache
def _any_of(sections: tuple[type[KindSection], ...]) -> Callable[[Any], KindSection]:
    union: Any = functools.reduce(operator.or_, sections)
    adapter: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(Annotated[union, pydantic.Field(discriminator="kind")])
    return adapter.validate_python


def _as_tuple(value):
    """Lists as tuples, however deep; anything else as it is."""
    return tuple(map(_as_tuple, value)) if isinstance(value, list) else value


def _single(value) -> Iterator:
    """The numbers and texts of a value that may be a tuple or a table."""
    if isinstance(value, tuple | dict):
        for part in (*value, *value.values()) if isinstance(value, dict) else value:
            yield from _single(part)
    else:
        yield value


Positive = Annotated[float, pydantic.Field(gt=0)]
Length = Annotated[float, pydantic.Field(ge=0.01, le=1000.0)]  # of a boat, m
Speed = Annotated[float, pydantic.Field(ge=0.001, le=100.0)]  # of a boat, m/s
WaterDensity = Annotated[float, pydantic.Field(ge=500.0, le=2000.0)]  # of water, kg/m^3
Model = TypeVar("Model", bound=Section)


def built_in(kind: str) -> dict[str, Path]:
    """Name -> file of the built-in ``vehicles`` or ``manoeuvres``."""
    return {Path(f.name).stem: Path(str(f)) for f in sorted((DATA / kind).iterdir(), key=lambda f: f.name)}


def is_path(name: str) -> bool:
    """Whether a vehicle or manoeuvre is named by the path of a file, not by a built-in name."""
    return Path(name).suffix != ""


def find(name: str, kind: str) -> Path:
    """The file of a built-in name or of a path; InputError if there is neither."""
    files = built_in(kind)
    if name in files:
        return files[name]
    if not is_path(name):
        hint = f"built in are {', '.join(files)}; anything else must be the path of a file"
        check_known(name, files, f"no {kind.removesuffix('s')} '{name}'", hint=hint)
    return Path(name)


def find_log(name: str | Path) -> Path:
    """The file of a built-in log, by its name, or of a path."""
    folders = built_in("logs")
    return folders[str(name)] / "log.csv.gz" if str(name) in folders else Path(name)


def read_text(path: Path) -> str:
    """The text of a file, or an InputError that says why not."""
    with reading(path, MOST_TEXT):
        return path.read_text(encoding="utf-8-sig")


def read_line(path: Path) -> str:
    """The first line of a text file, plain or .gz, without the spaces around it, or an InputError that says why not."""
    opened = gzip.open if path.suffix == ".gz" else open
    with reading(path), opened(path, "rt", encoding="utf-8-sig") as file:
        return file.readline().strip()


@contextmanager
def reading(path: Path, most: float | None = None) -> Iterator[None]:
    """What cannot be read or is not UTF-8 text inside the block is an InputError that names `path`.

    So is what is no regular file, and what holds more than `most` bytes (MOST_LOG), unpacked if it is a .gz.
    """
    try:
        status, most = path.stat(), MOST_LOG if most is None else most
        if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
            raise InputError(f"{path}: is a device or a pipe; name a file", "file")
        size = status.st_size
        if path.suffix == ".gz" and _DENSEST * size > most >= size:
            size = _unpacked(path, status.st_mtime_ns, most)
        if size > most:
            raise InputError(f"{path}: holds more than {most:.3g} bytes; cut it, or thin out its rows", "limit")
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {reason(error)}", "file") from None
    except (EOFError, zlib.error):
        raise InputError(f"{path}: is damaged, or not whole; copy or pack it again", "format") from None
    except UnicodeDecodeError:
        text = path.read_text(encoding="utf-8", errors="surrogateescape")
        before, byte, _ = re.split("([\udc80-\udcff])", text, maxsplit=1)
        line = before.count("\n") + 1
        where = f"{path}: line {line}: is not UTF-8 text, found the byte 0x{ord(byte) - 0xDC00:02x}"
        raise InputError(f"{where}; save it as UTF-8", "format") from None


@functools.lru_cache
def _unpacked(path: Path, _: int, most: float) -> int:
    """Bytes in a .gz as it was at a time, counted up to just more than `most`."""
    size = 0
    with gzip.open(path, "rb") as file:
        while size <= most and (part := len(file.read(1 << 20))):
            size += part
    return size


def read_toml(path: Path, model: type[Model]) -> Model:
    """Read `path` into `model`; the InputError names file, key, what was found and what was expected."""
    return validate(read_toml_table(path), model, str(path))


def read_toml_table(path: Path) -> dict:
    """The plain content of a TOML file."""
    text = read_text(path)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: is not valid TOML: brackets are nested too deeply", "format") from None
    except ValueError as error:  # TOMLDecodeError, and that of a whole number of thousands of digits
        raise InputError(f"{path}: is not valid TOML: {str(error).partition(';')[0]}", "format") from None


def validate(content: dict, model: type[Model], source: str) -> Model:
    """Build `model` from `content`; `source` names the origin in the error."""
    try:
        return model.model_validate(content)
    except pydantic.ValidationError as error:
        sentence, kind, key = _refusal(error, model)
        raise InputError(f"{source}: {sentence}", kind, key) from None


def _refusal(error: pydantic.ValidationError, model: type[Section]) -> tuple[str, str, str]:
    """Sentence, kind and key of the first fault that pydantic found."""
    # A mistyped key is both unknown and missing; the unknown one tells more.
    first, *others = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    keys, siblings = _keys_and_siblings(first["loc"], model)
    if first["type"] == "value_error" and siblings and keys and keys[-1] not in siblings and not keys[-1].isdigit():
        keys.pop()  # the tag of a section that is wrong as a whole
    key = ".".join(keys)
    where = f"key '{key}': " if keys else ""
    more = f" (and {len(others)} more)" if others else ""
    if first["type"] == "missing":
        return f"key '{key}' is missing{more}", "missing", key
    if first["type"] == "extra_forbidden":
        hint = ", which others of its kind have" if keys[-1] in siblings else nearest(keys[-1], siblings)
        return f"unknown key '{key}'{hint}{more}", "unknown", key
    if first["type"].startswith("union_tag"):
        if not isinstance(first["input"], dict):
            return f"key '{key}': input should be a table{more}", "value", key
        context = first["ctx"]  # of the key that says which kind the section is of
        by = context["discriminator"].strip("'")
        key = f"{key}.{'model' if '(' in by else by}"
        if "tag" not in context:
            return f"key '{key}' is missing{more}", "missing", key
        kinds = context["expected_tags"].replace("'", "").split(", ")
        expected = nearest(context["tag"], kinds, f"expected one of {', '.join(kinds)}{more}")
        return f"key '{key}': unknown '{context['tag']}'{expected}", "unknown", key
    message = first["msg"].removeprefix("Value error, ").replace("a valid tuple", "a list")
    message = message.replace("valid dictionary or object to extract fields from", "table")
    value = repr(first["input"])
    is_clear = value in message or isinstance(first["input"], dict) or len(value) >= 80
    sentence = f"{where}{message[0].lower()}{message[1:]}{'' if is_clear else f', found {value}'}{more}"
    raised = first.get("ctx", {}).get("error")  # by a validator
    return sentence, raised.kind if isinstance(raised, InputError) else "value", key


def _keys_and_siblings(location: tuple, model: type[Section]) -> tuple[list[str], list[str]]:
    """The keys of pydantic's `location`, without the tags of unions, and the keys valid where it ends, if not any.

    A tag is what is no key of a section; that of a number in a table of any keys is in brackets.
    """
    location = tuple(part for part in location if not str(part).startswith("("))
    keys, models, free = [], [model], False  # free: any key may follow
    for part in location[:-1]:
        fields = [] if free else [m.model_fields[part].annotation for m in models if part in m.model_fields]
        if fields or free or isinstance(part, int):
            keys.append(str(part))
        alternatives = [one for a in fields for one in (typing.get_args(a) if isinstance(a, types.UnionType) else (a,))]
        free = any(typing.get_origin(one) is dict for one in alternatives)
        if fields:
            models = [section for annotation in fields for section in _sections(annotation)]
    return [*keys, *map(str, location[-1:])], [] if free else [key for m in models for key in m.model_fields]


def _sections(annotation: object) -> list[type[Section]]:
    """The sections that an annotation admits."""
    if isinstance(annotation, type) and issubclass(annotation, KindSection):
        return list(annotation.kinds())
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [section for part in typing.get_args(annotation) for section in _sections(part)]

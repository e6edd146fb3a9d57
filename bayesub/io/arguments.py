"""Arguments of the Python interface: of the classes that the annotations say, or one line that says what makes one."""

import functools
import inspect
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, SupportsFloat, TypeVar, cast, get_args, get_origin

from bayesub.io.errors import InputError

MADE_BY = {  # class -> what makes one
    "Vehicle": "bs.load_vehicle('suboff')",
    "Manoeuvre": "bs.load_manoeuvre('horizontal', vehicle)",
    "Record": "bs.observe(trajectory, sensors, rng)",
    "Trajectory": "bs.simulate(vehicle, manoeuvre)",
    "CoefficientPrior": "bs.priors.relative_normal(0.25)",
    "Prior": "bs.priors.normal(0.0, 1.0)",
    "Noise": "bs.likelihoods.Normal(0.1)",
    "UnknownDisturbance": "bs.UnknownDisturbance(..)",
    "Criteria": "bs.Criteria(ess=1000)",
    "JointProblem": "bs.JointProblem({'north': problem, ..})",
    "Posterior": "bs.sample(problem, rng=rng)",
    "Problem": "bs.Problem(vehicle, manoeuvre, record, ..)",
    "Move": "emcee.moves.StretchMove()",
    "Generator": "np.random.default_rng(1)",
}
WORDS = {
    "SupportsFloat": "number",
    "PathLike": "path or name",
    "Callable": "function",
    "Mapping": "dictionary",
    "Iterable": "list of names",
    "Emulated": "Problem",
}
_Function = TypeVar("_Function", bound=Callable[..., Any])


def checked(function: _Function) -> _Function:
    """The function, which raises an InputError for an argument that is of no class that its annotation names.

    Looked at are numbers, paths, functions, dictionaries and the classes of :data:`MADE_BY`, and nothing else.
    """
    wanted = {name: _classes(one.annotation) for name, one in inspect.signature(function).parameters.items()}
    title = function.__qualname__.removesuffix(".__init__")

    @functools.wraps(function)
    def call(*arguments, **named):
        for name, value in [*zip(wanted, arguments, strict=False), *named.items()]:
            if wanted.get(name):
                check_class(f"{title}: {name}", value, *wanted[name], key=name)
        return function(*arguments, **named)

    return cast(_Function, call)


def check_class(what: str, value: Any, *classes: type, key: str) -> Any:
    """The value; InputError about the `key` if it is of no such class; the message begins with `what` it is."""
    if not isinstance(value, classes):
        name = WORDS.get(classes[0].__name__, classes[0].__name__)
        remedy = f"; {MADE_BY[name]} makes one" if name in MADE_BY else ""
        article = "an" if name[0] in "AEIOU" else "a"
        found = repr(value) if isinstance(value, str | SupportsFloat | None) else f"a {type(value).__name__}"
        raise InputError(f"{what} must be {article} {name}, found {found}{remedy}", "value", key)
    return value


def _classes(annotation: object) -> tuple[type, ...]:
    """The classes that an argument may have; none if it is not looked at."""
    kinds = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    kinds = tuple(get_origin(kind) or kind for kind in kinds)
    plain: dict[Any, Any] = {float: SupportsFloat, int: SupportsFloat, Path: os.PathLike, NoneType: NoneType}
    plain |= {Callable: Callable, Mapping: Mapping} | ({str: str} if Path in kinds else {})
    named = [plain.get(kind, kind) for kind in kinds]
    named.sort(key=lambda kind: kind in (str, NoneType))  # the first is what a message asks for
    known = all(kind in plain or getattr(kind, "__name__", "") in MADE_BY for kind in kinds)
    return tuple(cast(list[type], named)) if known and named != [NoneType] else ()

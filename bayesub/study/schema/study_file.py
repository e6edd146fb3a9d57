"""The content of a study file, section by section, and quantities of its own: a Python function of boats each."""

import ast
import importlib.util
import json
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.arguments import checked
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Positive, Section
from bayesub.model.equations import EquationSet
from bayesub.model.equations.files import DEFAULT
from bayesub.model.vehicles import files_of_equations
from bayesub.study import sources
from bayesub.study.provenance import copies, environment
from bayesub.study.schema.disturbance_section import DisturbanceSection
from bayesub.study.schema.prior_section import NoiseSection, PriorSection
from bayesub.study.schema.sensor_section import ControlSection, SensorSection
from bayesub.study.schema.trial_section import CheckSection, TrialKeys, TrialSection

if TYPE_CHECKING:
    from bayesub.model.boats import Boats
    from bayesub.model.quantities import Quantity
    from bayesub.model.vehicles import Vehicle

_COMPUTE = ("bayesub.study.run.infer", "bayesub.study.run.prepare")  # what makes the numbers of a study in TOML


class DerivedSection(Section):
    """A quantity of a study's own, whose function takes boats, n of them (:class:`bayesub.model.boats.Boats`).

    The function returns n numbers, not a number where a boat has none. Its file must not need others beside it.
    """

    name: str = pydantic.Field(pattern=r"^[a-z][a-z0-9_]*$")  # ends with the unit, as in ``first_dive_m``
    function: str = pydantic.Field(pattern=r"^[^:]+\.py:[A-Za-z_]\w*$")  # ``file.py:function``, relative to the study
    meaning: str = ""  # one sentence for the report
    none: str = "the function says so"  # what is so of a boat that has no such value

    @property
    def file(self) -> str:
        """The file of the function."""
        return self.function.rpartition(":")[0]

    def build(self, vehicle: "Vehicle", path: Callable[[str], str], *, run_code: bool) -> "Quantity":
        """The quantity, whose function has been tried on the vehicle.

        `path`: where the file is, by its name in the study; `run_code`: whether the file may be run, if not it is
        parsed, and the function of the quantity gives nothing. InputError for a name that is taken, a function that is
        not there, and one that fails or returns something else.
        """
        from bayesub.model.boats import Boats  # they import numba, which a study file is read without
        from bayesub.model.quantities import QUANTITIES, Quantity

        if self.name in QUANTITIES:
            text = f"derived: '{self.name}' is built in and needs no function; give another name"
            raise InputError(text, "conflict", self.name)
        file = Path(path(self.file))
        _check_parsed(file, self.function)
        if not run_code:
            return Quantity(self.name, "", self.meaning, (), "", lambda boats: np.full(len(boats), np.nan), self.none)
        function = partial(_called, self.function, _function(file, self.function))
        function(Boats(vehicle, np.tile(vehicle.xi, (2, 1))))
        return Quantity(self.name, "", self.meaning, (), "", function, self.none)


def _check_parsed(path: Path, function: str) -> None:
    """InputError for a file that is not Python, or that binds no such name; the file is not run."""
    name = function.rpartition(":")[2]
    try:
        tree = ast.parse(toml_files.read_text(path))
    except (SyntaxError, ValueError) as error:
        raise InputError(f"derived: {path} cannot be run: {_words(error)}", "format", "derived.file") from None
    functions = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    names |= {a.asname or a.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for a in node.names}
    if name not in names and "*" not in names:
        check_known(name, functions, f"derived: {path} has no function '{name}'", key="derived.function")


def _function(path: Path, function: str) -> Callable:
    """The function of a file; the file is run."""
    name = function.rpartition(":")[2]
    spec = importlib.util.spec_from_file_location(f"derived_{re.sub(r'[^A-Za-z0-9]', '_', path.stem)}", path)
    assert spec is not None  # as the name of the file ends with .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a file of the user's raises
        raise InputError(f"derived: {path} cannot be run: {_words(error)}", "format", "derived.file") from None
    if not callable(getattr(module, name, None)):
        valid = [key for key, value in vars(module).items() if callable(value)]
        check_known(name, valid, f"derived: {path} has no function '{name}'", key="derived.function")
    return getattr(module, name)


def _called(name: str, function: Callable, boats: "Boats") -> np.ndarray:
    """The values (n,) of a function of a user's."""
    try:
        values = np.asarray(function(boats), dtype=float)
    except Exception as error:  # whatever a function of the user's raises
        raise InputError(f"derived: {name} fails: {_words(error)}", "value", name) from None
    if values.shape != (len(boats),):
        text = f"derived: {name} returns shape {values.shape} for {len(boats)} boats"
        raise InputError(f"{text}; return one number for each, ({len(boats)},)", "value", name)
    return values


def _words(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


class FreeSection(Section):
    """The coefficients that are inferred: a sub-problem, "all", or names; those that are zero stay zero."""

    coefficients: Literal["horizontal", "vertical", "all"] | tuple[str, ...]

    def names(self, equations: EquationSet) -> tuple[str, ...]:
        """Names of the coefficients of a set; InputError for a sub-problem that it does not have."""
        if isinstance(self.coefficients, str):
            return equations.active(subproblem=None if self.coefficients == "all" else self.coefficients)
        return self.coefficients


class BaselinesSection(Section):
    """The deterministic methods to compare with."""

    # Of a simulated trial only: it takes the motion without noise, and nuisance parameters have no part in it
    linear_least_squares: bool = True
    # Searches from random starts, of the coefficients and of the nuisance parameters that move the readings
    sqp_starts: int = pydantic.Field(default=5, ge=0, le=1000)


class SamplerSection(Section):
    """Size of the sampler, and its stopping rule; `rhat`, `ess`, `taus`, `look` are as in :class:`bayesub.Criteria`."""

    n_ensembles: int = pydantic.Field(default=4, ge=1, le=64)
    n_walkers: int | None = pydantic.Field(default=None, ge=4, le=4096)  # of each; by default that of bayesub.sample
    max_steps: int = pydantic.Field(default=20_000, ge=100)  # the run ends here, converged or not
    max_misfit: Positive = 4.0  # median residual of a channel at the mode, over its noise; above it nothing is sampled
    rhat: float = pydantic.Field(default=1.01, gt=1.0)
    ess: Positive = 400.0
    taus: Positive = 25.0
    look: int | None = pydantic.Field(default=None, ge=10)
    start: str | None = None  # posterior.nc of a run of fewer trials, from where search and learning begin


class Study(TrialKeys):
    """A study in TOML: one inference question.

    There is one trial, simulated (`manoeuvre`) or from a log (`data`), or there are several, in `trials`. `seed` gives
    a stream of random numbers each to data, guess, SQP, sampling and cross-check. Paths are relative to the study file.
    """

    SOURCES: ClassVar[tuple[str, ...]] = ("manoeuvre", "data", "trials")

    name: str = pydantic.Field(pattern=r"^[A-Za-z0-9_-]+$")  # names the run folder too
    question: str = ""
    vehicle: str  # built-in name, or path of a vehicle file
    trials: tuple[TrialSection, ...] | None = pydantic.Field(default=None, min_length=1)  # several trials of one boat
    check: tuple[CheckSection, ...] | None = None  # logs that are not fitted, which the posterior is to predict
    seed: int = pydantic.Field(ge=0)
    # time step of the fit; by default the longest whose error is below a tenth of the sd of every reading. Truth is
    # flown at a tenth of it.
    dt_s: Positive | None = None
    sensors: tuple[SensorSection, ...] = ()  # of the trial, and of those of `trials` without their own
    # name of an actuator -> its column in logs, where it is not that of the vehicle
    controls: dict[str, ControlSection] = pydantic.Field(default_factory=dict)
    free: FreeSection
    prior: PriorSection
    # column -> noise model, where it is not the one of the sensor
    noise: dict[str, NoiseSection] = pydantic.Field(default_factory=dict)
    # unmodelled forces, whose histories are inferred; the process is that of all trials
    disturbance: DisturbanceSection | None = None
    # quantities of the report that follow from the coefficients, besides the built-in ones
    derived: tuple[DerivedSection, ...] = ()
    baselines: BaselinesSection = BaselinesSection()
    sampler: SamplerSection = SamplerSection()
    quick: dict = pydantic.Field(default_factory=dict)  # what the small version changes, section by section

    _source: str = pydantic.PrivateAttr(default="")
    _folder: Path = pydantic.PrivateAttr(default=Path())
    _places: dict[str, Path] = pydantic.PrivateAttr(default_factory=dict)
    _is_quick: bool = pydantic.PrivateAttr(default=False)

    def _check(self):
        super()._check()
        names = [name for name, *_ in self.each_trial()]
        for name, trial, sections in self.each_trial():
            of = f" for trial '{name}'" if name else ""
            if names.count(name) > 1:
                raise InputError(f"two trials are named '{name}'", "conflict")
            if not sections:
                raise InputError(f"give at least one of [[sensors]]{of}", "missing")
            if trial.data is not None and self.prior.centre == "perturbed":
                what = "prior.centre 'perturbed' is a guess about a simulated truth, and contradicts 'data'"
                raise InputError(f"{what}; leave it out, the centre is then the vehicle file", "conflict")
        checks, derived = [check.name for check, _ in self.each_check()], [quantity.name for quantity in self.derived]
        for what, given in (("two checks", checks), ("two of [[derived]]", derived)):
            for name in given:
                if given.count(name) > 1:
                    raise InputError(f"{what} are named '{name}'; give each its own name", "conflict")
        for name, (_, sections) in zip(checks, self.each_check(), strict=True):
            if name in names:
                raise InputError(f"a check and a trial are named '{name}'; give the check another name", "conflict")
            if not sections:
                raise InputError(f"give at least one of [[sensors]] for check '{name}'", "missing")

    @property
    def is_quick(self) -> bool:
        """Whether this is the small version."""
        return self._is_quick

    def path(self, name: str) -> str:
        """Where a file is that the study or its vehicle names (see :meth:`located`); a built-in name as it is."""
        place = (self._folder / name).resolve() if toml_files.is_path(name) else name
        return str(self._places.get(name, place))

    @property
    def source(self) -> str:
        """The file that the study was read from, for messages."""
        return self._source

    def located(self, source: Path, places: dict[str, Path], *, quick: bool) -> "Study":
        """The same study, read from `source`, whose files are at `places` (name in the study -> path)."""
        study = self.model_copy()
        study._source, study._places, study._is_quick = str(source), places, quick
        study._folder = source.parent.resolve()
        return study

    def each_trial(self) -> Iterator[tuple[str, TrialKeys, tuple]]:
        """Name ("" for the only one), source and sensor sections of each trial."""
        if self.trials is None:
            yield "", self, self.sensors
        for trial in self.trials or ():
            yield trial.name, trial, self.sensors if trial.sensors is None else trial.sensors

    def each_check(self) -> Iterator[tuple[CheckSection, tuple]]:
        """Each log that is not fitted, and the sections of its sensors; what the study ignores it ignores too."""
        for check in self.check or ():
            if check.ignore is None and self.ignore and check.data and Path(self.path(check.data)).is_file():
                header = toml_files.read_line(Path(self.path(check.data))).split(",")
                check = check.model_copy(update={"ignore": tuple(name for name in self.ignore if name in header)})
            yield check, self.sensors if check.sensors is None else check.sensors

    @property
    def files(self) -> list[str]:
        """The files that the study names, as it names them: vehicle, priors, functions, manoeuvres, logs, each once."""
        trials = [*(trial for _, trial, _ in self.each_trial()), *(check for check, _ in self.each_check())]
        logs = toml_files.built_in("logs")
        functions = [quantity.file for quantity in self.derived]
        paths = [self.prior.table, self.sampler.start, *functions]
        paths += [trial.data for trial in trials if trial.data not in logs]
        names = [self.vehicle, *(trial.manoeuvre for trial in trials)]
        paths += [name for name in names if name is not None and toml_files.is_path(name)]
        return list(dict.fromkeys(path for path in paths if path is not None))

    def config(self) -> dict:
        """The study with every default, its paths as in the study file, and what else its result depends on."""
        content = self.model_dump(exclude_none=True, mode="json")
        digests = self._digests()
        tables = [toml_files.read_text(Path(self.path(name))) for name in digests if name.endswith(".toml")]
        rooms = sources.rooms(_COMPUTE, [json.dumps(content), DEFAULT, *tables])
        return content | {"files_sha256": digests} | environment(rooms, quick=self.is_quick)

    def copies(self) -> dict[str, Path]:
        """What a run folder keeps of the files that the study and its vehicle name: place in the folder -> file."""
        digests = self._digests()
        return copies({name: Path(self.path(name)) for name in digests}, digests)

    def _digests(self) -> dict[str, str]:
        """File that the study names, or its vehicle -> digest."""
        digests = {name: sources.file_digest(Path(self.path(name))) for name in self.files}
        equations = files_of_equations(self.vehicle, self.path)
        return digests | {name: sources.file_digest(Path(self.path(name))) for name in equations}


@checked
def load_study(path: str | Path, *, quick: bool = False) -> Study:
    """Read a study file; with `quick` its ``[quick]`` section overrides the others.

    InputError names file, key and remedy.
    """
    path = Path(path)
    study = toml_files.read_toml(path, Study)
    if quick:
        content = study.model_dump(exclude_none=True)
        for section, changes in study.quick.items():
            if isinstance(changes, dict) and isinstance(content.get(section), dict):
                content[section] |= changes
            else:
                content[section] = changes
        study = toml_files.validate(content, Study, f"{path} with its [quick] section")
    return study.located(path, {name: (path.parent / name).resolve() for name in study.files}, quick=quick)

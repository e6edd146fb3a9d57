"""Priors and noise models in study files."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import KindSection, Positive, Section
from bayesub.logs import log_files
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.sensors import Channel

if TYPE_CHECKING:
    from bayesub.problem.noise import Noise

LogSd = Annotated[float, pydantic.Field(gt=0, le=10)]  # ten is a factor of 22,000


class PriorOfOne(Section):
    """The prior of one parameter, in its unit: a pair of keys, or a value that it is fixed at.

    `mean` and `sd` are of a normal prior, `lower` and `upper` of a uniform, `median` and `log_sd` of a log-normal one.
    """

    mean: float | None = None
    sd: Positive | None = None
    lower: float | None = None
    upper: float | None = None
    median: float | None = None
    log_sd: LogSd | None = None
    value: float | None = None

    def _check(self):
        given = tuple(self.model_dump(exclude_none=True))
        if given not in (*_KINDS, ("value",)):
            raise InputError("a prior is mean and sd, lower and upper, median and log_sd, or a fixed value", "conflict")
        if given in _KINDS:
            self.build()

    def build(self) -> priors.Prior:
        """The prior of one that is not fixed at a value."""
        given = self.model_dump(exclude_none=True)
        return _KINDS[tuple(given)](**given)


_KINDS: dict[tuple[str, ...], Callable[..., priors.Prior]] = {
    ("mean", "sd"): priors.normal,
    ("lower", "upper"): priors.uniform,
    ("median", "log_sd"): priors.log_normal,
}
_WIDTHS = {
    "relative_normal": "sd",
    "relative_uniform": "half_width",
    "relative_log_normal": "log_sd",
    "relative_hierarchical": "log_sd",
    "vehicle": "sd",
}


class PriorSection(Section):
    """The prior of the coefficients: a spread for all, with a relative width by its kind, and what is given of some.

    "vehicle" takes standard deviations and correlations of the vehicle file; `sd`, if given, is relative, of the rest.
    """

    kind: Literal["relative_normal", "relative_uniform", "relative_log_normal", "relative_hierarchical", "vehicle"]
    sd: Positive | None = None
    half_width: Positive | None = None
    log_sd: LogSd | None = None
    by_axis: bool = False  # whether the unknown scale of a "relative_hierarchical" prior is one for each axis
    centre: Literal["vehicle", "perturbed"] = "vehicle"  # perturbed: a guess about the truth of a simulated trial
    perturbation_sd: Positive = 0.25  # relative, of that guess
    given: dict[str, PriorOfOne] = pydantic.Field(default_factory=dict)  # coefficient -> its own prior
    table: str | None = None  # CSV of further ones, columns coefficient, mean, sd; an sd of zero fixes the coefficient
    correlations: tuple[tuple[str, str, float], ...] = ()  # of two coefficients that are given by mean and sd

    def _check(self):
        wanted = _WIDTHS[self.kind]
        given = [key for key in dict.fromkeys(_WIDTHS.values()) if getattr(self, key) is not None]
        if given != [wanted] and (given or self.kind != "vehicle"):
            text = f"a {self.kind} prior needs '{wanted}', found {' and '.join(given) or 'nothing'}"
            raise InputError(text, "conflict" if given else "missing")
        if self.by_axis and self.kind != "relative_hierarchical":
            raise InputError(f"by_axis is of a relative_hierarchical prior, found {self.kind}", "conflict")
        if self.kind != "vehicle":
            getattr(priors, self.kind)(getattr(self, wanted))  # refuses a width

    def build(
        self, centre: np.ndarray, vehicle: Vehicle, path: Callable[[str], str] = str
    ) -> tuple[priors.Spread | priors.Given, dict[str, float]]:
        """The prior of the coefficients, and the values of those that are fixed.

        `centre` (n_terms,): where the spread is about; `vehicle`: its standard deviations are those of the kind
        "vehicle"; `path`: gives the path of a file that the study names.
        """
        spread, of_vehicle, related = self._spread(centre, vehicle)
        names = vehicle.equations.names
        given = ({} if self.table is None else _table(Path(path(self.table)), names)) | self.given
        fixed = {name: one.value for name, one in given.items() if one.value is not None}
        built = of_vehicle | {name: one.build() for name, one in given.items() if name not in fixed}
        for name in fixed:
            check_known(name, names, f"prior: unknown coefficient '{name}'")
        if not built and not self.correlations:
            return spread, fixed
        kept = tuple(one for one in related if not {*one[:2]} & given.keys())  # what is given goes before the file
        return priors.Given(spread, built, (*kept, *self.correlations)), fixed

    def _spread(self, centre, vehicle) -> tuple[priors.Spread, dict[str, priors.Prior], tuple]:
        """The spread of all coefficients, and the priors that the vehicle file gives, with their correlations."""
        if self.kind != "vehicle":
            options = {"by_axis": True} if self.by_axis else {}
            return getattr(priors, self.kind)(getattr(self, _WIDTHS[self.kind]), centre, **options), {}, ()
        if self.sd is None and not np.isfinite(vehicle.sd).any():
            what = f"prior: vehicle '{vehicle.name}' gives no coefficient an sd; write {{ value = .., sd = .. }} in"
            raise InputError(f"{what} its file, or add the relative 'sd' of all", "missing", "prior.sd")
        if self.centre == "perturbed" and vehicle.correlation is not None:
            what = f"prior: vehicle '{vehicle.name}' has correlations, which a centre that is perturbed coefficient by"
            remedy = 'leave out centre = "perturbed"'
            raise InputError(f"{what} coefficient contradicts; {remedy}", "conflict", "prior.centre")
        otherwise = None if self.sd is None else priors.relative_normal(self.sd, centre)
        prior = priors.from_vehicle(vehicle, otherwise, centre)
        return prior.others, prior.priors, prior.correlations


def _table(path: Path, names: tuple[str, ...]) -> dict[str, PriorOfOne]:
    """Priors of a CSV file with the columns coefficient, mean, sd; what follows a # is a remark."""
    lines = enumerate(toml_files.read_text(path).splitlines(), start=1)
    rows = [(n, [cell.strip() for cell in line.partition("#")[0].split(",")]) for n, line in lines]
    rows = [(n, cells) for n, cells in rows if any(cells)]
    if not rows:
        raise InputError(f"{path}: is empty; expected a header line coefficient,mean,sd", "format", "prior.table")
    (_, header), *rows = rows
    if header != ["coefficient", "mean", "sd"]:
        text = f"{path}: columns must be coefficient,mean,sd, found {','.join(header)}"
        raise InputError(text, "format", "prior.table")
    priors_of, most = {}, toml_files.largest("mean")
    for line, (name, *cells) in rows:
        check_known(name, names, f"{path}: line {line}: unknown coefficient '{name}'")
        if name in priors_of:
            raise InputError(f"{path}: line {line}: coefficient '{name}' is given twice", "conflict", name)
        try:
            mean, sd = map(float, cells)
        except ValueError:
            mean = sd = math.nan
        if not (abs(mean) <= most and 0 <= sd <= most):
            text = f"{path}: line {line}: mean and sd must be two numbers and sd not negative, at most {most:g}"
            raise InputError(f"{text}, found {', '.join(cells) or 'nothing'}", "value", "prior.table")
        priors_of[name] = PriorOfOne(mean=mean, sd=sd) if sd > 0 else PriorOfOne(value=mean)
    return priors_of


class NoiseSection(KindSection):
    """Keys of all noise models of a channel; others are those of its kind (:class:`bayesub.problem.noise.Noise`)."""

    sd: Positive | None = None  # in the unit of the column; by default that of noise and rounding of the sensor

    not_keys: ClassVar = ("sd",)

    @classmethod
    def registered(cls) -> Mapping[str, type["Noise"]]:
        """The noise models that have a name in files."""
        from bayesub.problem.likelihoods import Noise

        return Noise.KINDS

    def build(self, channel: Channel) -> "Noise":
        """The noise model, in SI units."""
        given = self.model_dump(exclude={"kind", "sd"})
        factor = log_files.si_factor(channel.quantity)
        return self.make(channel.total_sd if self.sd is None else factor * self.sd, **given)


def noise_models(sections: Mapping[str, NoiseSection], trials: Sequence[Sequence[Channel]]) -> list[dict[str, "Noise"]]:
    """For the channels of each trial: channel name -> noise model, of sections by column.

    Raises InputError for a column that no sensor of any trial reads.
    """
    by_column = [{log_files.HEADERS[channel.quantity]: channel for channel in channels} for channels in trials]
    known = {column for columns in by_column for column in columns}
    for column in sections:
        check_known(column, known, f"noise.{column}: no sensor reads that column", key=f"noise.{column}")
    return [
        {columns[c].name: section.build(columns[c]) for c, section in sections.items() if c in columns}
        for columns in by_column
    ]

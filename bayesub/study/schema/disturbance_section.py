"""Unmodelled forces in study files: those that a fit infers, and those that a simulated truth feels."""

from __future__ import annotations

from collections.abc import Container, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.toml_files import Positive, Section
from bayesub.model.disturbance import CURRENTS, Disturbance, by_time, check_axes, hull_force_rms, unit
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.distributions import Prior
from bayesub.problem.disturbances import CORRELATION_TIME, CURRENT_TIME, UnknownDisturbance, force_scales
from bayesub.study.schema.prior_section import LogSd

if TYPE_CHECKING:  # the simulator needs numba, of which importing takes a second
    from bayesub.model.simulator import Simulator
    from bayesub.model.trajectory import Trajectory

# Key -> the axes that it may be given for, and its largest value, far above anything that floats.
WAYS = {"sd": (AXES, 1.0), "sd_n": (AXES[:3], 1e12), "sd_nm": (AXES[3:], 1e15), "share": (AXES, 10.0)}
WAYS |= {"sd_mps": (CURRENTS, 100.0)}
LEAST = 1e-20  # of the largest value: less moves nothing
_UNITS = {"sd_n": "in newton", "sd_nm": "in newton metre", "sd_mps": "in m/s"}
_KINDS = {"sd_n": "a force", "sd_nm": "a moment", "sd_mps": "a current"}


class LogNormalPrior(Section):
    """The prior of a positive number."""

    median: Positive
    log_sd: LogSd

    def build(self, factor: float = 1.0) -> priors.Prior:
        """The prior of `factor` times the number."""
        return priors.log_normal(factor * self.median, self.log_sd)


_SUITED = dict.fromkeys("XYZ", "sd_n") | dict.fromkeys("KMN", "sd_nm") | dict.fromkeys(CURRENTS, "sd_mps")

Amount = Annotated[
    Annotated[Positive, pydantic.Tag("(number)")] | Annotated[LogNormalPrior, pydantic.Tag("(prior)")],
    pydantic.Discriminator(lambda value: "(prior)" if isinstance(value, dict | LogNormalPrior) else "(number)"),
]


class DisturbanceSection(Section):
    """Unmodelled forces as random processes, whose histories are inferred.

    Each axis has its own sd, in one of four ways: a table of them by axis. A number or a prior in place of a table is
    that of every axis that the key is for.
    """

    axes: tuple[str, ...]  # of X Y Z K M N, and north and east for a current that varies in time
    sd: dict[str, Amount] | None = None  # forces over (rho/2) l^2 U^2, moments over (rho/2) l^3 U^2, U the trial speed
    sd_n: dict[str, Amount] | None = None  # of a force, N
    sd_nm: dict[str, Amount] | None = None  # of a moment, N m
    share: dict[str, Amount] | None = None  # over the hull's own force (bayesub.model.disturbance.hull_force_rms)
    sd_mps: dict[str, Amount] | None = None  # of the current, m/s
    correlation_time_s: Amount
    correlation_time_current_s: Amount | None = None  # of the current, if it is not that of the forces
    kind: Literal["ornstein_uhlenbeck", "matern_3_2"] = "ornstein_uhlenbeck"  # of bayesub.model.disturbance.Disturbance
    knot_interval_s: Positive | None = None  # between the forces that are inferred; by default UnknownDisturbance's

    @pydantic.model_validator(mode="before")
    @classmethod
    def _by_axis(cls, content):
        """A number or a prior of several axes is written out for each of them."""
        axes = content.get("axes") if isinstance(content, dict) else None
        if not isinstance(axes, list | tuple):
            return content
        single = {
            key: value
            for key in WAYS
            if (value := content.get(key)) is not None
            and (not isinstance(value, dict) or (value and value.keys() <= LogNormalPrior.model_fields.keys()))
        }
        return content | {key: {a: value for a in axes if a in WAYS[key][0]} for key, value in single.items()}

    def _check(self):
        try:
            check_axes(self.axes)
        except InputError as error:
            raise InputError(str(error).removeprefix("disturbance: "), error.kind) from None
        axes = " ".join(self.axes)
        for key, (suited, largest) in WAYS.items():
            values = getattr(self, key)
            if values is None:
                continue
            if not values:
                raise InputError(f"{key}: the axes {axes} have no {' '.join(suited)}; leave it out", "conflict")
            for axis, value in values.items():
                if axis in self.axes and axis not in suited:
                    text = f"{key} is {_UNITS.get(key, 'of a force')}, and {axis} is {_KINDS[_SUITED[axis]]}"
                    raise InputError(f"{text}; give it in {_SUITED[axis]}", "conflict")
                if axis not in self.axes:
                    raise InputError(f"{key} has the axis '{axis}', and axes has {axes}", "conflict")
                number = value.median if isinstance(value, LogNormalPrior) else value
                if number > largest:
                    hint = "; a force in newton is sd_n, a moment in newton metre is sd_nm" if key == "sd" else ""
                    raise ValueError(f"{key} of {axis} must be at most {largest:g}, found {number:g}{hint}")
                if number < LEAST * largest:
                    hint = "a force so small moves nothing, leave its axis out"
                    raise ValueError(f"{key} of {axis} must be at least {LEAST * largest:g}, found {number:g}; {hint}")
        for axis in self.axes:
            keys = [key for key in WAYS if axis in (getattr(self, key) or {})]
            if len(keys) != 1:
                others = ", ".join(key for key, (suited, _) in WAYS.items() if axis in suited)
                found = " and ".join(keys) or "none"
                raise InputError(f"axis {axis} has its sd in one of {others}; found {found}", "conflict")
        currents = [axis for axis in self.axes if axis in CURRENTS]
        if self.correlation_time_current_s is not None and len(currents) in (0, len(self.axes)):
            text = f"correlation_time_current_s is that of a current besides forces, and axes has {axes}"
            raise InputError(f"{text}; give correlation_time_s alone", "conflict")

    def units(self, simulators: Sequence[Simulator]) -> np.ndarray:
        """(n_axes,) what a unit of the number of each axis is, N, N m or m/s.

        The simulators are those of the trials. InputError for an axis that rests in a trial, and a share of no force.
        """
        for simulator in simulators:
            check_axes(self.axes, simulator.subproblem)
        units = force_scales(simulators[0].vehicle, self.axes)
        rms = hull_force_rms(simulators) if self.share else np.zeros(len(AXES))
        for k, axis in enumerate(self.axes):
            if axis in (self.sd_n or {}) or axis in (self.sd_nm or {}):
                units[k] = 1.0
            elif axis in (self.share or {}):
                units[k] = rms[AXES.index(axis)]
                if not units[k] > 0.0:
                    text = f"disturbance: the hull's own {axis} is zero in this manoeuvre, and so is a share of it"
                    way = "sd or sd_n" if axis in AXES[:3] else "sd or sd_nm"
                    raise InputError(f"{text}; give {way}", "conflict", f"disturbance.share.{axis}")
        return units

    def amount(self, axis: str) -> float | LogNormalPrior:
        """The number or prior of an axis, in the unit of its key."""
        return next(values[axis] for values in (getattr(self, key) or {} for key in WAYS) if axis in values)

    def build(self, simulators: Sequence[Simulator]) -> UnknownDisturbance:
        """The unmodelled forces that all trials, of one vehicle, share as a process; InputError as of :meth:`units`."""
        factors = self.units(simulators) / force_scales(simulators[0].vehicle, self.axes)
        amounts = {axis: (self.amount(axis), factor) for axis, factor in zip(self.axes, factors, strict=True)}
        sds = {axis: _built(amount, factor) for axis, (amount, factor) in amounts.items()}
        of_current = None if self.correlation_time_current_s is None else _built(self.correlation_time_current_s)
        time = _built(self.correlation_time_s)
        return UnknownDisturbance(self.axes, sds, time, self.kind, self.knot_interval_s, of_current)


class TrueDisturbanceSection(DisturbanceSection):
    """Unmodelled forces that a simulated truth feels: as those that are inferred, with numbers."""

    def _check(self):
        super()._check()
        if self.knot_interval_s is not None:
            raise InputError("knot_interval_s is of forces that are inferred; leave it out", "conflict")
        for key in ("correlation_time_s", "correlation_time_current_s", *WAYS):
            value = getattr(self, key)
            amounts = value.values() if isinstance(value, dict) else (value,)
            if any(isinstance(amount, LogNormalPrior) for amount in amounts):
                message = f"{key} is a prior, and what a simulated boat feels is known; give a number"
                raise InputError(message, "conflict")

    def known(self, simulator: Simulator) -> Disturbance:
        """The process on the manoeuvre of a simulator; InputError as of :meth:`units`."""
        sds = np.array([self.amount(axis) for axis in self.axes]) * self.units([simulator])
        time, of_current = cast(float, self.correlation_time_s), cast(float | None, self.correlation_time_current_s)
        return Disturbance(self.axes, sds, time, self.kind, of_current)

    def flown(self, trajectory: Trajectory, rng: np.random.Generator) -> tuple[Trajectory, Disturbance]:
        """The same trial with a history of the process, and the process.

        `rng` spawns a stream of random numbers for it, so that the noise of readings is the same with and without it.

        Raises InputError as of :meth:`units`, and for a correlation time shorter than the step.
        """
        simulator, (stream,) = trajectory.simulator, rng.spawn(1)
        process = self.known(simulator)
        return simulator.disturbed(process, stream).trajectory(trajectory.xi), process


def correlation_times(disturbance: Disturbance) -> dict[str, float]:
    """Name of a correlation time (:mod:`bayesub.problem.disturbances`) -> its value, s."""
    time, of_current = disturbance.correlation_time_s, disturbance.correlation_time_current_s
    named = None if of_current is None else (CURRENT_TIME, of_current)
    return dict(pair for pair, *_ in by_time(disturbance.axes, disturbance.kind, (CORRELATION_TIME, time), named))


def true_parameters(disturbance: Disturbance, vehicle: Vehicle) -> dict[str, float]:
    """Name of a parameter of the process (:mod:`bayesub.problem.disturbances`) -> its value in a truth."""
    sds = disturbance.sds / force_scales(vehicle, disturbance.axes)
    values = {f"sd_disturbance_{axis}": float(sd) for axis, sd in zip(disturbance.axes, sds, strict=True)}
    return values | correlation_times(disturbance)


def in_words(disturbance: Disturbance, rms: np.ndarray | None = None, inferred: Container[str] = ()) -> str:
    """Sds and correlation time, such as ``sd X 1.2 N (1.5 % of the hull's), N about 0.5 N m, correlation time 4 s``.

    `rms` (6,): forces of the hull, N and N m, of which the shares are given; `inferred`: axes, and names of correlation
    times, whose numbers are medians of priors.
    """
    parts = []
    for axis, sd in zip(disturbance.axes, disturbance.sds, strict=True):
        hull = 0.0 if rms is None or axis in CURRENTS else rms[AXES.index(axis)]
        share = f" ({100.0 * sd / hull:.2g} % of the hull's)" if hull > 0.0 else ""
        about = "about " if axis in inferred else ""
        parts.append(f"{axis} {about}{sd:.3g} {unit(axis)}{share}")
    times = [
        f"correlation time {'of the current ' if name == CURRENT_TIME else ''}{'about ' if name in inferred else ''}"
        f"{time:g} s"
        for name, time in correlation_times(disturbance).items()
    ]
    return f"sd {', '.join(parts)}, {', '.join(times)}"


def central(unknown: UnknownDisturbance, vehicle: Vehicle) -> tuple[Disturbance, tuple[str, ...]]:
    """The process with the medians of its priors, and what has a prior: axes, and names of correlation times."""
    sds = np.array([unknown.sd(axis) for axis in unknown.axes]) * force_scales(vehicle, unknown.axes)
    amounts = {**unknown.sds, **unknown.times}
    inferred = tuple(key for key, amount in amounts.items() if isinstance(amount, Prior))
    time = unknown.time(CORRELATION_TIME) or unknown.time_s
    return Disturbance(unknown.axes, sds, time, unknown.kind, unknown.time(CURRENT_TIME)), inferred


class DisturbanceFile(Section):
    """Unmodelled forces, for ``bayesub simulate --disturbance``."""

    disturbance: TrueDisturbanceSection


def read_disturbance(path: str | Path) -> TrueDisturbanceSection:
    """The unmodelled forces of a file."""
    return toml_files.read_toml(Path(path), DisturbanceFile).disturbance


def _built(amount: float | LogNormalPrior, factor: float = 1.0) -> float | priors.Prior:
    return amount.build(factor) if isinstance(amount, LogNormalPrior) else factor * amount

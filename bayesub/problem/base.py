"""What a posterior density is made of, whether of one trial or of several, and views of it.

A view is a problem of the same trials with other noise, fewer parameters or a shorter record. It changes parts of each
trial and keeps all others (:meth:`bayesub.problem.trial_problem.TrialProblem.view`), so views of views have both.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.equations import EquationSet
from bayesub.model.linear_form import LinearSystem
from bayesub.problem.distributions import WHITE, Prior, joined
from bayesub.problem.disturbances import of_history, of_process
from bayesub.problem.likelihoods import Normal
from bayesub.problem.nuisance import ON_READINGS
from bayesub.problem.priors import relative_normal
from bayesub.sensors.record import Record

if TYPE_CHECKING:
    from bayesub.problem.trial_problem import TrialProblem


class Viewed:
    """A problem of one trial or several, of which there are views."""

    def of_trials(self, change: "Callable[[TrialProblem], TrialProblem]") -> Self:
        """The problem of the trials that `change` makes of its own; itself if it changes none."""
        raise NotImplementedError

    def naive(self) -> Self:
        """The same problem for methods that know neither rounding nor nuisance parameters.

        Noise is normal with the total sd on every channel, and nuisance parameters are held at their prior means.
        """
        return self.of_trials(lambda trial: _plain(trial, {}))

    def searchable(self) -> Self:
        """The same problem for searches that know no other noise than normal, and no histories of forces.

        As :meth:`naive`, but nuisance parameters that move the readings remain: all but those of noise and disturbance.
        """

        def change(trial):
            still = {p.name for p in trial.forward.nuisances.parameters if p.channel and p.attribute not in ON_READINGS}
            left = [n for n in trial.nuisance_priors if not (n in still or of_history(n) or of_process(n))]
            return _plain(trial, {name: trial.nuisance_priors[name] for name in left})

        return self.of_trials(change)

    def smoothed(self, share: float) -> Self:
        """The same problem for searches: channels without noise get some, with `share` of their resolution as sd."""

        def change(trial):
            if all(noise.has_density for noise in trial.noises):
                return trial
            return trial.view(noises=tuple(noise.smoothed(share) for noise in trial.noises))

        return self.of_trials(change)

    def widened(self, scale: float) -> Self:
        """The same problem with noise that is `scale` times as large, for searches from afar."""

        def change(trial):
            noises = tuple(noise.widened(scale) for noise in trial.noises)
            return trial.view(noises=noises, widening=scale * trial.widening)

        return self.of_trials(change)

    def with_wide_process(self) -> Self:
        """The same problem with a known and wide process of the disturbance, if it has one that is not known."""

        def change(trial):
            if not trial.histories or not trial.forward.disturbances.processes:
                return trial
            priors = {name: prior for name, prior in trial.nuisance_priors.items() if not of_process(name)}
            return trial.view(forward=trial.forward.with_wide_process(), nuisance_priors=priors)

        return self.of_trials(change)

    def truncated(self, duration: float) -> Self:
        """The same problem with the readings of the first `duration` seconds, for searches that lengthen the record.

        A channel without readings by then keeps its first. Nothing later is simulated.
        """

        def change(trial):
            channels = trial.record.channels
            counts = [max(1, int(np.searchsorted(c.times, duration, side="right"))) for c in channels]
            if all(n == len(channel.times) for n, channel in zip(counts, channels, strict=True)):
                return trial
            return of_readings(trial, trial.record, [slice(n) for n in counts])

        return self.of_trials(change)


def of_readings(trial: "TrialProblem", record: Record, chosen: Sequence[slice | np.ndarray]) -> "TrialProblem":
    """The trial with some readings, slices or masks (n,), of each channel of a record with these channels."""
    parts = zip(trial.forward.measurement.slices, chosen, strict=True)
    readings = np.concatenate([trial.readings[part][kept] for part, kept in parts])
    return trial.view(forward=trial.forward.with_record(record.of_readings(chosen)), readings=readings)


def _plain(trial, nuisance_priors):
    """The trial with normal noise, and these nuisance parameters; all others are at their prior means."""
    noises = tuple(Normal(trial.widening * channel.total_sd) for channel in trial.record.channels)
    values = trial.nuisance_values(trial.prior.mean[None])[0]
    return trial.view(noises=noises, nuisance_priors=nuisance_priors, fixed_nuisances=values)


@dataclass
class Costs:
    """What has been computed so far; one counter is shared by all views of a problem."""

    simulations: int = 0  # number of simulations, a member of a batch each; those within a Jacobian are not among them
    jacobians: int = 0  # number of Jacobians
    failures: dict[str, int] = field(default_factory=dict)  # status -> number of simulations that ended so
    seconds: float = 0.0  # wall time of all of these

    def __add__(self, other: "Costs") -> "Costs":
        words = self.failures | other.failures
        failures = {word: self.failures.get(word, 0) + other.failures.get(word, 0) for word in words}
        seconds = self.seconds + other.seconds
        return Costs(self.simulations + other.simulations, self.jacobians + other.jacobians, failures, seconds)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Count the time of what is simulated in the block."""
        began = time.perf_counter()
        yield
        self.seconds += time.perf_counter() - began


class PosteriorDensity(Viewed):
    """The posterior density of free coefficients and nuisance parameters, as inference sees it.

    It is all of :mod:`bayesub.inference.interface`. A subclass says what channels contribute, its trials, its cost.
    """

    names: tuple[str, ...]  # the n_params free coefficients and after them the nuisance parameters
    n_coefficients: int  # how many of the parameters are coefficients
    columns: np.ndarray  # (n_coefficients,) the positions of these in a coefficient set
    xi: np.ndarray  # (n_terms,) values of the coefficients that are not free
    coefficient_prior: Prior
    nuisance_priors: dict[str, Prior]  # nuisance parameter -> prior of it alone, in the unit of its name
    prior: Prior  # of all parameters together
    equations: EquationSet

    @property
    def preferred_pivots(self) -> tuple[str, ...]:
        """Coefficients to name null directions by: the added masses, which a hull form gives."""
        return self.equations.added_masses

    @property
    def histories(self) -> tuple:
        """Forces with unknown histories (:class:`bayesub.problem.disturbances.History`)."""
        return ()

    @property
    def others(self) -> np.ndarray:
        """(n_others,) positions of the parameters that are not white coordinates of histories.

        Tables and figures of parameters are of these; there is a white coordinate for every knot and axis.
        """
        white = [history.columns for history in self.histories]
        return np.delete(np.arange(self.n_params), np.concatenate(white) if white else [])

    @property
    def prior_of_others(self) -> Prior:
        """The prior of the parameters that are not white coordinates of histories."""
        others = {name: prior for name, prior in self.nuisance_priors.items() if prior is not WHITE}
        return joined(self.coefficient_prior, others)

    @property
    def n_params(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def costs(self) -> Costs:
        """Counts of what this problem and its views have computed."""
        raise NotImplementedError

    def log_likelihoods(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        raise NotImplementedError

    def each_trial(self, parameters: np.ndarray) -> Iterator[tuple[str, "TrialProblem", np.ndarray]]:
        """Name, problem and parameters (.., n_params of the trial) of each trial, of parameters (.., n_params)."""
        raise NotImplementedError

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """Axis -> linear form in the free coefficients (model manual, section 9) at parameters (n_params,).

        It holds along the motion that these parameters give. Of several trials the rows stand below one another.
        """
        raise NotImplementedError

    def batch(self, parameters: np.ndarray) -> np.ndarray:
        """Parameters (n_params,) or (n_batch, n_params) as a batch; InputError if they are of another number."""
        self._check_shape(parameters, 2, f"({self.n_params},) or (n, {self.n_params})")
        return np.atleast_2d(parameters)

    def vector(self, parameters: np.ndarray) -> np.ndarray:
        """Parameters (n_params,); InputError if they are of another number or a batch."""
        self._check_shape(parameters, 1, f"({self.n_params},)")
        return np.asarray(parameters)

    def _check_shape(self, parameters, most_axes, wanted):
        if (found := np.shape(parameters))[-1:] != (self.n_params,) or len(found) > most_axes or 0 in found:
            text = f"parameters must have the shape {wanted}, found {found}; the order is that of the problem's names"
            raise InputError(text, "value", "parameters")

    def coefficient_sets(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_terms) coefficient sets with the free columns taken from parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        sets = np.repeat(self.xi[None], len(parameters), axis=0)
        sets[:, self.columns] = parameters[:, : self.n_coefficients]
        return sets

    def held(self, parameters: np.ndarray) -> Self:
        """The problem of the other parameters, with the coefficients of parameters (n_params,)."""
        (xi,) = self.coefficient_sets(parameters)
        spread = relative_normal(1.0)  # has no parameters
        return self.of_trials(lambda trial: trial.view(columns=trial.columns[:0], xi=xi, spread=spread))

    def log_prior(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log prior densities."""
        return self.prior.log_density(self.batch(parameters))

    def log_likelihood(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where a simulation failed, from what is predicted if that is known."""
        return sum(self.log_likelihoods(parameters, predicted).values(), np.zeros(()))

    def log_prob(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log posterior densities, not normalised."""
        return self.log_prior(parameters) + self.log_likelihood(parameters)


def coefficient_names(equations: EquationSet, columns: np.ndarray) -> tuple[str, ...]:
    """Names of the coefficients at positions `columns` (n,) of a set."""
    return tuple(equations.names[k] for k in columns)

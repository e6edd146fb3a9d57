"""Several trials of one vehicle as one inference problem."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesub.io.arguments import check_class
from bayesub.io.errors import InputError
from bayesub.model.linear_form import LinearSystem, stacked
from bayesub.problem.base import Costs, PosteriorDensity, coefficient_names
from bayesub.problem.distributions import Prior, joined
from bayesub.problem.disturbances import History
from bayesub.problem.nuisance import of_boat, of_instrument
from bayesub.problem.trial_problem import TrialProblem

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Policy


class JointProblem(PosteriorDensity):
    """The coefficients of a vehicle from several trials.

    Coefficients, and nuisance parameters of the body and its actuators, are the same in all trials. Every other
    nuisance parameter belongs to one trial, and has its name in brackets: ``current_north_mps[first]``.

    It has the methods of :class:`bayesub.problem.trial_problem.TrialProblem`, the results trial after trial, and those
    by channel with names such as ``yaw[first]``. What belongs to one trial alone (record, manoeuvre, simulator,
    trajectory, motion) is asked of the trials: :attr:`problems`, or :meth:`each_trial` for their parameters.

    InputError without a trial, where trials have other vehicles, priors of coefficients, free parameters of the body or
    values that are held, and where two give a parameter that they share different priors. Parameters of the boat that
    each trial has for itself all the same, such as "bias_rudder_deg", are named in `own`.
    """

    def __init__(self, problems: Mapping[str, TrialProblem], own: Iterable[str] = ()):
        self.problems = dict(check_class("problems", problems, Mapping, key="problems"))  # name of a trial -> its own
        self.own = tuple(own)
        for name, one in self.problems.items():
            check_class(f"problems: '{name}'", one, TrialProblem, key=name)
        _check(list(self.problems.values()))
        trials, (first, *_) = self.problems.values(), self.problems.values()
        self.vehicle, self.equations = first.vehicle, first.equations
        self.xi, self.spread = first.xi, first.spread  # the prior of the coefficients as given
        self.columns = np.unique(np.concatenate([trial.columns for trial in trials]))
        self.n_coefficients = len(self.columns)
        self.coefficient_prior = self.spread.on(self.columns, self.xi, self.equations)
        self.nuisance_priors, renamed = _shared(self.problems, self.own)
        self.names = (*coefficient_names(self.equations, self.columns), *self.nuisance_priors)
        self.prior = joined(self.coefficient_prior, self.nuisance_priors)
        places = {name: k for k, name in enumerate(self.names)}
        self._places = {name: np.array([places[one] for one in names]) for name, names in renamed.items()}
        self.readings = np.concatenate([trial.readings for trial in trials])  # (n_readings,), SI units, trial by trial
        self.sds = np.concatenate([trial.sds for trial in trials])  # (n_readings,) with those of rounding, SI units
        self.duration = max(trial.duration for trial in trials)  # time of the last reading of the longest trial, s
        self.heavy_tailed = any(trial.heavy_tailed for trial in trials)  # whether any noise is
        # Channel of a trial -> channel and its noise model, and where its readings stand among the residuals (rows).
        self.channels = self._by_channel([trial.channels for trial in trials])
        starts = accumulate((trial.n_rows for trial in trials), initial=0)
        self._firsts = dict(zip(self.problems, starts, strict=False))  # the last start is the end of all
        moved = [{c: _moved(p, self._firsts[name]) for c, p in one.rows.items()} for name, one in self.problems.items()]
        self.rows = self._by_channel(moved)

    @property
    def costs(self) -> Costs:
        """What the trials have computed so far: a simulation or a Jacobian of one trial counts as one."""
        return sum((problem.costs for problem in self.problems.values()), Costs())

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) the truth behind synthetic records, otherwise the values of the vehicle and the manoeuvres."""
        values = np.empty(self.n_params)
        for trial, problem in self.problems.items():
            values[self._places[trial]] = problem.reference
        return values

    def each_trial(self, parameters: np.ndarray) -> Iterator[tuple[str, TrialProblem, np.ndarray]]:
        """Name, problem and parameters (.., n_params of the trial) of each trial, of parameters (.., n_params)."""
        parameters = np.asarray(parameters)
        for trial, problem in self.problems.items():
            yield trial, problem, parameters[..., self._places[trial]]

    def _of_trials(self, method, parameters, predicted=None, centre=None, **arguments):
        """The results of a method for each trial at parameters (n_batch, n_params), from what is predicted there."""
        ends = np.cumsum([len(problem.readings) for problem in self.problems.values()])[:-1]
        parts = [None] * len(self.problems) if predicted is None else np.split(predicted, ends, axis=1)
        results = []
        for (trial, problem, values), part in zip(self.each_trial(self.batch(parameters)), parts, strict=True):
            about = () if centre is None else (centre[self._places[trial]],)
            known = () if part is None else (part,)
            results.append(getattr(problem, method)(*about, values, *known, **arguments))
        return results

    def flown(
        self, parameters: np.ndarray, policies: "Sequence[Policy] | None" = None
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Parameters and readings of members whose forces follow policies, trial after trial, and states on the way."""
        own, full, readings, states = None if policies is None else iter(policies), parameters.copy(), [], []
        for trial, problem, values in self.each_trial(parameters):
            if not problem.histories:
                readings.append(problem.predicted(values))
                continue
            flown, predicted, seen = problem.flown(values, None if own is None else [next(own)])
            full[:, self._places[trial]] = flown
            readings.append(predicted)
            states += seen
        return full, np.concatenate(readings, axis=1), states

    def predicted(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings), trial after trial."""
        return np.concatenate(self._of_trials("predicted", parameters), axis=1)

    @property
    def histories(self) -> tuple[History, ...]:
        """The forces with unknown histories of each trial that has them."""
        return tuple(
            replace(
                history,
                rows=_moved(history.rows, self._firsts[name]),
                columns=self._places[name][history.columns],
                process=self._places[name][history.process],
                places=self._places[name],
            )
            for name, problem in self.problems.items()
            for history in problem.histories
        )

    def residuals(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> np.ndarray:
        """(n_batch, n_rows), trial after trial."""
        return np.concatenate(self._of_trials("residuals", parameters, predicted), axis=1)

    def misfit_about(
        self, centre: np.ndarray, parameters: np.ndarray, predicted: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) with the noise as at `centre` (n_params,), and log likelihoods (n_batch,)."""
        results = self._of_trials("misfit_about", parameters, predicted, centre)
        residuals, log_likelihoods = zip(*results, strict=True)
        return np.concatenate(residuals, axis=1), np.sum(log_likelihoods, axis=0)

    def misfit(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,)."""
        residuals, deviances = zip(*self._of_trials("misfit", parameters, predicted), strict=True)
        return np.concatenate(residuals, axis=1), np.sum(deviances, axis=0)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params), trial after trial."""
        blocks = [
            (problem.jacobian(values), self._places[trial])
            for trial, problem, values in self.each_trial(self.vector(parameters))
        ]
        return _stacked(blocks, self.n_params)

    def jacobian_of_others(self, parameters: np.ndarray, responses: Sequence[Any] | None = None) -> np.ndarray:
        """(n_rows, n_others), trial after trial; `responses` are those of the histories, if they are known already."""
        known, blocks = None if responses is None else iter(responses), []
        for trial, problem, values in self.each_trial(parameters):
            own = None if known is None else [next(known) for _ in problem.histories]
            places = np.searchsorted(self.others, self._places[trial][problem.others])
            blocks.append((problem.jacobian_of_others(values, own), places))
        return _stacked(blocks, len(self.others))

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """Axis -> linear form in the free coefficients at parameters (n_params,), the trials below one another."""
        systems = [problem.linear_systems(values) for _, problem, values in self.each_trial(self.vector(parameters))]
        return stacked(systems, self.equations.names)

    def of_trials(self, change: Callable[[TrialProblem], TrialProblem]) -> "JointProblem":
        """The joint problem of what `change` makes of each trial; itself if it changes none."""
        changed = {name: change(problem) for name, problem in self.problems.items()}
        same = all(changed[name] is self.problems[name] for name in changed)
        return self if same else JointProblem(changed, self.own)

    def without(self, trial: str) -> "JointProblem":
        """The joint problem of all other trials; InputError if there is none."""
        return JointProblem({name: problem for name, problem in self.problems.items() if name != trial}, self.own)

    def log_likelihoods(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel of each trial, as ``yaw[first]``."""
        return self._by_channel(self._of_trials("log_likelihoods", parameters, predicted))

    def _by_channel(self, contents) -> dict:
        """Channel and trial -> content, from one dictionary by channel a trial."""
        pairs = zip(self.problems, contents, strict=True)
        return {f"{channel}[{trial}]": part for trial, parts in pairs for channel, part in parts.items()}

    def quantile_residuals(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """(n_batch, n) quantile residuals of each channel of each trial, as ``yaw[first]``."""
        return self._by_channel(self._of_trials("quantile_residuals", parameters, rng=rng))

    def replicated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member could have made, trial after trial."""
        return np.concatenate(self._of_trials("replicated", parameters, rng=rng), axis=1)


def _stacked(blocks, n_columns) -> np.ndarray:
    """Blocks (n, k) below one another, each with its columns at its own places (k,) of all."""
    stacked = []
    for block, places in blocks:
        stacked.append(np.zeros((len(block), n_columns)))
        stacked[-1][:, places] = block
    return np.concatenate(stacked)


def _check(problems) -> None:
    """Raise an InputError unless there are trials, of one boat with one prior."""
    if not problems:
        raise InputError("a joint problem needs at least one trial", "missing", "problems")
    first, *others = problems
    for problem in others:
        if problem.vehicle != first.vehicle or problem.spread != first.spread:
            text = "the trials of a joint problem must have the same vehicle and the same prior"
            raise InputError(text, "conflict", "problems")
        if not np.array_equal(problem.xi, first.xi) or _of_body(problem) != _of_body(first):
            text = "the trials of a joint problem must hold the same coefficients and free the same body"
            raise InputError(text, "conflict", "problems")
    free = {name for problem in problems for name in problem.names[: problem.n_coefficients]}
    for problem in problems:
        acting = problem.equations.active(None, problem.manoeuvre, problem.manoeuvre.subproblem)
        if held := free.intersection(acting).difference(problem.names):
            text = f"the trials of a joint problem must free the same coefficients: '{min(held)}' is free in one trial"
            raise InputError(f"{text} and held in another, in which it acts", "conflict", "problems")


def _shared(problems, own) -> tuple[dict[str, Prior], dict[str, list[str]]]:
    """Prior of each nuisance parameter of all trials, and the names that the parameters of each trial have there."""
    priors: dict[str, Prior] = {}
    names: dict[str, list[str]] = {}
    for trial, problem in problems.items():
        renamed = {
            name: name if of_boat(name, problem.vehicle) and name not in own else f"{name}[{trial}]"
            for name in problem.nuisance_priors
        }
        for name, prior in problem.nuisance_priors.items():
            if priors.setdefault(renamed[name], prior) != prior:
                text = f"nuisance '{name}': all trials share it, and '{trial}' has another prior of it than the "
                text += "trials before; give it once, or the same in each"
                raise InputError(text, "conflict", name)
        names[trial] = [renamed.get(name, name) for name in problem.names]
    return priors, names


def _moved(rows: slice, first: int) -> slice:
    return slice(first + rows.start, first + rows.stop)


def _of_body(problem) -> set[str]:
    """The nuisance parameters of the body that a problem infers; not every trial has every instrument."""
    return {
        name for name in problem.names if of_boat(name, problem.vehicle) and not of_instrument(name, problem.vehicle)
    }

"""Several trials of one vehicle as one inference problem."""

from collections.abc import Iterator, Mapping

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.linear_form import LinearSystem, stacked
from bayesub.problem.base import Costs, PosteriorDensity
from bayesub.problem.distributions import joined
from bayesub.problem.disturbances import History
from bayesub.problem.mounting import of_place
from bayesub.problem.nuisance import of_boat
from bayesub.problem.trial_problem import TrialProblem, coefficient_names


class JointProblem(PosteriorDensity):
    """The coefficients of a vehicle from several trials.

    Coefficients, and nuisance parameters of the body and its actuators, are the same in all trials. Every other
    nuisance parameter belongs to one trial, and has its name in brackets: ``current_north_mps[first]``.

    It has the methods of :class:`bayesub.problem.trial_problem.TrialProblem`, the results trial after trial, and those
    by channel with names such as ``yaw[first]``. What belongs to one trial alone (record, manoeuvre, simulator,
    trajectory, motion) is asked of the trials: :attr:`problems`, or :meth:`each_trial` for their parameters.

    Parameters
    ----------
    problems : name of a trial -> Problem, of the same vehicle with the same `prior`

    Raises
    ------
    InputError : without a trial, where trials have other vehicles, priors of coefficients, free parameters of the body
        or values that are held, and where two give a parameter that they share different priors

    Attributes
    ----------
    problems : name of a trial -> its problem
    vehicle : of all trials
    spread : the prior of the coefficients as given
    """

    def __init__(self, problems: Mapping[str, TrialProblem]):
        self.problems = dict(problems)
        if not self.problems:
            raise InputError("a joint problem needs at least one trial", "missing", "problems")
        first, *others = self.problems.values()
        for problem in others:
            if problem.vehicle is not first.vehicle or problem.spread != first.spread:
                raise InputError(
                    "the trials of a joint problem must have the same vehicle and the same prior",
                    "conflict",
                    "problems",
                )
            if not np.array_equal(problem.xi, first.xi) or _of_body(problem) != _of_body(first):
                raise InputError(
                    "the trials of a joint problem must hold the same coefficients and free the same body",
                    "conflict",
                    "problems",
                )
        self.vehicle, self.equations = first.vehicle, first.equations
        self.xi, self.spread = first.xi, first.spread
        self.columns = np.unique(np.concatenate([p.columns for p in self.problems.values()]))
        self.n_coefficients = len(self.columns)
        self.coefficient_prior = self.spread.on(self.columns, self.xi, self.equations)
        self.nuisance_priors, names = {}, {}
        for trial, problem in self.problems.items():
            renamed = {
                name: name if of_boat(name, problem.vehicle) else f"{name}[{trial}]" for name in problem.nuisance_priors
            }
            for name, prior in problem.nuisance_priors.items():
                if self.nuisance_priors.setdefault(renamed[name], prior) != prior:
                    raise InputError(
                        f"nuisance '{name}': all trials share it, and '{trial}' has another prior of it than the "
                        "trials before; give it once, or the same in each",
                        "conflict",
                        name,
                    )
            names[trial] = [renamed.get(name, name) for name in problem.names]
        self.names = (*coefficient_names(self.equations, self.columns), *self.nuisance_priors)
        self.prior = joined(self.coefficient_prior, self.nuisance_priors)
        self._places = {
            trial: np.array([self.names.index(name) for name in renamed]) for trial, renamed in names.items()
        }

    @property
    def costs(self) -> Costs:
        """What the trials have computed so far: a simulation or a Jacobian of one trial counts as one."""
        return sum((problem.costs for problem in self.problems.values()), Costs())

    @property
    def readings(self) -> np.ndarray:
        """(n_readings,) measured values, SI units."""
        return np.concatenate([problem.readings for problem in self.problems.values()])

    @property
    def sds(self) -> np.ndarray:
        """(n_readings,) their standard deviations with rounding, SI units."""
        return np.concatenate([problem.sds for problem in self.problems.values()])

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) as :attr:`bayesub.problem.trial_problem.TrialProblem.reference`."""
        values = np.empty(self.n_params)
        for trial, problem in self.problems.items():
            values[self._places[trial]] = problem.reference
        return values

    def each_trial(self, parameters: np.ndarray) -> Iterator[tuple[str, PosteriorDensity, np.ndarray]]:
        """As :meth:`bayesub.problem.base.PosteriorDensity.each_trial`."""
        parameters = np.asarray(parameters)
        for trial, problem in self.problems.items():
            yield trial, problem, parameters[..., self._places[trial]]

    def _of_trials(self, method, parameters, *arguments):
        """What a method returns for each trial at parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        return [getattr(problem, method)(values, *arguments) for _, problem, values in self.each_trial(parameters)]

    def predicted(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings), trial after trial."""
        return np.concatenate(self._of_trials("predicted", parameters), axis=1)

    @property
    def histories(self) -> tuple[History, ...]:
        """The forces with unknown histories of each trial that has them."""
        histories, start = [], 0
        for trial, problem in self.problems.items():
            places = self._places[trial]
            for history in problem.histories:
                rows = slice(start + history.rows.start, start + history.rows.stop)
                columns, process = places[history.columns], places[history.process]
                histories.append(History(rows, columns, process, history.disturbances))
            start += problem.n_rows
        return tuple(histories)

    @property
    def rows(self) -> dict[str, slice]:
        """Where the readings of each channel of each trial stand among the residuals."""
        rows, start = {}, 0
        for trial, problem in self.problems.items():
            for channel, part in problem.rows.items():
                rows[f"{channel}[{trial}]"] = slice(start + part.start, start + part.stop)
            start += problem.n_rows
        return rows

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows), trial after trial."""
        return np.concatenate(self._of_trials("residuals", parameters), axis=1)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.misfit_about`, of all trials."""
        pairs = zip(self.each_trial(centre), self.each_trial(np.atleast_2d(parameters)), strict=True)
        each = [problem.misfit_about(middle, values) for (*_, middle), (_, problem, values) in pairs]
        residuals, log_likelihoods = zip(*each, strict=True)
        return np.concatenate(residuals, axis=1), np.sum(log_likelihoods, axis=0)

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,)."""
        residuals, deviances = zip(*self._of_trials("misfit", parameters), strict=True)
        return np.concatenate(residuals, axis=1), np.sum(deviances, axis=0)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params), trial after trial."""
        blocks = []
        for trial, problem, values in self.each_trial(parameters):
            block = problem.jacobian(values)
            blocks.append(np.zeros((len(block), self.n_params)))
            blocks[-1][:, self._places[trial]] = block
        return np.concatenate(blocks)

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """As :meth:`bayesub.problem.base.PosteriorDensity.linear_systems`, the trials below one another."""
        systems = [problem.linear_systems(values) for _, problem, values in self.each_trial(parameters)]
        return stacked(systems, self.equations.names)

    def smoothed(self, share: float) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.smoothed`."""
        return JointProblem({trial: problem.smoothed(share) for trial, problem in self.problems.items()})

    @property
    def heavy_tailed(self) -> bool:
        """Whether any noise of any trial is."""
        return any(problem.heavy_tailed for problem in self.problems.values())

    def widened(self, scale: float) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.widened`."""
        return JointProblem({trial: problem.widened(scale) for trial, problem in self.problems.items()})

    @property
    def duration(self) -> float:
        """Time of the last reading of the longest trial, s."""
        return max(problem.duration for problem in self.problems.values())

    def within(self, duration: float) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.within`, of each trial."""
        return JointProblem({trial: problem.within(duration) for trial, problem in self.problems.items()})

    def with_wide_process(self) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.with_wide_process`."""
        return JointProblem({trial: problem.with_wide_process() for trial, problem in self.problems.items()})

    def naive(self) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.naive`."""
        return JointProblem({trial: problem.naive() for trial, problem in self.problems.items()})

    def searchable(self) -> "JointProblem":
        """As :meth:`bayesub.problem.trial_problem.TrialProblem.searchable`."""
        return JointProblem({trial: problem.searchable() for trial, problem in self.problems.items()})

    def without(self, trial: str) -> "JointProblem":
        """The joint problem of all other trials; InputError if there is none."""
        return JointProblem({name: problem for name, problem in self.problems.items() if name != trial})

    def log_likelihoods(self, parameters: np.ndarray) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel of each trial, as ``yaw[first]``."""
        return self._by_channel(self._of_trials("log_likelihoods", parameters))

    def _by_channel(self, contents) -> dict:
        """Channel and trial -> content, from one dictionary by channel a trial."""
        pairs = zip(self.problems, contents, strict=True)
        return {f"{channel}[{trial}]": part for trial, parts in pairs for channel, part in parts.items()}

    @property
    def channels(self) -> dict:
        """Channel of a trial, as ``yaw[first]`` -> channel and its noise model."""
        return self._by_channel([problem.channels for problem in self.problems.values()])

    def quantile_residuals(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """(n_batch, n) quantile residuals of each channel of each trial, as ``yaw[first]``."""
        return self._by_channel(self._of_trials("quantile_residuals", parameters, rng))

    def replicated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member could have made, trial after trial."""
        return np.concatenate(self._of_trials("replicated", parameters, rng), axis=1)


def _of_body(problem) -> set[str]:
    """The nuisance parameters of the body that a problem infers; not every trial has every instrument."""
    return {name for name in problem.names if of_boat(name, problem.vehicle) and not of_place(name)}

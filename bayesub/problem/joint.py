"""Several trials of one vehicle as one inference problem."""

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model import coefficients
from bayesub.problem.base import PosteriorDensity
from bayesub.problem.nuisance import BODY
from bayesub.problem.priors import Joint


class JointProblem(PosteriorDensity):
    """The coefficients of a vehicle from several trials; see :class:`bayesub.problem.problem.Problem` for the methods.

    Coefficients, and nuisance parameters of the body, are the same in all trials. All other nuisance parameters are a
    trial's own, and have its name in brackets: ``current_north_mps[first]``.

    Parameters
    ----------
    problems : name of a trial -> Problem, of the same vehicle with the same `prior`

    Attributes
    ----------
    names, n_coefficients, columns, xi, prior, readings, sds, evaluations, failures : as those of a Problem
    """

    def __init__(self, problems: dict):
        self.problems = dict(problems)
        if not self.problems:
            raise InputError("a joint problem needs at least one trial")
        first, *others = self.problems.values()
        for problem in others:
            if problem.vehicle is not first.vehicle or problem.spread != first.spread:
                raise InputError("the trials of a joint problem must have the same vehicle and the same prior")
            if not np.array_equal(problem.xi, first.xi) or _of_body(problem) != _of_body(first):
                raise InputError("the trials of a joint problem must hold the same coefficients and free the same body")
        self.vehicle, self.xi = first.vehicle, first.xi
        self.columns = np.unique(np.concatenate([p.columns for p in self.problems.values()]))
        self.n_coefficients = len(self.columns)
        names = [coefficients.NAMES[k] for k in self.columns]
        parts = [first.spread.on(self.columns, first.xi)]
        self._places = {}
        for trial, problem in self.problems.items():
            own = [name if name in BODY else f"{name}[{trial}]" for name in problem.names[problem.n_coefficients :]]
            for name, prior in zip(own, getattr(problem.prior, "parts", ())[1:], strict=False):
                if name not in names:
                    names.append(name)
                    parts.append(prior)
            shared = problem.names[: problem.n_coefficients]
            self._places[trial] = np.array([names.index(name) for name in (*shared, *own)])
        self.names = tuple(names)
        positions = (np.arange(self.n_coefficients), *([k] for k in range(self.n_coefficients, len(names))))
        self.prior = parts[0] if len(parts) == 1 else Joint(tuple(parts), tuple(map(np.array, positions)))

    @property
    def evaluations(self) -> int:
        return sum(problem.evaluations for problem in self.problems.values())

    @property
    def failures(self) -> dict[str, int]:
        counts = [problem.failures for problem in self.problems.values()]
        return {word: sum(count[word] for count in counts) for word in counts[0]}

    @property
    def readings(self) -> np.ndarray:
        return np.concatenate([problem.readings for problem in self.problems.values()])

    @property
    def sds(self) -> np.ndarray:
        return np.concatenate([problem.sds for problem in self.problems.values()])

    @property
    def reference(self) -> np.ndarray:
        """(n_params,)"""
        values = np.empty(self.n_params)
        for trial, problem in self.problems.items():
            values[self._places[trial]] = problem.reference
        return values

    def each_trial(self, parameters):
        """As :meth:`bayesub.problem.base.PosteriorDensity.each_trial`."""
        parameters = np.asarray(parameters)
        for trial, problem in self.problems.items():
            yield trial, problem, parameters[..., self._places[trial]]

    def _of(self, method, parameters, *arguments):
        """What a method returns for each trial at parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        return [getattr(problem, method)(own, *arguments) for _, problem, own in self.each_trial(parameters)]

    def predicted(self, parameters) -> np.ndarray:
        """(n_batch, n_readings), trial after trial."""
        return np.concatenate(self._of("predicted", parameters), axis=1)

    def residuals(self, parameters) -> np.ndarray:
        """(n_batch, n_rows), trial after trial."""
        return np.concatenate(self._of("residuals", parameters), axis=1)

    def residuals_about(self, centre, parameters) -> np.ndarray:
        """As :meth:`bayesub.problem.problem.Problem.residuals_about`, trial after trial."""
        pairs = zip(self.each_trial(centre), self.each_trial(np.atleast_2d(parameters)), strict=True)
        return np.concatenate([problem.residuals_about(there, own) for (*_, there), (_, problem, own) in pairs], axis=1)

    def misfit(self, parameters) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,)."""
        residuals, deviances = zip(*self._of("misfit", parameters), strict=True)
        return np.concatenate(residuals, axis=1), np.sum(deviances, axis=0)

    def jacobian(self, parameters) -> np.ndarray:
        """(n_rows, n_params), trial after trial."""
        blocks = []
        for trial, problem, own in self.each_trial(parameters):
            block = problem.jacobian(own)
            blocks.append(np.zeros((len(block), self.n_params)))
            blocks[-1][:, self._places[trial]] = block
        return np.concatenate(blocks)

    def smoothed(self, share: float) -> "JointProblem":
        """As :meth:`bayesub.problem.problem.Problem.smoothed`."""
        return self._with({trial: problem.smoothed(share) for trial, problem in self.problems.items()})

    def naive(self) -> "JointProblem":
        """As :meth:`bayesub.problem.problem.Problem.naive`."""
        return JointProblem({trial: problem.naive() for trial, problem in self.problems.items()})

    def without(self, trial: str) -> "JointProblem":
        """The joint problem of all other trials; InputError if there is none."""
        return JointProblem({name: problem for name, problem in self.problems.items() if name != trial})

    def _with(self, problems):
        other = object.__new__(JointProblem)
        vars(other).update(vars(self) | {"problems": problems})
        return other

    def log_likelihoods(self, parameters) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel of each trial, as ``yaw[first]``."""
        return self._named(self._of("log_likelihoods", parameters))

    def _named(self, found) -> dict:
        """What was found of each channel of each trial, by channel and trial."""
        pairs = zip(self.problems, found, strict=True)
        return {f"{channel}[{trial}]": part for trial, parts in pairs for channel, part in parts.items()}

    @property
    def channels(self) -> dict:
        """Channel of a trial, as ``yaw[first]`` -> channel and its noise model."""
        return self._named([problem.channels for problem in self.problems.values()])

    def quantile_residuals(self, parameters, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """(n_batch, n) quantile residuals of each channel of each trial, as ``yaw[first]``."""
        return self._named(self._of("quantile_residuals", parameters, rng))


def _of_body(problem) -> set[str]:
    """The nuisance parameters of the body that a problem infers."""
    return {name for name in problem.names if name in BODY}

"""What a posterior of some trials says of the parameters of a trial that was not among them."""

from dataclasses import dataclass, replace

import numpy as np

from bayesub.io.errors import InputError
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import Normal, UnknownSd
from bayesub.problem.nuisance import ON_READINGS, of_boat
from bayesub.problem.trial_problem import TrialProblem

WARM_UP_LENGTHS = 4.0  # ship lengths travelled at the trial speed
WARM_UP_READINGS = 8  # of each channel, in the median, in a warm-up
JUDGED_READINGS = 10  # at least, after it
LONGEST_WARM_UP = 0.5  # of the time of the readings


@dataclass(frozen=True)
class UnseenTrial:
    """A trial that a posterior shall predict."""

    name: str
    problem: TrialProblem  # of the trial alone, with the vehicle and the prior of those that were fitted
    warm_up_s: float  # time from its start in which its readings say what the fitted trials do not tell
    is_left_out: bool = False  # whether it is one of the trials of the study, left out of a fit of the others

    def with_fitted_noise(self, fitted: TrialProblem | JointProblem, best: np.ndarray) -> "UnseenTrial":
        """The same trial, where noise whose sd is integrated out has that of the fitted errors of its channel.

        The errors of the trials that were fitted are taken at `best` (n_fitted,), parameters of theirs.
        """
        squares: dict[str, list[np.ndarray]] = {}
        for _, problem, values in fitted.each_trial(best):
            (errors,) = problem.predicted(values) - problem.readings
            for name, part in problem.rows.items():
                squares.setdefault(name, []).append(errors[part] ** 2)
        noises = tuple(
            Normal(float(np.sqrt(np.concatenate(squares[name]).mean())))
            if isinstance(noise, UnknownSd) and name in squares
            else noise
            for name, (_, noise) in self.problem.channels.items()
        )
        same = noises == self.problem.noises
        return self if same else replace(self, problem=self.problem.view(noises=noises))

    def transferred(
        self, fitted: TrialProblem | JointProblem, draws: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """(n, n_params) parameters of this trial, of draws (n, n_fitted) of the parameters of the fitted ones.

        Coefficients, and parameters of the body, of actuators and of the process of a disturbance, are those of the
        draws. So are sd, degrees of freedom and correlation time of the noise of a channel that was fitted: of several
        trials those of a random one for each draw. All others are draws of their prior.
        """
        parameters = self.problem.prior.sample(rng, len(draws))
        choice = rng.integers(0, 2**31, len(draws))
        for k, columns in self._sources(fitted).items():
            if columns:
                parameters[:, k] = draws[np.arange(len(draws)), np.array(columns)[choice % len(columns)]]
        return parameters

    def own(self, fitted: TrialProblem | JointProblem) -> np.ndarray:
        """(n_own,) positions of the parameters that are drawn given the warm-up.

        It tells start, current, biases of sensors and histories of forces; the noise of a channel that was not fitted
        is as its prior has it.
        Coefficients and parameters of the boat that no fitted trial has free are left to the prior.
        """
        problem, n = self.problem, self.problem.n_coefficients
        untold = [k for k, columns in self._sources(fitted).items() if k >= n and not columns]
        return np.array([k for k in untold if not of_boat(problem.names[k], problem.vehicle)], dtype=int)

    def _sources(self, fitted) -> dict[int, list[int]]:
        """Position of a parameter -> positions of what tells it among those of the fitted trials."""
        trials = [name for name, *_ in fitted.each_trial(fitted.prior.mean)]
        of_noise = {n.name for n in self.problem.forward.nuisances.parameters if n.attribute not in ("", *ON_READINGS)}
        sources = {}
        for k, name in enumerate(self.problem.names):
            names = []
            if k < self.problem.n_coefficients or of_boat(name, self.problem.vehicle):
                names = [name]
            elif name in of_noise:
                names = [f"{name}[{trial}]" if trial else name for trial in trials]
            sources[k] = [fitted.names.index(source) for source in names if source in fitted.names]
        return sources


def warm_up(problem: TrialProblem, warm_up_s: float | None = None) -> float:
    """Length of the warm-up of a log, s.

    Raises InputError for a log of which too little is left.
    """
    if warm_up_s is None:
        channels = problem.record.channels
        lengths = WARM_UP_LENGTHS * problem.vehicle.length_m / problem.vehicle.speed_mps
        dense = np.median([channel.times[:WARM_UP_READINGS][-1] for channel in channels])
        warm_up_s = float(max(lengths, dense))
    last, n_left = problem.times.max(), np.count_nonzero(problem.times > warm_up_s)
    if n_left < JUDGED_READINGS or warm_up_s > LONGEST_WARM_UP * last:
        fault = f"is too short to be predicted: of {last:.4g} s the warm-up takes {warm_up_s:.4g} s"
        text = f"{fault}, which leaves {n_left} readings; give a longer log or a shorter warm_up_s"
        raise InputError(text, "data", "warm_up_s")
    return warm_up_s


def left_out(joint: JointProblem) -> dict[str, UnseenTrial]:
    """Each trial of several, to be predicted by the others; InputError for one that is too short."""
    trials = {}
    for name, problem in joint.problems.items():
        trial = UnseenTrial(name, problem, 0.0, is_left_out=True)
        if len(trial.own(joint.without(name))):
            try:
                trial = replace(trial, warm_up_s=warm_up(problem))
            except InputError as error:
                raise error.within(f"trial '{name}'") from None
        trials[name] = trial
    return trials

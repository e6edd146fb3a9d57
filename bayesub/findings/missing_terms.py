"""Regressors that inferred histories of forces follow: a term that the equations lack, or that is held wrongly.

To the random process of an axis, f = sd L w with white coordinates w, one adds a force b x(t), x a regressor along the
motion. With e = L^-1 x / sd the derivative of the log density of the readings by b at zero is e' E[w], of posterior
means, and its information is e' (1 - C) e, C the posterior covariance of w (Louis 1982): what the readings do not tell
about the history, or give to free coefficients as well, is no information. The score over the root of the information
is standard normal if the history is what the prior says, whatever else is inferred; the score over the information is
the b that the readings ask for; and the correlation of two scores says whether they can be distinguished.

Where coefficients take up most of what x does, little information is left, and would be lost in Monte Carlo error. So C
is that of the linearised problem, and the mean is of

    e' w + (C e)' (slope of the log posterior),

whose second part has mean zero and takes all but curvature of the posterior out of the first (Assaraf & Caffarel 1999).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.inference.identifiability.linear_model import LinearModel
from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.equations import AXES, Term

FALSE_ALARMS = 0.01  # probability that a random history is said to follow any regressor
ALIKE = 0.95  # correlation of scores that cannot be distinguished
_STEP = 1e-3  # of differences of the log posterior, prior sd
_SEEN = 0.05  # variance of a posterior mean over that of the prior that is more than Monte Carlo error
_MOST = 3  # regressors that are named one after the other
_DRAWS = 20_000  # of the largest score of random histories


@dataclass(frozen=True)
class Candidate:
    """A regressor that the force on an axis may follow."""

    axis: str
    regressor: str  # as the equations write it
    term: Term | None  # of the equations on this axis
    free: bool = False  # whether the coefficient of the term is inferred


@dataclass(frozen=True)
class Scores:
    """How well each candidate explains the histories."""

    candidates: tuple[Candidate, ...]  # n of them
    values: np.ndarray  # (n,), derivatives of the log density of the readings by the factor of each regressor
    information: np.ndarray  # (n, n) of the factors
    # (n, n) of the values if histories are random: the information, more if what a regressor leaves of the history of
    # its axis is larger than the process, and the Monte Carlo error
    covariance: np.ndarray
    rms: np.ndarray  # (n,) of each regressor along the motion, N and N m for a unit of its factor

    @property
    def z(self) -> np.ndarray:
        """(n,) scores, standard normal if histories are random."""
        return self.values / np.sqrt(np.diag(self.covariance))

    @property
    def alike(self) -> np.ndarray:
        """(n, n) whether regressors are of one axis and cannot be distinguished."""
        scale = np.sqrt(np.diag(self.information))
        axes = np.array([candidate.axis for candidate in self.candidates])
        return (np.abs(self.information) >= ALIKE * np.outer(scale, scale)) & (axes[:, None] == axes)

    def p_value(self) -> float:
        """Probability that the largest score of random histories is as large."""
        scale = np.sqrt(np.diag(self.covariance))
        values, vectors = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        normal = np.random.default_rng(0).standard_normal((_DRAWS, len(values)))
        largest = np.abs(normal @ (vectors * np.sqrt(np.clip(values, 0.0, None))).T).max(axis=1)
        return float((1 + np.count_nonzero(largest >= np.abs(self.z).max())) / (1 + _DRAWS))

    def given(self, k: int) -> Scores:
        """The scores of what can then still be distinguished, if the factor of regressor k is free."""
        onto = np.eye(len(self.values))
        onto[:, k] -= self.information[:, k] / self.information[k, k]
        information = onto @ self.information @ onto.T
        left = np.flatnonzero(np.diag(information) > (1.0 - ALIKE**2) * np.diag(self.information))
        names, both = tuple(self.candidates[j] for j in left), np.ix_(left, left)
        covariance = onto @ self.covariance @ onto.T
        return Scores(names, (onto @ self.values)[left], information[both], covariance[both], self.rms[left])


@dataclass(frozen=True)
class FollowedRegressor:
    """A regressor that a history follows, with those that the motion cannot distinguish from it."""

    # Terms of the axis first, those that are held before those that are inferred, the best of them first
    candidates: tuple[Candidate, ...]
    factors: tuple[float, ...]  # by how much the coefficient of each would be off if it were the one
    sds: tuple[float, ...]  # standard deviations of the factors
    rms: float  # of the force of the first, N or N m
    p_value: float  # probability that random histories follow any regressor so closely


def find_followed(scores: Scores) -> list[FollowedRegressor]:
    """The regressors that histories follow, the clearest first, each given those before it."""
    results: list[FollowedRegressor] = []
    while scores.candidates and len(results) < _MOST and (p_value := scores.p_value()) <= FALSE_ALARMS:
        best = int(np.argmax(np.abs(scores.z)))
        alike = [k for k in np.argsort(-np.abs(scores.z)) if scores.alike[best, k]]
        # A term that is held is more likely wrong than one that is inferred; the sort is stable.
        alike.sort(key=lambda k: (scores.candidates[k].term is None, scores.candidates[k].free))
        information = np.diag(scores.information)[alike]
        factors = scores.values[alike] / information
        sds = np.sqrt(np.diag(scores.covariance)[alike]) / information
        candidates = tuple(scores.candidates[k] for k in alike)
        rms = float(abs(factors[0]) * scores.rms[alike[0]])
        results.append(FollowedRegressor(candidates, tuple(factors.tolist()), tuple(sds.tolist()), rms, p_value))
        scores = scores.given(best)
    return results


def scores(problem: AnyProblem, draws: np.ndarray) -> Scores:
    """The scores of all regressors of the equations that move.

    `problem`: with histories; `draws` (n_draws, n_params): from its posterior, about independent.
    """
    mean, t = draws.mean(axis=0), problem.prior.standard(draws)
    model = LinearModel(problem, problem.prior.standard(mean), problem.residuals(mean[None])[0])
    trials = [(trial, values) for _, trial, values in problem.each_trial(mean) if trial.histories]
    effects: dict[Candidate, np.ndarray] = {}
    squares: dict[Candidate, list] = {}
    members: dict[str, np.ndarray] = {}
    for history, (trial, values) in zip(problem.histories, trials, strict=True):
        knots, sequences = history.disturbances.knots, history.innovations(mean[None])
        columns = history.columns.reshape(len(knots.axes), -1)
        candidates, forces = _candidates(trial, values, knots)
        for candidate, line, force in zip(candidates, knots.projection(forces).T, forces.T, strict=True):
            k = knots.axes.index(candidate.axis)
            effect = effects.setdefault(candidate, np.zeros(problem.n_params))
            lines = np.zeros((1, *columns.shape))
            lines[0, k] = line
            effect[columns[k]] = sequences.white(lines)[0, k]
            squares.setdefault(candidate, []).append(np.mean(force**2))
        for axis, of_axis in zip(knots.axes, columns, strict=True):
            members[axis] = np.append(members.get(axis, np.array([], dtype=int)), of_axis)
    if not effects:  # of a current alone
        return Scores((), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0))
    matrix = np.array(list(effects.values()))
    unknown = model.covariance_times(matrix)
    information = (matrix - unknown) @ matrix.T
    values = t @ matrix.T + _slopes(problem, t, unknown)
    values = values[np.isfinite(values).all(axis=1)]
    error, values = np.atleast_2d(np.cov(values.T)) / len(values), values.mean(axis=0)
    misfits = {axis: _misfit(t.mean(axis=0)[own], model, own) for axis, own in members.items()}
    larger = []
    for candidate, square in zip(effects, values**2 / np.diag(information + error), strict=True):
        total, n_seen = misfits[candidate.axis]
        larger.append(np.sqrt(max(1.0, (total - square) / max(1, n_seen - 1))))
    covariance = information * np.outer(larger, larger) + error
    rms = np.sqrt([np.mean(values) for values in squares.values()])
    return Scores(tuple(effects), values, information, covariance, rms)


def _slopes(problem, t, directions) -> np.ndarray:
    """(n_draws, n) derivatives of the log posterior along directions (n, n_params), all in t of draws (n_draws, ..)."""
    columns = []
    for direction in directions:
        step = _STEP / np.linalg.norm(direction) * direction
        sides = np.stack([t + step, t - step])
        log_prob = problem.log_likelihood(problem.prior.parameters(sides.reshape(-1, t.shape[1]))).reshape(2, -1)
        log_prob = log_prob - 0.5 * np.sum(sides**2, axis=2)
        columns.append((log_prob[0] - log_prob[1]) / (2.0 * _STEP) * np.linalg.norm(direction))
    return np.stack(columns, axis=1)


def _misfit(mean, model, own) -> tuple[float, int]:
    """Chi-square of the posterior means (n,) of white coordinates, and how many of their combinations are seen."""
    n = model.covariance_times(np.eye(model.n_params)[own])[:, own]
    squares, combinations = np.linalg.eigh(np.eye(len(own)) - 0.5 * (n + n.T))
    seen = squares > _SEEN
    return float(np.sum((mean @ combinations[:, seen]) ** 2 / squares[seen])), int(np.count_nonzero(seen))


def _candidates(problem, values, knots) -> tuple[list[Candidate], np.ndarray]:
    """Regressors of velocities and controls that move, for each disturbed axis; (n_fine, n) N and N m along the motion.

    A regressor of another axis is one of a unit factor, in SI units.
    """
    trajectory = problem.forward.trajectory(*problem.arguments(values[None])).resampled(knots.fine_times)
    simulator = trajectory.simulator
    equations, vehicle = simulator.vehicle.equations, simulator.vehicle
    resting = np.zeros((len(trajectory.times), len(AXES)))
    controls = simulator.controls_at(trajectory.times)[:, : len(equations.controls) + 1]
    blocks = equations.regressors(trajectory.states[0], resting, controls, vehicle.constants)
    flat = dict(zip(equations.names, np.concatenate([blocks[axis] for axis in AXES], axis=1).T, strict=True))
    active = [equations.term(name) for name in equations.active(None, problem.manoeuvre, simulator.subproblem)]
    active = [term for term in active if not term.symbols & set(ACCELERATIONS) and np.abs(flat[term.name]).max() > 0.0]
    candidates, columns = [], []
    for axis in (axis for axis in knots.axes if axis in AXES):
        own = {term.parsed.canonical: term for term in active if term.axis == axis}
        for canonical, term in {term.parsed.canonical: term for term in reversed(active)}.items():
            of_axis = own.get(canonical)
            factor = 1.0 if of_axis is None else vehicle.dimensional_factors[equations.index[of_axis.name]]
            free = of_axis is not None and of_axis.name in problem.names
            candidates.append(Candidate(axis, term.regressor, of_axis, free))
            columns.append(factor * flat[term.name])
    return candidates, np.reshape(columns, (len(columns), len(knots.fine_times))).T

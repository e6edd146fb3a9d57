"""What inference needs of a problem: the one specification, to which problems and the toys of the tests are checked.

No submarine is in it. A search knows a problem by :class:`Searchable`, or by :class:`LeastSquares`; a surrogate by
:class:`Emulated`; a sampler by :class:`Sampled`, or by :class:`Forced` where forces have unknown histories; the
analysis of identifiability by :class:`Identifiable`. All know its prior by :class:`InferencePrior`. Parameters are
(n_params,) or (n_batch, n_params) in the units of their names; `t` and `x` are the coordinates of
:mod:`bayesub.inference.sampling`, without units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from bayesub.io.errors import InputError

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Innovations, Pieces, Policy

SMOOTH = 0.03  # of the resolution of readings that say only an interval: sd of the ends, where derivatives are taken


class Progress(Protocol):
    """Receiver of the progress of work that takes time."""

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """So many of `total` units are done; the note says what else there is to know."""


class PointEstimate(Protocol):
    """Anything that stands for one parameter vector, such as :class:`bayesub.inference.baselines.Estimate`."""

    @property
    def values(self) -> np.ndarray:
        """(n_params,)."""


def parameter_vector(at: PointEstimate | ArrayLike) -> np.ndarray:
    """The parameter vector (n_params,) of an estimate, or the vector itself; InputError if it is not finite."""
    vector = np.asarray(getattr(at, "values", at), dtype=float)
    if not np.isfinite(vector).all():
        raise InputError("parameters must be finite numbers, or an Estimate", "value", "at")
    return vector


class Standard(Protocol):
    """What a search needs of a prior: coordinates in which it is standard normal."""

    def parameters(self, t: np.ndarray) -> np.ndarray:
        """Parameters (.., n_params) of standard normal coordinates t (.., n_params)."""

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        """Standard normal coordinates of parameters (.., n_params); not finite outside the support."""

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Derivatives (n, n_params) by t, at t (n_params,), of what has the Jacobian (n, n_params) by parameters."""


@runtime_checkable
class InferencePrior(Standard, Protocol):
    """The prior of all parameters of a problem."""

    @property
    def mean(self) -> np.ndarray:
        """(n_params,) of each parameter by itself."""

    @property
    def sd(self) -> np.ndarray:
        """(n_params,) of each parameter by itself, positive."""

    @property
    def guess(self) -> np.ndarray:
        """(n_params,) values that the prior is about."""

    def found(self, draws: np.ndarray) -> Self:
        """What was known before: the prior, an unknown scale as draws (n, n_params) of the posterior say it."""

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities of parameters (n_batch, n_params); -inf outside the support."""

    def scaled(self, parameters: np.ndarray) -> np.ndarray:
        """Coordinates x (.., n_params) of parameters: as t, but linear in a uniform parameter."""

    def unscaled(self, x: np.ndarray) -> np.ndarray:
        """Parameters (.., n_params) of coordinates x."""

    def scaled_chain(self, jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives (n, n_params) by x, at x (n_params,), of what has the Jacobian (n, n_params) by parameters."""

    def scaled_log_density(self, x: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities in x (n_batch, n_params), up to a constant; -inf outside the support."""

    def scaled_slope(self, x: np.ndarray) -> np.ndarray:
        """(n_batch, n_params) gradient of :meth:`scaled_log_density` within the support."""

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The density in x as numbers, for what is compiled: walls, stretches, groups and scales.

        The first three are (n_params,): where a uniform parameter ends, infinite without; of one of a group, how much
        it grows with x, in units of its median; and the number of that group, -1 without. The fourth, (n_groups,
        n_scales), has the sds of the logarithm, each as probable, that the parameters of a group may have in common.
        Without walls and groups parameters are standard normal.
        """

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_params) draws."""


def mostly_bounded(prior: InferencePrior) -> bool:
    """Whether more than half of the parameters have bounds, so that walls are what a walk spends its time on."""
    return bool(np.mean(np.isfinite(prior.scaled_form()[0])) > 0.5)


@runtime_checkable
class CostCounter(Protocol):
    """Counts of what has been computed; all views of a problem share them."""

    @property
    def simulations(self) -> int:
        """Simulations, those within a Jacobian not among them."""

    @property
    def jacobians(self) -> int:
        """Jacobians."""

    @property
    def failures(self) -> dict[str, int]:
        """Status -> number of simulations that ended so."""

    @property
    def seconds(self) -> float:
        """Wall time of simulations and Jacobians."""


class LinearForm(Protocol):
    """``matrix @ coefficients = load`` along one axis of the equations of motion."""

    @property
    def axis(self) -> str:
        """Name of the axis."""

    @property
    def names(self) -> tuple[str, ...]:
        """The n_columns coefficients."""

    @property
    def matrix(self) -> np.ndarray:
        """(n_samples, n_columns), N or N m for a unit of a coefficient."""

    @property
    def load(self) -> np.ndarray:
        """(n_samples,), N or N m."""

    @property
    def rounding(self) -> float | np.ndarray:
        """Relative error to which the columns are known, a number or (n_columns,)."""


@runtime_checkable
class Searchable(Protocol):
    """What a search for a mode needs: parameters with a prior, and residuals with a deviance."""

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters."""

    @property
    def n_params(self) -> int:
        """Number of parameters."""

    @property
    def prior(self) -> Standard:
        """The prior of the parameters."""

    @property
    def costs(self) -> CostCounter:
        """Counts of what this problem and its views have computed."""

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,), -2 log likelihood but for a constant.

        The deviance is infinite where the simulation failed.
        """

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals at one parameter vector (n_params,)."""


@runtime_checkable
class LeastSquares(Searchable, Protocol):
    """What a method needs that looks at residuals alone."""

    @property
    def prior(self) -> InferencePrior:
        """The prior of the parameters."""

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows) residuals r at parameters (n_batch, n_params), not a number where the simulation failed.

        With the Jacobian J, J'r is the gradient of minus the log likelihood and J'J its information.
        """


@runtime_checkable
class Emulated(LeastSquares, Protocol):
    """What a surrogate of a posterior density needs, and sampling coordinates."""

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) whose squares sum to the deviance near `centre` (n_params,); log likelihoods."""

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where the simulation failed."""


class LatentForces(Protocol):
    """Forces with an unknown history in some residuals: sequences that white coordinates and a few parameters say."""

    @property
    def rows(self) -> slice:
        """Of the residuals, those that the forces move."""

    @property
    def columns(self) -> np.ndarray:
        """(n_white,) positions of the white coordinates among the parameters, axis after axis."""

    @property
    def process(self) -> np.ndarray:
        """(n_process,) positions of the parameters of the process."""

    @property
    def wide_process(self) -> np.ndarray:
        """(n_process,) values with which the forces can follow any motion."""

    def innovations(self, parameters: np.ndarray) -> Innovations:
        """The forces by their white coordinates, of parameters (n_batch, n_params)."""

    def response(self, parameters: np.ndarray) -> Pieces:
        """How the residuals `rows` follow the forces, at parameters (n_params,): pieces of one term."""


@runtime_checkable
class Sampled(Emulated, Protocol):
    """What a sampler needs: a density that can be emulated, and views of it from which its mode is found."""

    @property
    def histories(self) -> Sequence[LatentForces]:
        """Forces with unknown histories; most problems have none."""

    @property
    def heavy_tailed(self) -> bool:
        """Whether the slope of some log density vanishes far from its reading, as that of Student's t does."""

    @property
    def duration(self) -> float:
        """Length of the record, s."""

    def log_likelihoods(self, parameters: np.ndarray) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""

    def smoothed(self, share: float) -> Self:
        """A view with gradients everywhere: walls of an interval get `share` of its length as sd."""

    def widened(self, scale: float) -> Self:
        """A view with noise that is `scale` times as large."""

    def truncated(self, duration: float) -> Self:
        """A view of the first `duration` seconds of the record; the problem itself if there is no more of it."""


@runtime_checkable
class Modal(Protocol):
    """A problem that finds its own mode, because its residuals are made about it."""

    def posterior_mode(self, rng: np.random.Generator) -> np.ndarray:
        """(n_params,) the mode in t; `rng` is the source of starts."""


@runtime_checkable
class Forced(Sampled, Protocol):
    """What searches and a sampler need besides where a problem has histories."""

    @property
    def prior_of_others(self) -> InferencePrior:
        """The prior of the parameters that are not white coordinates of histories."""

    def jacobian_of_others(self, parameters: np.ndarray, responses: Sequence[Pieces] | None = None) -> np.ndarray:
        """(n_rows, n_others) :meth:`jacobian` by the parameters that are not white coordinates of histories.

        `responses` are those of the histories at these parameters, if they are known already.
        """

    def flown(
        self, parameters: np.ndarray, policies: Sequence[Policy] | None = None
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Members (n_batch, n_params) whose forces follow a policy, one of each history, on the way.

        Given are the parameters that this makes of theirs, what is predicted there, of which :meth:`residuals` and the
        like are without a simulation, and of each history the states (n_batch, n_pieces, n_moved) at the ends of its
        pieces, those of them that need not follow linearly.
        """

    def residuals(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> np.ndarray:
        """(n_batch, n_rows), from what is predicted if that is known, as all that follow."""

    def misfit(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,)."""

    def misfit_about(
        self, centre: np.ndarray, parameters: np.ndarray, predicted: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) whose squares sum to the deviance near `centre`; log likelihoods (n_batch,)."""

    def log_likelihood(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> np.ndarray:
        """(n_batch,) log likelihoods."""

    def with_wide_process(self) -> Self:
        """A view with a known and wide process of the forces."""


@runtime_checkable
class Identifiable(LeastSquares, Protocol):
    """What the analysis of identifiability needs: null spaces, spectra, profiles."""

    @property
    def histories(self) -> Sequence[LatentForces]:
        """Forces with unknown histories, which are integrated out."""

    @property
    def preferred_pivots(self) -> tuple[str, ...]:
        """Parameters to name null directions by where there is a choice."""

    def linear_systems(self, parameters: np.ndarray) -> Mapping[str, LinearForm]:
        """Axis -> linear form in some of the parameters at parameters (n_params,); empty if there are no equations."""


class TrialInference(Sampled, Protocol):
    """One trial, whose readings can be predicted and drawn."""

    @property
    def readings(self) -> np.ndarray:
        """(n_readings,) measured values."""

    @property
    def sds(self) -> np.ndarray:
        """(n_readings,) their standard deviations, in the unit of the readings."""

    @property
    def times(self) -> np.ndarray:
        """(n_readings,) when they were read, s."""

    @property
    def rows(self) -> Mapping[str, slice]:
        """Channel -> its readings among all, and among the residuals."""

    def predicted(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, not a number where the simulation failed."""

    def replicated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that parameters (n_batch, n_params) could have made."""

"""What the noise models share: their interface, and rows of residuals for their unknown attributes."""

from collections.abc import Mapping
from copy import copy
from typing import ClassVar, Self

import numpy as np

from bayesub.io.errors import InputError

_LOG_STEP = 1e-4  # of differences by logarithms: second ones are then good to 1e-8 of a log density
_LEAST_INFORMATION = 1e-3  # next to a prior's, which is about one


class Noise:
    """Noise of the readings of one channel.

    In all methods `predicted` is (n_batch, n), the noise-free readings of each member, not a number where its
    simulation failed; `readings` and `times` (s) are (n,). Arrays that are contiguous are not copied. The attributes
    that may be unknown are named in :attr:`SAMPLED`; :meth:`of_members` gives each member its own.

    A subclass with a kind, as in ``class AR1(Noise, kind="ar1")``, is a model of study files by that name. Its first
    attribute is `sd`; the others, with their types and defaults, are the keys of its section.
    """

    KINDS: ClassVar[dict[str, type["Noise"]]] = {}  # name in study files -> model
    words: ClassVar[str] = ""  # what a report calls it; of normal noise nothing
    SAMPLED: ClassVar[tuple[str, ...]] = ()  # names of the attributes that a problem may infer
    # whether with known attributes -|residuals|^2 / 2 is the log density but for a constant, and :meth:`weigh` does not
    # depend on the prediction
    is_normal: ClassVar[bool] = False
    has_density: ClassVar[bool] = True  # whether the log density has a gradient, and readings have quantile residuals
    # whether the gradient vanishes far from the reading, so that a search from there goes nowhere
    heavy_tailed: ClassVar[bool] = False
    sd: float

    def __init_subclass__(cls, kind: str = ""):
        if kind:
            Noise.KINDS[kind] = cls

    def __post_init__(self):
        for name in self.SAMPLED:
            positive(name, getattr(self, name))

    def of_members(self, **values: np.ndarray | float) -> Self:
        """The same noise, in which the named attributes are those of each member, (n_batch,), or of one, a number.

        A value that is not positive is not refused: it has density zero.
        """
        if not values:
            return self
        members = copy(self)
        for name, value in values.items():
            object.__setattr__(members, name, value)  # past the check of a single model, which is frozen
        return members

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """(n_batch,) log densities of the readings, minus infinity for failed simulations."""
        raise NotImplementedError

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """(n_batch, n) residuals z.

        With the derivatives J of :meth:`weigh`, J'z is the gradient of minus the log density and J'J its expected or
        observed information. Unless the noise is normal a search must compare log densities, not |z|^2.
        """
        raise NotImplementedError

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """(n, p) weighed derivatives J, of the derivatives `jacobian` (n, p) of one member's predictions (n,)."""
        raise NotImplementedError

    def quantile_residuals(
        self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """(n_batch, n) standard normal quantiles of the probability of what is below each reading, given those before.

        They are standard normal and independent at the truth: of normal noise minus the residuals. An unknown sd, and
        where in its rounding interval a reading was, are drawn from `rng`.
        """
        del rng
        return -self.residuals(predicted, readings, times)

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n,) readings of the motion `truth` (n,)."""
        raise NotImplementedError

    def smoothed(self, share: float) -> "Noise":
        """The noise for a search by gradients; `share` is the sd of smoothed walls over the resolution."""
        del share
        return self

    def widened(self, scale: float) -> "Noise":
        """The noise with an sd that is `scale` times as large, for searches from afar."""
        return self.of_members(sd=scale * self.sd)

    def deviance(
        self, residuals: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, members: "Noise"
    ) -> np.ndarray:
        """(n_batch,) minus twice the log density less that of predictions that equal the readings.

        The latter has the attributes of the model itself, and if it has no bound nothing is taken off. Residuals
        (n_batch, n) are those of the predictions. `members` is that of the members (:meth:`of_members`) or the model.
        """
        if self.is_normal and members is self:
            return np.einsum("ij,ij->i", residuals, residuals)
        most = np.nan_to_num(self.log_density(readings[None], readings, times), posinf=0.0)
        return 2.0 * (most - members.log_density(predicted, readings, times))


def scale_rows(
    noise: Noise, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, unknown: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals and derivatives that stand for the unknown attributes of a noise model in Gauss-Newton steps.

    With the gradient g and the observed information I = L L' of the log density by the logarithms of the attributes,
    z = -L^-1 g and J = L' give J'z = -g and J'J = I, as the rows of readings do for what moves the predictions.
    Where I is not positive definite the absolute values of its eigenvalues are taken. Derivatives are central
    differences of the log density, which needs no simulation. The k attributes that are unknown have (n_batch,) values
    each; z is (n_batch, k), and J (n_batch, k, k) by the logarithms of the attributes in their order.
    """
    names, k = list(unknown), len(unknown)
    logs = np.log(np.stack([np.asarray(unknown[name], dtype=float) for name in names], axis=1))

    def density(offset):
        values = np.exp(logs + _LOG_STEP * np.array(offset))
        return noise.of_members(**dict(zip(names, values.T, strict=True))).log_density(predicted, readings, times)

    unit = np.eye(k)
    middle = density(np.zeros(k))
    gradient, information = np.empty(logs.shape), np.empty((*logs.shape, k))
    for i in range(k):
        plus, minus = density(unit[i]), density(-unit[i])
        gradient[:, i] = (plus - minus) / (2.0 * _LOG_STEP)
        information[:, i, i] = (2.0 * middle - plus - minus) / _LOG_STEP**2
        for j in range(i):
            mixed = [density(a * unit[i] + b * unit[j]) for a, b in ((1, 1), (-1, -1), (1, -1), (-1, 1))]
            cross = (mixed[2] + mixed[3] - mixed[0] - mixed[1]) / (4.0 * _LOG_STEP**2)
            information[:, i, j] = information[:, j, i] = cross
    failed = ~np.isfinite(information).all(axis=(1, 2))
    information[failed] = unit
    values, vectors = np.linalg.eigh(information)
    # The root V |D|^1/2 of I serves as L does.
    root = vectors * np.sqrt(np.maximum(np.abs(values), _LEAST_INFORMATION))[:, None, :]
    rows = -np.linalg.solve(root, gradient[..., None])[..., 0]
    rows[failed] = np.nan
    return rows, np.swapaxes(root, 1, 2)


def positive(key: str, value: float) -> None:
    """Raise InputError unless a number is finite and positive."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"noise: {key} must be positive, found {value}", "value", key)


def not_negative(key: str, value: float) -> None:
    """Raise InputError unless a number is finite and not negative."""
    if not (np.isfinite(value) and value >= 0):
        raise InputError(f"noise: {key} must not be negative, found {value}", "value", key)


def ascending(times: np.ndarray | None) -> np.ndarray:
    """Contiguous times (n,); InputError unless there are some and they ascend."""
    if times is None:
        raise InputError("noise: correlated noise needs the times of the readings", "missing", "times")
    times = np.ascontiguousarray(times, dtype=float)
    steps = np.diff(times)
    if not np.all(steps > 0):
        i = int(np.argmin(steps > 0))
        raise InputError(f"noise: times must ascend, found {times[i]:g} s before {times[i + 1]:g} s", "value", "times")
    return times


def aligned(predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Contiguous predicted (n_batch, n) and readings (n,), refused if the lengths differ."""
    predicted = np.ascontiguousarray(predicted, dtype=float)
    readings = np.ascontiguousarray(readings, dtype=float)
    lengths = {predicted.shape[-1], len(readings), len(readings if times is None else times)}
    if predicted.ndim != 2 or len(lengths) > 1 or not len(readings):
        n_times = "" if times is None else f" and times {np.shape(times)}"
        message = f"noise: predicted {predicted.shape} does not match readings {readings.shape}{n_times}"
        raise InputError(message, "value", "readings")
    return predicted, readings


def each_member(value: float | np.ndarray, n_batch: int) -> np.ndarray:
    """(n_batch,) copies of a number, or the values themselves; not a number where one is not positive."""
    values = np.broadcast_to(np.asarray(value, dtype=float), (n_batch,))
    return np.where(values > 0, values, np.nan)


def standardised(
    predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None, sd: float | np.ndarray
) -> np.ndarray:
    """(n_batch, n) errors of the predictions over the sd, a number or (n_batch,)."""
    predicted, readings = aligned(predicted, readings, times)
    return (predicted - readings) / column(sd)


def column(value: float | np.ndarray) -> np.ndarray:
    """(n_batch, 1) of the values of members, or (1, 1) of a number; not a number where one is not positive."""
    column = np.reshape(value, (-1, 1))
    return np.where(column > 0, column, np.nan)


def possible(log_density: np.ndarray) -> np.ndarray:
    """Log densities with minus infinity where they are not a number."""
    return np.where(np.isnan(log_density), -np.inf, log_density)

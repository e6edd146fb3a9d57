"""Models of any subject for inference: residuals with a prior, or a log likelihood that has no residuals.

A model is what :func:`bayesub.inference.sampling.sample` and the searches ask of a problem
(:mod:`bayesub.inference.interface`), made of functions and of a prior for each parameter by name. Derivatives that are
not given are central differences in the scaled coordinates x of the prior.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from bayesub.io.arguments import checked
from bayesub.io.errors import InputError, check_known
from bayesub.problem.base import Costs
from bayesub.problem.distributions import Joint, Normal, Prior

_STEP = 1e-4  # of differences of residuals, in x; a thousandth of a prior sd may be all of the posterior
_FINE = 1e-6  # and of a log density
_SHARE = 0.01  # of differences of gradients, in posterior sds
_LEAST = 0.1  # information that a log likelihood is said to have at least, next to a prior's, which is one
_DRAWN, _STARTS = 512, 4  # places up to three prior sds off, and the best of them from which a mode is searched
_FAR = 6.0  # sds of the logarithm of an sd, above which an emulator takes it for no larger
_FAILED = "not finite"

Function = Callable[[np.ndarray], Any]


@dataclass(frozen=True, eq=False)
class OfSciPy(Prior):
    """The prior of one parameter that is a frozen continuous `distribution` of SciPy, such as ``halfcauchy(scale=5)``.

    Where a mean or sd is infinite, median and half of the central 68 % stand for them.
    """

    distribution: Any

    @property
    def mean(self) -> np.ndarray:
        """(1,)."""
        mean = self.distribution.mean()
        return np.array([mean if np.isfinite(mean) else self.distribution.median()], dtype=float)

    @property
    def sd(self) -> np.ndarray:
        """(1,)."""
        sd = self.distribution.std()
        low, high = self.parameters(np.array([-1.0, 1.0]))
        return np.array([sd if np.isfinite(sd) else 0.5 * (high - low)], dtype=float)

    def parameters(self, t: np.ndarray) -> np.ndarray:
        """As of any prior; each tail from its own side."""
        from scipy import special

        t = np.asarray(t, dtype=float)
        result, above, tail = np.empty(t.shape), t > 0.0, special.ndtr(-np.abs(t))
        result[above], result[~above] = self.distribution.isf(tail[above]), self.distribution.ppf(tail[~above])
        return result

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        """As of any prior."""
        from scipy import special

        below, above = self.distribution.cdf(parameters), self.distribution.sf(parameters)
        return np.where(below < above, special.ndtri(below), -special.ndtri(above))

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        """As of any prior."""
        log_slope = -0.5 * (t**2 + np.log(2.0 * np.pi)) - self.distribution.logpdf(self.parameters(t))
        return jacobian * np.exp(log_slope)

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        """As of any prior."""
        return self.distribution.logpdf(parameters).sum(axis=-1)


class Model:
    """What a sampler asks of a problem besides its likelihood."""

    histories = ()
    preferred_pivots = ()
    heavy_tailed = False
    duration = 1.0

    def __init__(self, priors: Mapping[str, Any], vectorized: bool):
        self.names, self.vectorized = tuple(priors), vectorized
        self.prior = _joint(priors)
        self.n_params = len(self.names)
        self.costs = Costs(failures={_FAILED: 0})

    def _middle(self) -> np.ndarray:
        return self.prior.parameters(np.zeros(self.n_params))

    def _values(self, function: Function, parameters: np.ndarray, n: int) -> np.ndarray:
        """(n_batch, n) values of a user's function; n = 0 stands for (n_batch,)."""
        name = getattr(function, "__name__", "function")
        with self.costs.timed():
            values = function(parameters) if self.vectorized else [function(member) for member in parameters]
        try:
            values = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            text = f"model: {name} must give numbers, of as many for all parameters"
            raise InputError(f"{text}; see bayesub manual own-model", "value", name) from None
        wanted = (len(parameters), n) if n else (len(parameters),)
        if values.shape != wanted:
            k = 0 if self.vectorized else 1
            text = f"model: {name} gave {values.shape[k:]} of parameters {parameters.shape[k:]}, expected {wanted[k:]}"
            raise InputError(f"{text}; a function that takes a batch needs vectorized=True", "value", name)
        return values

    def _counted(self, values: np.ndarray) -> np.ndarray:
        """The values (n_batch, ..) of so many simulations."""
        self.costs.simulations += len(values)
        failed = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        self.costs.failures[_FAILED] += int(np.count_nonzero(failed))
        return values

    def _beside(self, x: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (2 n_params, n_params) beside x (n_params,), within walls, and the middle x between them."""
        walls = self.prior.scaled_form()[0] - 2.0 * steps
        x = np.clip(x, -walls, walls)
        return self.prior.unscaled(np.concatenate([x + np.diag(steps), x - np.diag(steps)])), x

    def by_parameters(self, by_scaled: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives (n, n_params) by the parameters, of those by x; not a number where x is out of reach."""
        try:
            return np.linalg.solve(self.prior.scaled_chain(np.eye(self.n_params), x).T, by_scaled.T).T
        except np.linalg.LinAlgError:
            return np.full(by_scaled.shape, np.nan)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) whose squares sum to the deviance, log likelihoods (n_batch,)."""
        raise NotImplementedError

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods but for a constant, -inf where a value is not finite."""
        raise NotImplementedError

    def log_likelihoods(self, parameters: np.ndarray) -> dict[str, np.ndarray]:
        """All of it, of the data."""
        return {"data": self.log_likelihood(parameters)}

    def linear_systems(self, parameters: np.ndarray) -> dict:  # noqa: ARG002
        """There are no equations of motion."""
        return {}

    def smoothed(self, share: float) -> Self:  # noqa: ARG002
        """The model itself, which has gradients."""
        return self

    def truncated(self, duration: float) -> Self:  # noqa: ARG002
        """The model itself, which has no record in time."""
        return self

    def widened(self, scale: float) -> Self:  # noqa: ARG002
        """The model itself."""
        return self


class LeastSquaresModel(Model):
    """Residuals with standard normal errors, or errors of unknown sd, and a prior of each parameter.

    The log likelihood is minus half the sum of the squared residuals. With `sd`, names of parameters, it is that of
    errors e with these standard deviations s: of n errors ``-sum(e^2) / (2 s^2) - n log s``. Beside ``e / s`` there is
    then a row ``phi(v) = sign(v) sqrt(n (exp(-2 v) - 1 + 2 v))`` with ``v = log(s / rms(e))``: with errors as they are
    at a place e0, the squares of ``e0 / s0 + (e - e0) / s`` and of phi(log(s / rms(e0))) sum to the deviance, up to
    ``e0 (e - e0)``, which vanishes at a best fit. All these rows are nearly linear in log s. Six posterior sds up phi
    goes on straight and s is held: where a prior is wide, an emulator with heavy tails would follow larger and larger
    s, with which any parameters fit. InputError for a prior that is none, a name of an sd that is no parameter, or
    residuals of another shape.

    Parameters
    ----------
    residuals : gives (n_rows,) of parameters (n_params,), in the order of the priors; not finite where it fails
    priors : name -> prior of one parameter: ``bs.priors.normal``, ``uniform`` or ``log_normal``, or a frozen continuous
        distribution of SciPy
    jacobian : gives (n_rows, n_params) derivatives at parameters (n_params,); by default central differences
    sd : name of the parameter that is the sd of all errors, or a sequence with one a row, None where it is one
    vectorized : whether `residuals` takes (n_batch, n_params) and gives (n_batch, n_rows), which is many times as fast
    """

    @checked
    def __init__(
        self,
        residuals: Function,
        priors: Mapping[str, Any],
        jacobian: Function | None = None,
        *,
        sd: str | Sequence[str] | None = None,
        vectorized: bool = False,
    ):
        super().__init__(priors, vectorized)
        self._residuals, self._jacobian = residuals, jacobian
        middle = self._middle()
        pair = np.stack([middle, middle])
        self.n_errors = (0, *np.shape(residuals(pair) if vectorized else residuals(middle)))[-1]
        self._values(residuals, pair, self.n_errors)
        self._of = () if sd is None else (sd,) * self.n_errors if isinstance(sd, str) else tuple(sd)
        for name in filter(None, self._of):
            check_known(name, self.names, f"model: sd '{name}' is no parameter")
        if self._of and len(self._of) != self.n_errors:
            text = f"model: sd has {len(self._of)} names for {self.n_errors} residuals; give one a row, or one for all"
            raise InputError(text, "value", "sd")
        rows = [self.names.index(name) if name else -1 for name in self._of or (None,) * self.n_errors]
        self._sds = np.unique([k for k in rows if k >= 0]).astype(int)
        self._members = (np.array(rows)[:, None] == self._sds).astype(float)  # (n_errors, n_sds)
        self._known = 1.0 - self._members.sum(axis=1)  # (n_errors,) one where errors are standard already
        self._n = self._members.sum(axis=0)
        self._widening = 1.0
        self._about: tuple[bytes, np.ndarray] | None = None
        self.jacobian(middle)  # refuses one of another shape
        self.costs = Costs(failures={_FAILED: 0})

    def widened(self, scale: float) -> Self:
        """The model with errors of sds that are `scale` times as large."""
        wide = copy(self)
        wide._widening = scale * self._widening
        return wide

    def _errors(self, parameters) -> np.ndarray:
        return self._counted(self._values(self._residuals, parameters, self.n_errors))

    def _scales(self, parameters) -> np.ndarray:
        """(n_batch, n_errors) sds."""
        sds = self._widening * (parameters[:, self._sds] @ self._members.T + self._known)
        return np.where(sds > 0.0, sds, np.nan)

    def _offsets(self, errors, parameters) -> np.ndarray:
        """(n_batch, n_sds) logarithms v of the sds over the roots of the mean squares of errors (n_batch, n_errors)."""
        means = np.maximum(errors**2 @ self._members / self._n, np.finfo(float).tiny)
        return np.log(self._widening * parameters[:, self._sds]) - 0.5 * np.log(means)

    def _rows(self, v) -> np.ndarray:
        """(n_batch, n_sds) phi."""
        exact = np.sign(v) * np.sqrt(np.maximum(np.expm1(-2.0 * v) + 2.0 * v, 0.0))
        return np.sqrt(self._n) * np.where(np.abs(v) < 1e-4, np.sqrt(2.0) * v, exact)

    def _deviances(self, errors, parameters) -> np.ndarray:
        squares = np.sum((errors / self._scales(parameters)) ** 2, axis=1)
        logs = np.log(self._widening * parameters[:, self._sds]) @ (2.0 * self._n)
        return np.nan_to_num(squares + logs, nan=np.inf, posinf=np.inf)

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows), of errors and after them of sds, and deviances (n_batch,) but for a constant."""
        parameters = np.atleast_2d(parameters)
        errors = self._errors(parameters)
        with np.errstate(all="ignore"):
            rows = self._rows(self._offsets(errors, parameters))
            return np.hstack([errors / self._scales(parameters), rows]), self._deviances(errors, parameters)

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows)."""
        return self.misfit(parameters)[0]

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods but for a constant, -inf where a residual is not finite."""
        parameters = np.atleast_2d(parameters)
        errors = self._errors(parameters)
        with np.errstate(all="ignore"):
            return -0.5 * self._deviances(errors, parameters)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) whose squares sum to the deviance near `centre`; log likelihoods (n_batch,)."""
        parameters = np.atleast_2d(parameters)
        errors, key = self._errors(parameters), np.asarray(centre).tobytes()
        if not len(self._sds):
            return errors / self._widening, -0.5 * self._deviances(errors, parameters)
        if self._about is None or self._about[0] != key:
            self._about = key, self._errors(np.atleast_2d(centre))
        at = self._about[1]
        with np.errstate(all="ignore"):
            v, far = self._offsets(at, parameters), _FAR / np.sqrt(2.0 * self._n)
            beyond = np.maximum(v - far, 0.0)
            phi = self._rows(np.minimum(v, far))
            phi += beyond * self._n * -np.expm1(-2.0 * far) / self._rows(far)
            scales = self._scales(parameters) * np.exp(-beyond @ self._members.T)
            rows = at / self._scales(np.atleast_2d(centre)) + (errors - at) / scales
            return np.hstack([rows, phi]), -0.5 * self._deviances(errors, parameters)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals at parameters (n_params,)."""
        self.costs.jacobians += 1
        parameters = np.asarray(parameters, dtype=float)
        if self._jacobian is None:
            steps = np.full(self.n_params, _STEP)
            beside, x = self._beside(self.prior.scaled(parameters), steps)
            after, before = np.split(self._values(self._residuals, beside, self.n_errors), 2)
            by_errors = self.by_parameters((after - before).T / (2.0 * steps), x)
        else:
            with self.costs.timed():
                by_errors = np.asarray(self._jacobian(parameters), dtype=float)
            if by_errors.shape != (self.n_errors, self.n_params):
                wanted = f"expected {(self.n_errors, self.n_params)}, residuals by parameters"
                raise InputError(f"model: jacobian gave {by_errors.shape}, {wanted}", "value", "jacobian")
        if not len(self._sds):
            return by_errors / self._widening
        members = parameters[None]
        v = self._offsets(self._errors(members), members)[0]
        small = np.abs(v) < 1e-4
        phi = np.where(small, 1.0, self._rows(v))
        slopes = np.where(small, np.sqrt(2.0 * self._n), -self._n * np.expm1(-2.0 * v) / phi)
        by_sds = np.zeros((len(self._sds), self.n_params))
        by_sds[np.arange(len(self._sds)), self._sds] = slopes / parameters[self._sds]
        return np.vstack([by_errors / self._scales(members).T, by_sds])


class DensityModel(Model):
    """A log likelihood without residuals, and a prior of each parameter.

    The mode is found by trust regions in t. About a centre, with the information ``R'R`` there, the distance
    ``d = R (x - x0) + R'^-1 g0`` and ``R'^-1 g`` of the gradient g of minus the log likelihood, the rows
    ``(2 d + R'^-1 g) / 3`` have squares that sum to the deviance but for terms of the fourth order; they are lengthened
    so that they sum to it. Such rows are emulated as residuals are, and each costs a gradient; a step of the sampler
    costs a log likelihood only, whose exact value decides. InputError for no prior, or values of another shape.

    Parameters
    ----------
    log_likelihood : gives a number of parameters (n_params,), in the order of the priors, without the log prior
    priors : as of :class:`LeastSquaresModel`
    gradient : gives (n_params,) its derivatives; by default central differences
    vectorized : whether both take (n_batch, n_params) and give (n_batch,) and (n_batch, n_params)
    """

    @checked
    def __init__(
        self,
        log_likelihood: Function,
        priors: Mapping[str, Any],
        gradient: Function | None = None,
        *,
        vectorized: bool = False,
    ):
        super().__init__(priors, vectorized)
        self._density, self._gradient = log_likelihood, gradient
        pair = np.stack([self._middle()] * 2)
        self._values(log_likelihood, pair, 0)
        if gradient is not None:
            self._values(gradient, pair, self.n_params)
        self._steps = np.full(self.n_params, 1e-4)  # of differences of gradients, in x
        self._about: tuple[np.ndarray, ...] | None = None

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods but for a constant, -inf where it is not finite."""
        values = self._counted(self._values(self._density, np.atleast_2d(parameters), 0))
        return np.where(np.isfinite(values), values, -np.inf)

    def slopes(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_params) derivatives of minus the log likelihood by the scaled coordinates x."""
        x = self.prior.scaled(parameters)
        if self._gradient is not None:
            self.costs.jacobians += len(parameters)
            return -self.prior.scaled_chain(self._values(self._gradient, parameters, self.n_params), x)
        steps = np.full(self.n_params, _FINE)
        beside = np.concatenate([self._beside(member, steps)[0] for member in x])
        values = self.log_likelihood(beside).reshape(len(x), 2, self.n_params)
        with np.errstate(invalid="ignore"):
            return (values[:, 1] - values[:, 0]) / (2.0 * steps)

    def information(self, parameters: np.ndarray) -> np.ndarray:
        """(n_params, n_params) second derivatives of minus the log likelihood by x, at parameters (n_params,)."""
        beside, _ = self._beside(self.prior.scaled(parameters), self._steps)
        after, before = np.split(self.slopes(beside), 2)
        with np.errstate(invalid="ignore"):
            matrix = _zeroed((after - before) / (2.0 * self._steps[:, None]))
        self._steps = _SHARE / np.sqrt(1.0 + np.abs(np.diag(matrix)))
        return 0.5 * (matrix + matrix.T)

    def posterior_mode(self, rng: np.random.Generator) -> np.ndarray:
        """(n_params,) the mode in t: the best of some searches from the most likely of many places."""
        from scipy import optimize

        prior = self.prior

        def cost(t):
            (value,) = self.log_likelihood(prior.parameters(t)[None])
            return 0.5 * t @ t - (value if np.isfinite(value) else -1e100)

        def both(t):  # derivatives by t: those by x, by what x changes with t
            parameters = prior.parameters(t)
            by_x = prior.scaled_chain(np.eye(self.n_params), prior.scaled(parameters))
            return parameters, np.linalg.solve(by_x, prior.chain(np.eye(self.n_params), t))

        def slope(t):
            parameters, x_by_t = both(t)
            return t + _zeroed(self.slopes(parameters[None])[0]) @ x_by_t

        def curvature(t):
            parameters, x_by_t = both(t)
            return np.eye(self.n_params) + x_by_t.T @ self.information(parameters) @ x_by_t

        draws = np.linspace(0.0, 3.0, _DRAWN)[:, None] * rng.standard_normal((_DRAWN, self.n_params))
        costs = 0.5 * np.sum(draws**2, axis=1) - self.log_likelihood(prior.parameters(draws))
        ends = []
        for start in draws[np.argsort(costs)[:_STARTS]]:
            self._steps = np.full(self.n_params, 1e-4)
            options = {"gtol": 1e-3, "maxiter": 100}
            ends.append(
                optimize.minimize(cost, start, jac=slope, hess=curvature, method="trust-exact", options=options)
            )
        best = min(ends, key=lambda end: end.fun)
        if not best.fun < 1e99:
            text = "the log likelihood is finite nowhere that a search from the prior came to; narrow the prior"
            raise InputError(text, "model", "prior")
        mode = prior.parameters(best.x)
        self.information(mode)  # for the steps
        return mode

    def _at(self, centre) -> tuple[np.ndarray, ...]:
        """Centre, its x, R, the rows R'^-1 g there, the log likelihood there."""
        if self._about is None or not np.array_equal(self._about[0], centre):
            centre = np.array(centre, dtype=float)
            values, vectors = np.linalg.eigh(self.information(centre))
            root = np.sqrt(np.maximum(np.abs(values), _LEAST))[:, None] * vectors.T
            rows = np.linalg.solve(root.T, self.slopes(centre[None])[0])
            self._about = centre, self.prior.scaled(centre), root, rows, self.log_likelihood(centre[None])
        return self._about

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_params) whose squares sum to the deviance near `centre`; log likelihoods (n_batch,)."""
        parameters = np.atleast_2d(parameters)
        _, x0, root, at, level = self._at(centre)
        distance = (self.prior.scaled(parameters) - x0) @ root.T + at
        log_likelihoods = self.log_likelihood(parameters)
        with np.errstate(all="ignore"):
            bend = np.linalg.solve(root.T, self.slopes(parameters).T).T - distance
            longest = 1.0 + np.linalg.norm(distance, axis=1)  # where slopes explode they say nothing
            rows = distance + bend / 3.0 / np.maximum(1.0, np.linalg.norm(bend, axis=1) / longest)[:, None]
            deviances = np.maximum(2.0 * (level - log_likelihoods) + at @ at, 0.0)
            squares = np.sum(rows**2, axis=1)
            longer = np.clip(np.sqrt(deviances / np.maximum(squares, 1e-12)), 0.5, 2.0)
            return rows * np.where(squares > 1e-9, longer, 1.0)[:, None], log_likelihoods

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The rows about the mode, or the middle of the prior, and deviances (n_batch,) but for a constant."""
        rows, log_likelihoods = self.misfit_about(self._middle() if self._about is None else self._about[0], parameters)
        return rows, -2.0 * log_likelihoods

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_params), as :meth:`misfit`."""
        return self.misfit(parameters)[0]

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_params, n_params) derivatives of the rows at parameters (n_params,), but for their lengthening."""
        parameters = np.asarray(parameters, dtype=float)
        _, _, root, _, _ = self._at(parameters if self._about is None else self._about[0])
        by_scaled = (2.0 * root + np.linalg.solve(root.T, self.information(parameters))) / 3.0
        return self.by_parameters(by_scaled, self.prior.scaled(parameters))


def _zeroed(derivatives) -> np.ndarray:
    """Derivatives, zero where they are not finite."""
    return np.where(np.isfinite(derivatives), derivatives, 0.0)


def _joint(priors) -> Prior:
    """The prior of all parameters, the normal ones as one part."""
    if not priors:
        raise InputError("model: priors must have one parameter at least", "missing", "priors")
    parts: list[Prior] = []
    for name, given in priors.items():
        if not isinstance(name, str):
            raise InputError(f"model: {name!r} in priors is no text; give a name, such as '{name}'", "value", "priors")
        of_scipy = all(hasattr(given, method) for method in ("ppf", "isf", "cdf", "sf", "logpdf", "std"))
        of_scipy = of_scipy and not getattr(given, "numargs", 0) and np.ndim(given.support()) == 1  # frozen, and of one
        prior = OfSciPy(given) if of_scipy else given
        if not isinstance(prior, Prior) or prior.mean.shape != (1,) or not 0.0 < prior.sd < np.inf:
            kind = type(given).__name__
            text = f"model: prior of '{name}' is a {kind}, no prior of one parameter with a finite width"
            remedy = "bs.priors.normal, uniform or log_normal, or a frozen continuous distribution of SciPy"
            raise InputError(f"{text}; give {remedy}", "value", name)
        parts.append(prior)
    normal = [k for k, part in enumerate(parts) if type(part) is Normal]
    others = [k for k in range(len(parts)) if k not in normal]
    members, positions = [parts[k] for k in others], [np.array([k]) for k in others]
    if normal:
        mean, sd = (np.concatenate([getattr(parts[k], key) for k in normal]) for key in ("mean", "sd"))
        members, positions = [Normal(mean, sd), *members], [np.array(normal), *positions]
    return Joint(tuple(members), tuple(positions))

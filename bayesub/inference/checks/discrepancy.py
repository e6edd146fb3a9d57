"""Why residuals are correlated: candidates of model discrepancy, compared by how probable each makes the readings.

In first order about some parameters the residuals are ``r + J d``, with d the offset of the parameters in coordinates t
in which their prior is standard normal, and whatever is missing adds ``B w`` to them, w normal with standard deviations
that are unknown sizes. With parameters and w integrated out the log density of the readings depends on the sizes alone,
and is maximised. Its gain over noise alone, less half the logarithm of the number of readings for each size and time
(Schwarz 1978), is what candidates are compared by.

- ``bias``, ``current``, ``coefficient``: one column for each trial or component, of one size; as many of a kind as pay
- ``disturbance``: forces on some axes at knots, a size for each axis and a correlation time
- ``slow noise``: of single channels, whose readings then have a correlation time and another sd

A force moves the boat, and all channels together, as the equations say. Slow noise moves each for itself. Where the
noise alone fits badly its parameters are far off, and what is expanded about them too. So what may be the best
candidate is expanded again about its own mode, a few times; slow noise is not, as it moves the parameters less.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy import linalg, optimize

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability.linalg import triangle

_SCALES = 1.2 ** np.arange(-8.0, 26.0)  # sizes of slow noise, over the sd that the noise is said to have
_SWEEPS = 6  # over the channels
_START = 1.0  # of the search for sizes: their logarithm, over those that change the readings by their noise
_BOUNDS = (-9.0, 9.0)  # of this logarithm
_EXPANSIONS = 3  # about the mode of what was expanded before
_SAME = 0.5  # nats; less of a change ends them
_NEAR = 0.1  # posterior standard deviations from a mode
_ITERATIONS = 20  # of a search for it
_ITERATIONS_WITH_FORCES = 3
_RIVAL = 0.5  # gain over that of the best, of those that are expanded again


@dataclass(frozen=True)
class Discrepancy:
    """A possible explanation of correlated residuals."""

    kind: str  # "bias", "current", "coefficient", "disturbance" or "slow noise"
    # bias, coefficient, axis or channel -> standard deviation; of slow noise over the sd that it is said to have
    sizes: dict[str, float]
    times: dict[str, float]  # axis or channel -> correlation time, s
    gain: float  # log density of the readings over that by noise alone, less the penalty for sizes and times

    def to_json(self) -> dict:
        """Everything as JSON types."""
        return asdict(self)


@dataclass(frozen=True)
class _Fit:
    """A candidate and what it is expanded about: kind and name -> amounts, and roots of their covariance."""

    candidate: Discrepancy
    expansion: Any
    roots: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)
    amounts: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)
    expanded: bool = False


def find_discrepancies(model: Any, standard: np.ndarray) -> list[Discrepancy]:
    """The candidates that make the readings more probable than their noise alone does, best first.

    `model`: with the methods of :class:`bayesub.problem.alternatives.LeftOut`; `standard` (n_params,): coordinates of
    the mode of noise alone, or of parameters near it.
    """
    first = model.about(standard)
    if first is None:
        return []
    alone = log_density(first)
    methods: dict[str, Callable[[Any], _Fit]] = {kind: partial(_fit_effects, kind) for kind in first.effects}
    if first.forces:
        methods["disturbance"] = _fit_forces
    fits = {kind: method(first) for kind, method in methods.items()}
    slow = model.slow_noises(first)
    candidates = [_fit_slow_noise(first, slow)] if slow else []
    best = max([c.gain for c in candidates] + [fit.candidate.gain for fit in fits.values()], default=0.0)
    for kind, fit in fits.items():
        rival = fit.candidate.gain > max(_RIVAL * best, 0.0)
        candidates.append((_expand(model, methods[kind], fit, alone) if rival else fit).candidate)
    return sorted((c for c in candidates if c.sizes and c.gain > 0.0), key=lambda c: -c.gain)


def _expand(model, method, fit, alone) -> _Fit:
    """The fit about its own mode, at which the sizes are fitted again."""
    # The mode of noise alone is bent to do what is missing; what has a few amounts only is found sooner from the prior.
    forced = fit.candidate.kind == "disturbance"
    start = fit.expansion.standard if forced else np.zeros_like(fit.expansion.standard)
    for _ in range(_EXPANSIONS):
        if not fit.roots:
            break
        problem = _WithAmounts(model, len(start), fit.roots)
        begin = np.concatenate([start, problem.white(fit.amounts) if fit.expanded else np.zeros(problem.n_white)])
        n_iterations = _ITERATIONS_WITH_FORCES if problem.forced else _ITERATIONS
        try:
            estimate = gauss_newton(problem, begin, tolerance=_NEAR, max_iterations=n_iterations)
        except ValueError:  # the simulation fails without what an earlier expansion had chosen
            break
        start, amounts = problem.split(estimate.values)
        expansion = model.about(start, amounts)
        if expansion is None:
            break
        again = method(expansion)
        gain = again.candidate.gain + log_density(expansion) - alone
        change = gain - fit.candidate.gain
        fit = replace(again, candidate=replace(again.candidate, gain=gain), amounts=amounts, expanded=True)
        if abs(change) < _SAME:
            break
    return fit


class _WithAmounts:
    """The parameters, and after them amounts of given sizes as white coordinates, as a problem for searches.

    It is :class:`bayesub.inference.interface.Searchable`.
    """

    def __init__(self, model: Any, n_params: int, roots: dict[tuple[str, str], np.ndarray]):
        self._model, self._n, self._roots = model, n_params, roots
        ends = n_params + np.cumsum([len(root) for root in roots.values()])
        self._parts = {key: slice(end - len(root), end) for end, (key, root) in zip(ends, roots.items(), strict=True)}
        self.n_params, self.n_white = int(ends[-1]), int(ends[-1]) - n_params
        self.forced = any(kind == "disturbance" for kind, _ in roots)
        self.names, self.prior, self.costs = ("",) * self.n_params, _White(), model.costs

    def white(self, amounts: dict[tuple[str, str], np.ndarray]) -> np.ndarray:
        """(n_white,) coordinates of amounts."""
        parts = [np.linalg.solve(root, amounts.get(key, np.zeros(len(root)))) for key, root in self._roots.items()]
        return np.concatenate(parts)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, dict[tuple[str, str], np.ndarray]]:
        """Standard coordinates of the parameters, and amounts."""
        amounts = {key: values[..., part] @ self._roots[key].T for key, part in self._parts.items()}
        return values[..., : self._n], amounts

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n, n_rows) and deviances (n,)."""
        rows = self._model.residuals(*self.split(parameters))
        deviances = np.einsum("ij,ij->i", rows, rows)
        return rows, np.where(np.isfinite(deviances), deviances, np.inf)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals."""
        expansion = self._model.about(*self.split(parameters), forced=self.forced)
        columns = {("disturbance", axis): part for axis, part in expansion.forces.items()}
        columns |= {(kind, name): c for kind, parts in expansion.effects.items() for name, c in parts.items()}
        return np.hstack([expansion.jacobian, *(columns[key] @ root for key, root in self._roots.items())])


class _White:
    """A standard normal prior, whose coordinates are the parameters: :class:`bayesub.inference.interface.Standard`."""

    def parameters(self, t: np.ndarray) -> np.ndarray:
        return t

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        return parameters

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:  # noqa: ARG002
        return jacobian


def log_density(expansion: Any) -> float:
    """Log density of the residuals by noise alone, parameters integrated out, but for a constant."""
    rows = np.column_stack([expansion.jacobian, expansion.residuals])
    prior = np.column_stack([np.eye(len(expansion.standard)), expansion.standard])
    diagonal = np.diag(triangle(np.vstack([rows, prior])))
    return float(-np.log(np.abs(diagonal[:-1])).sum() - 0.5 * diagonal[-1] ** 2)


def gain_of_sizes(forces: np.ndarray, products: np.ndarray, sizes: np.ndarray) -> tuple[float, np.ndarray]:
    """Log density over that without columns, and its derivatives by the logarithm of the size of each column (k,).

    Of inner products of the columns with the residuals (k,) and with themselves (k, k), as of :func:`inner_products`,
    and of the standard deviations (k,) of independent amounts.
    """
    precision = np.eye(len(sizes)) + sizes[:, None] * products * sizes
    factor = linalg.cholesky(precision, lower=True, check_finite=False)
    mean = linalg.cho_solve((factor, True), sizes * forces, check_finite=False)
    inverse, _ = linalg.lapack.dpotri(factor, lower=True)
    gain = 0.5 * (sizes * forces) @ mean - np.log(np.diag(factor)).sum()
    return float(gain), mean**2 + np.diag(inverse) - 1.0


def inner_products(expansion: Any, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inner products of columns (n_rows, k) with the residuals (k,) and with themselves (k, k).

    What the parameters make as well, within their prior, is taken off.
    """
    p, k = expansion.jacobian.shape[1], columns.shape[1]
    rows = np.column_stack([expansion.jacobian, columns, expansion.residuals])
    prior = np.column_stack([np.eye(p), np.zeros((p, k)), expansion.standard])
    # Below the first p rows of the triangle stands what the parameters cannot make, of columns and residuals.
    rest = triangle(np.vstack([rows, prior]))[p:, p:]
    return rest[:, :k].T @ rest[:, k], rest[:, :k].T @ rest[:, :k]


def _fit_sizes(forces, products, groups) -> tuple[float, np.ndarray]:
    """Largest gain, and the size of each group, of columns with the number (k,) of their group."""
    n_groups = groups.max() + 1
    unit = np.array([1.0 / np.sqrt(np.diag(products)[groups == g].mean()) for g in range(n_groups)])

    def cost(logs):
        gain, slopes = gain_of_sizes(forces, products, (unit * np.exp(logs))[groups])
        return -gain, -np.bincount(groups, slopes, n_groups)

    start, bounds = np.full(n_groups, _START), [_BOUNDS] * n_groups
    result = optimize.minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
    return float(-result.fun), unit * np.exp(result.x)


def _part(inner, groups, chosen):
    """Inner products of chosen groups, and their numbers among these."""
    forces, products = inner
    some = np.isin(groups, chosen)
    return forces[some], products[np.ix_(some, some)], np.unique(groups[some], return_inverse=True)[1]


def _fit_effects(kind, expansion) -> _Fit:
    """Single columns of a kind, as many as pay, one after the other."""
    names, parts = list(expansion.effects[kind]), list(expansion.effects[kind].values())
    groups = np.repeat(np.arange(len(names)), [part.shape[1] for part in parts])
    inner, n = inner_products(expansion, np.hstack(parts)), len(expansion.residuals)
    seen = [g for g in range(len(names)) if np.diag(inner[1])[groups == g].min() > 0.0]
    best, sizes = 0.0, np.zeros(0)
    chosen: list[int] = []
    while rest := [g for g in seen if g not in chosen]:
        trials = []
        for g in rest:
            more = sorted([*chosen, g])
            gain, sizes_of_more = _fit_sizes(*_part(inner, groups, more))
            trials.append((gain - len(more) * (_penalty(1, n) + np.log(len(seen))), more, sizes_of_more))
        trial = max(trials, key=lambda trial: trial[0])
        if trial[0] <= best:
            break
        best, chosen, sizes = trial
    named = {names[g]: float(size) for g, size in zip(chosen, sizes, strict=True)}
    roots = {(kind, name): size * np.eye(expansion.effects[kind][name].shape[1]) for name, size in named.items()}
    return _Fit(Discrepancy(kind, named, {}, best), expansion, roots)


def _fit_forces(expansion) -> _Fit:
    """Forces on the axes that pay, at the best of the correlation times."""
    axes, n_knots, n = list(expansion.forces), len(next(iter(expansion.factors.values()))), len(expansion.residuals)
    forces, products = inner_products(expansion, np.hstack(list(expansion.forces.values())))
    by_axis = products.reshape(len(axes), n_knots, len(axes), n_knots)
    groups, fits = np.repeat(np.arange(len(axes)), n_knots), {}
    for time, factor in expansion.factors.items():
        turned = np.einsum("ki,akbl,lj->aibj", factor, by_axis, factor, optimize=True)
        fits[time] = (forces.reshape(-1, n_knots) @ factor).ravel(), turned.reshape(products.shape)

    def trial(time, chosen):
        gain, sizes = _fit_sizes(*_part(fits[time], groups, chosen))
        return gain - _penalty(len(chosen) + 1, n), sizes, time, chosen

    best = max((trial(time, list(range(len(axes)))) for time in fits), key=lambda trial: trial[0])
    while len(chosen := best[3]) > 1:
        fewer = max((trial(best[2], [b for b in chosen if b != c]) for c in chosen), key=lambda trial: trial[0])
        if fewer[0] < best[0]:
            break
        best = fewer
    gain, sizes, time, chosen = best
    named = {axes[c]: float(size) for c, size in zip(chosen, sizes, strict=True)}
    roots = {("disturbance", axis): size * expansion.factors[time] for axis, size in named.items()}
    return _Fit(Discrepancy("disturbance", named, dict.fromkeys(named, time), gain), expansion, roots)


def _fit_slow_noise(expansion, noises) -> Discrepancy:
    """Slow noise of the channels where it pays, one channel after the other until nothing changes."""
    prior = np.column_stack([np.eye(len(expansion.standard)), expansion.standard])
    whole, n = np.column_stack([expansion.jacobian, expansion.residuals]), len(expansion.residuals)
    # In coordinates in which the information is one, about the mode: as they are, inner products lose the digits. The
    # triangle of all rows, with the residuals' own length replaced by one, turns into the unit matrix.
    upper = triangle(np.vstack([whole, prior]))
    upper[-1] = np.eye(len(upper))[-1]
    unit = linalg.solve_triangular(upper, np.eye(len(upper)))
    prior, whole = prior @ unit, whole @ unit
    # Inner products of the rows of each channel, with white noise and whitened for each correlation time.
    white = {name: whole[slow.rows].T @ whole[slow.rows] for name, slow in noises.items()}
    whitened = {name: slow.whitened @ unit for name, slow in noises.items()}
    slowed = {name: rows.transpose(0, 2, 1) @ rows for name, rows in whitened.items()}
    # The log density follows from the sum over prior and channels; one channel's part is exchanged at a time.
    total = prior.T @ prior + whole.T @ whole
    alone, parts, own = _log_densities(total), dict(white), dict.fromkeys(white, 0.0)
    chosen: dict[str, tuple[int, int]] = {}
    for _ in range(_SWEEPS):
        before = dict(chosen)
        for name, slow in noises.items():
            others = total - parts[name]
            trials = others + slowed[name][:, None] / _SCALES[:, None, None] ** 2
            norms = -slow.half_log_determinants[:, None] - slow.whitened.shape[1] * np.log(_SCALES)
            densities = _log_densities(trials) + norms
            i, j = (int(k) for k in np.unravel_index(np.argmax(densities), densities.shape))
            if densities[i, j] - _penalty(2, n) > _log_densities(others + white[name]):
                chosen[name], parts[name], own[name] = (i, j), slowed[name][i] / _SCALES[j] ** 2, norms[i, j]
            else:
                chosen.pop(name, None)
                parts[name], own[name] = white[name], 0.0
            total = others + parts[name]
        if chosen == before:
            break
    gain = float(_log_densities(total) + sum(own.values()) - alone) - _penalty(2 * len(chosen), n)
    sizes = {name: float(_SCALES[j]) for name, (_, j) in chosen.items()}
    times = {name: float(noises[name].times[i]) for name, (i, _) in chosen.items()}
    return Discrepancy("slow noise", sizes, times, gain)


def _log_densities(products):
    """Log densities (..) but for a constant, of inner products (.., p + 1, p + 1) with the residuals last."""
    diagonal = np.diagonal(np.linalg.cholesky(products), axis1=-2, axis2=-1)
    return -np.log(diagonal[..., :-1]).sum(axis=-1) - 0.5 * diagonal[..., -1] ** 2


def _penalty(n_sizes, n) -> float:
    return 0.5 * n_sizes * np.log(n)

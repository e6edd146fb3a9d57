"""The posteriors of posteriordb as models of ours, written from the mathematics of their Stan programs.

An improper flat prior is a normal one that is a thousand times as wide as the data let a parameter be, or half of one.
Parameters with other supports get the prior that the program has, as a distribution; what is left of a program's prior
is a factor of the likelihood. Names and what is reported are those of posteriordb.
"""

import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy import stats

import bayesub as bs

SHIPPED = json.loads((Path(__file__).parent / "posteriordb.json").read_text(encoding="utf-8"))
WIDE = 1e3
STEPS = 20  # of Runge and Kutta between two readings
HALF_CAUCHY = stats.halfcauchy(scale=2.5)


@dataclass(frozen=True)
class Reference:
    """A model, and what of its parameters (n, n_params) posteriordb reports: values (n, n_reported) in its order."""

    model: bs.LeastSquaresModel | bs.DensityModel
    reported: Callable[[np.ndarray], np.ndarray] = lambda parameters: parameters


def data_of(posterior: str, folder: Path | None) -> SimpleNamespace | None:
    """The data of a posterior by name, shipped or of the folder of a clone of posteriordb; None if there are none."""
    name = posterior.partition("-")[0]
    content = SHIPPED["data"].get(name)
    if content is None and folder is not None:
        with zipfile.ZipFile(folder / "posterior_database" / "data" / "data" / f"{name}.json.zip") as archive:
            content = json.loads(archive.read(f"{name}.json"))
    if content is None:
        return None
    return SimpleNamespace(
        **{key: np.array(v, dtype=float) if isinstance(v, list) else v for key, v in content.items()}
    )


def pose(posterior: str, data: SimpleNamespace) -> Reference:
    """The posterior of that name."""
    if posterior in COLUMNS:
        return Reference(regression(posterior, data))
    return OTHERS[posterior.partition("-")[2]](data)


def regression(posterior: str, data: SimpleNamespace) -> bs.LeastSquaresModel:
    """``y = X beta + sigma e``."""
    y, *columns = COLUMNS[posterior](data)
    matrix, names = np.column_stack(columns), list(SHIPPED["moments"][posterior])
    widths = WIDE * np.sqrt(np.mean(y**2) / np.mean(matrix**2, axis=0))
    priors = {name: bs.priors.normal(0.0, width) for name, width in zip(names[:-1], widths, strict=True)}
    priors[names[-1]] = stats.halfnorm(scale=WIDE * np.sqrt(np.mean(y**2)))
    priors |= {names[k]: prior for k, prior in _given(posterior, data).items()}
    slopes = np.column_stack([matrix, np.zeros(len(y))])
    errors = lambda p: p[:, :-1] @ matrix.T - y  # noqa: E731
    return bs.LeastSquaresModel(errors, priors, lambda _: slopes, sd=names[-1], vectorized=True)


def _lags(d):
    y, k = d.y, d.K
    return y[k:], np.ones(len(y) - k), *(y[k - lag : len(y) - lag] for lag in range(1, k + 1))


def _centred(x, middle=None, scale=1.0):
    return (x - (np.mean(x) if middle is None else middle)) / scale


def _product(y, a, b):
    """y by one, a, b and their product."""
    return y, np.ones(len(y)), a, b, a * b


def _nes(d):
    ages = (1.0 * (d.age_discrete == k) for k in (2, 3, 4))
    return d.partyid7, np.ones(d.N), d.real_ideo, d.race_adj, *ages, d.educ1, d.gender, d.income


def _mesquite(d, *columns):
    return np.log(d.weight), np.ones(d.N), *map(np.log, columns)


def _diamonds(d):
    centred = d.X[:, 1:] - d.X[:, 1:].mean(axis=0)
    return d.Y, *centred.T, np.ones(d.N)


# Posterior -> response and columns, of the data.
COLUMNS = {
    "arK-arK": _lags,
    "diamonds-diamonds": _diamonds,
    "earnings-earn_height": lambda d: (d.earn, np.ones(d.N), d.height),
    "earnings-log10earn_height": lambda d: (np.log10(d.earn), np.ones(d.N), d.height),
    "earnings-logearn_height": lambda d: (np.log(d.earn), np.ones(d.N), d.height),
    "earnings-logearn_height_male": lambda d: (np.log(d.earn), np.ones(d.N), d.height, d.male),
    "earnings-logearn_interaction": lambda d: _product(np.log(d.earn), d.height, d.male),
    "earnings-logearn_interaction_z": lambda d: _product(
        np.log(d.earn), _centred(d.height, scale=np.std(d.height, ddof=1)), d.male
    ),
    "earnings-logearn_logheight_male": lambda d: (np.log(d.earn), np.ones(d.N), np.log(d.height), d.male),
    "kidiq-kidscore_interaction": lambda d: _product(d.kid_score, d.mom_hs, d.mom_iq),
    "kidiq-kidscore_momhs": lambda d: (d.kid_score, np.ones(d.N), d.mom_hs),
    "kidiq-kidscore_momhsiq": lambda d: (d.kid_score, np.ones(d.N), d.mom_hs, d.mom_iq),
    "kidiq-kidscore_momiq": lambda d: (d.kid_score, np.ones(d.N), d.mom_iq),
    "kidiq_with_mom_work-kidscore_interaction_c": lambda d: _product(
        d.kid_score, _centred(d.mom_hs), _centred(d.mom_iq)
    ),
    "kidiq_with_mom_work-kidscore_interaction_c2": lambda d: _product(
        d.kid_score, _centred(d.mom_hs, 0.5), _centred(d.mom_iq, 100.0)
    ),
    "kidiq_with_mom_work-kidscore_interaction_z": lambda d: _product(
        d.kid_score, *(_centred(x, scale=2.0 * np.std(x, ddof=1)) for x in (d.mom_hs, d.mom_iq))
    ),
    "kidiq_with_mom_work-kidscore_mom_work": lambda d: (
        d.kid_score, np.ones(d.N), *(1.0 * (d.mom_work == k) for k in (2, 3, 4))
    ),
    "kilpisjarvi_mod-kilpisjarvi": lambda d: (d.y, np.ones(d.N), d.x),
    "mesquite-logmesquite": lambda d: (
        *_mesquite(d, d.diam1, d.diam2, d.canopy_height, d.total_height, d.density), d.group
    ),
    "mesquite-logmesquite_logva": lambda d: (
        *_mesquite(d, d.diam1 * d.diam2 * d.canopy_height, d.diam1 * d.diam2), d.group
    ),
    "mesquite-logmesquite_logvas": lambda d: (
        *_mesquite(d, *_sizes(d), d.total_height, d.density), d.group
    ),
    "mesquite-logmesquite_logvash": lambda d: (*_mesquite(d, *_sizes(d), d.total_height), d.group),
    "mesquite-logmesquite_logvolume": lambda d: _mesquite(d, d.diam1 * d.diam2 * d.canopy_height),
    "mesquite-mesquite": lambda d: (
        d.weight, np.ones(d.N), d.diam1, d.diam2, d.canopy_height, d.total_height, d.density, d.group
    ),
    **{f"nes{year}-nes": _nes for year in range(1972, 2001, 4)},
    "sblrc-blr": lambda d: (d.y, *d.X.T),
    "sblri-blr": lambda d: (d.y, *d.X.T),
}  # fmt: skip


def _sizes(d):
    """Volume, area and shape of a canopy."""
    return d.diam1 * d.diam2 * d.canopy_height, d.diam1 * d.diam2, d.diam1 / d.diam2


def _given(posterior: str, d: SimpleNamespace) -> dict:
    """Priors by position among the parameters, of those that are not flat."""
    if posterior.startswith("kidiq-"):
        return {-1: HALF_CAUCHY}
    if posterior == "arK-arK":
        return dict.fromkeys(range(6), bs.priors.normal(0.0, 10.0)) | {-1: HALF_CAUCHY}
    if posterior.endswith("-blr"):
        return dict.fromkeys(range(5), bs.priors.normal(0.0, 10.0)) | {-1: stats.halfnorm(scale=10.0)}
    if posterior == "diamonds-diamonds":  # the half t of sigma is flat where sigma is, as this is
        slopes = dict.fromkeys(range(24), bs.priors.normal(0.0, 1.0))
        return slopes | {24: stats.t(3, 8.0, 10.0), -1: stats.halfnorm(scale=10.0)}
    if posterior.endswith("-kilpisjarvi"):
        return {0: bs.priors.normal(d.pmualpha, d.psalpha), 1: bs.priors.normal(d.pmubeta, d.psbeta)}
    return {}


def arma11(d: SimpleNamespace) -> Reference:
    """Innovations one after another."""

    def errors(p):
        mu, phi, theta, _ = p.T
        result = np.empty((len(p), len(d.y)))
        result[:, 0] = d.y[0] - mu - phi * mu
        for t in range(1, len(d.y)):
            result[:, t] = d.y[t] - mu - phi * d.y[t - 1] - theta * result[:, t - 1]
        return result

    sds = {"mu": 10.0, "phi": 2.0, "theta": 2.0}
    priors = {name: bs.priors.normal(0.0, sd) for name, sd in sds.items()} | {"sigma": HALF_CAUCHY}
    return Reference(bs.LeastSquaresModel(errors, priors, sd="sigma", vectorized=True))


def garch11(d: SimpleNamespace) -> Reference:
    """A variance that follows the squares; beta1 is a share of what alpha1 leaves."""

    def log_likelihood(p):
        mu, alpha0, alpha1, share = p.T
        beta1, variance = share * (1.0 - alpha1), np.full(len(p), d.sigma1**2)
        total = np.zeros(len(p))
        for t, y in enumerate(d.y):
            if t > 0:
                variance = alpha0 + alpha1 * (d.y[t - 1] - mu) ** 2 + beta1 * variance
            total -= 0.5 * (y - mu) ** 2 / variance + 0.5 * np.log(variance)
        return total

    priors = {"mu": bs.priors.normal(0.0, WIDE * np.std(d.y)), "alpha0": stats.halfnorm(scale=WIDE * np.var(d.y))}
    priors |= {"alpha1": stats.beta(1.0, 2.0), "share": stats.beta(1.0, 1.0)}
    reported = lambda p: np.column_stack([p[:, :3], p[:, 3] * (1.0 - p[:, 2])])  # noqa: E731
    return Reference(bs.DensityModel(log_likelihood, priors, vectorized=True), reported)


def eight_schools(d: SimpleNamespace) -> Reference:
    """Effects of schools by their own standard normal numbers."""
    effects = lambda p: p[:, -2:-1] + p[:, -1:] * p[:, :-2]  # noqa: E731
    priors = {f"theta_trans[{k}]": bs.priors.normal(0.0, 1.0) for k in range(1, d.J + 1)}
    priors |= {"mu": bs.priors.normal(0.0, 5.0), "tau": stats.halfcauchy(scale=5.0)}
    model = bs.LeastSquaresModel(lambda p: (effects(p) - d.y) / d.sigma, priors, vectorized=True)
    return Reference(model, lambda p: np.hstack([effects(p), p[:, -2:]]))


def _squared_exponential(d, rho, alpha):
    distances = (d.x[:, None] - d.x) ** 2
    rho, alpha = (np.clip(value, 1e-9, 1e9)[:, None, None] for value in (rho, alpha))  # where trajectories diverge
    return alpha**2 * np.exp(-0.5 * distances / rho**2)


GP_PRIORS = {"rho": stats.gamma(25.0, scale=0.25), "alpha": stats.halfnorm(scale=2.0)}


def gp_regr(d: SimpleNamespace) -> Reference:
    """A Gaussian process with noise of variance sigma, integrated out."""

    def log_likelihood(p):
        values, vectors = np.linalg.eigh(_squared_exponential(d, *p.T[:2]))
        variances = np.maximum(values, 0.0) + p[:, 2:]  # in which no rounding makes a negative one
        return -0.5 * np.sum((d.y @ vectors) ** 2 / variances + np.log(variances), axis=1)

    return Reference(bs.DensityModel(log_likelihood, GP_PRIORS | {"sigma": stats.halfnorm(scale=1.0)}, vectorized=True))


def gp_pois_regr(d: SimpleNamespace) -> Reference:
    """Counts of a Gaussian process, by deviance residuals; any root of the covariance gives the same process."""

    def process(p):
        values, vectors = np.linalg.eigh(_squared_exponential(d, *p.T[:2]))
        roots = np.sqrt(np.maximum(values, 0.0) + 1e-10)[:, :, None]
        return (vectors @ (roots * (vectors.transpose(0, 2, 1) @ p[:, 2:, None])))[..., 0]

    def residuals(p):
        f = process(p)
        off = f - np.log(d.k)  # exp(off) - 1 - off is convex and zero at zero
        return np.sign(off) * np.sqrt(2.0 * d.k * np.maximum(np.expm1(off) - off, 0.0))

    priors = GP_PRIORS | {f"f_tilde[{k}]": bs.priors.normal(0.0, 1.0) for k in range(1, d.N + 1)}
    model = bs.LeastSquaresModel(residuals, priors, vectorized=True)
    return Reference(model, lambda p: np.hstack([p[:, :2], process(p)]))


def runge_kutta(rates: Callable, state: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(len(times), ..) states at times from zero on, of a state (..) at zero; rates are of time and state."""
    result, t = [], 0.0
    for end in times:
        h = (end - t) / STEPS
        for k in range(STEPS):
            now = t + k * h
            k1 = rates(now, state)
            k2 = rates(now + 0.5 * h, state + 0.5 * h * k1)
            k3 = rates(now + 0.5 * h, state + 0.5 * h * k2)
            state = state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rates(now + h, state + h * k3))
        t = end
        result.append(state)
    return np.array(result)


def lotka_volterra(d: SimpleNamespace) -> Reference:
    """Hares and lynxes; the logarithms of both are followed and read."""
    logs = np.log(np.vstack([d.y_init, d.y]))

    def errors(p):
        a, b, c, e = p.T[:4]
        start = np.log(np.maximum(p.T[4:6], 1e-300))
        path = runge_kutta(lambda _, z: np.stack([a - b * np.exp(z[1]), e * np.exp(z[0]) - c]), start, d.ts)
        return np.hstack([(np.vstack([start[None], path])[:, k] - logs[:, k, None]).T for k in range(2)])

    theta = (stats.truncnorm(-2.0, np.inf, 1.0, 0.5), stats.truncnorm(-1.0, np.inf, 0.05, 0.05))
    priors = {f"theta[{k + 1}]": theta[k % 2] for k in range(4)}
    priors |= {f"z_init[{k}]": bs.priors.log_normal(10.0, 1.0) for k in (1, 2)}
    priors |= {f"sigma[{k}]": bs.priors.log_normal(np.exp(-1.0), 1.0) for k in (1, 2)}
    sds = [f"sigma[{k}]" for k in (1, 2) for _ in range(len(logs))]
    return Reference(bs.LeastSquaresModel(errors, priors, sd=sds, vectorized=True))


def one_compartment(d: SimpleNamespace) -> Reference:
    """A dose that is absorbed and eliminated; ``c = V_m / (K_m + 10)``, the rate at 10 mg/L, is what readings tell.

    With a prior of log c that is flat where c is, the prior of V_m is a factor ``V_m / (1 + V_m^2)``, or minus half the
    square of the last row, which is smooth.
    """

    def errors(p):
        k_a, k_m, rate, _ = p.T
        v_m = rate * (k_m + 10.0)

        def slope(t, c):
            return np.exp(-k_a * t) * d.D * k_a / d.V - v_m / d.V * c / (k_m + c)

        c = runge_kutta(slope, np.zeros(len(p)), d.times).T
        log_v = np.log(v_m)
        row = np.sign(log_v) * np.sqrt(2.0 * (np.logaddexp(log_v, -log_v) - np.log(2.0)))
        return np.column_stack([np.log(np.where(c > 0.0, c, np.nan)) - np.log(d.C_hat), row])

    priors = dict.fromkeys(("k_a", "K_m", "rate", "sigma"), stats.halfcauchy(scale=1.0))
    priors["rate"] = bs.priors.log_normal(0.08, 10.0)
    model = bs.LeastSquaresModel(errors, priors, sd=["sigma"] * len(d.times) + [None], vectorized=True)
    return Reference(model, lambda p: np.column_stack([p[:, :2], p[:, 2] * (p[:, 1] + 10.0), p[:, 3]]))


def two_normals(d: SimpleNamespace) -> Reference:
    """A mixture with ordered means, the second by its distance from the first."""

    def log_likelihood(p):
        first, gap, one, two, share = p.T[..., None]
        second = first + gap
        logs = np.log(share) - np.log(one) - 0.5 * ((d.y - first) / one) ** 2
        others = np.log1p(-share) - np.log(two) - 0.5 * ((d.y - second) / two) ** 2
        prior = -0.5 * (second[:, 0] / 2.0) ** 2 + 0.5 * (gap[:, 0] / 6.0) ** 2
        return np.logaddexp(logs, others).sum(axis=1) + prior

    priors = {"mu[1]": bs.priors.normal(0.0, 2.0), "gap": stats.halfnorm(scale=6.0)}
    priors |= dict.fromkeys(("sigma[1]", "sigma[2]"), stats.halfnorm(scale=2.0)) | {"theta": stats.beta(5.0, 5.0)}
    model = bs.DensityModel(log_likelihood, priors, vectorized=True)
    return Reference(model, lambda p: np.column_stack([p[:, 0], p[:, 0] + p[:, 1], p[:, 2:]]))


def hidden_states(emissions: Callable, priors: dict, alpha: np.ndarray, ordered: tuple) -> Reference:
    """Two hidden states that stay or change: `emissions` are log densities (n_times, n, 2) of parameters (n, ..).

    The first two parameters are how often the first state stays and the second changes; pairs that are `ordered` by
    their positions ascend.
    """

    def log_likelihood(p):
        ascending = np.all([p[:, k] < p[:, k + 1] for k in ordered], axis=0)
        chances = np.clip(p[:, :2].T, 1e-300, 1.0 - 1e-16)
        (stays, changes), (leaves, holds) = np.log(chances), np.log1p(-chances)
        of_states, *others = emissions(p[:, 2:])
        for now in others:
            first, second = of_states.T
            moved = np.logaddexp(first + stays, second + changes), np.logaddexp(first + leaves, second + holds)
            of_states = np.stack(moved, axis=1) + now
        return np.where(ascending, np.logaddexp(*of_states.T), -np.inf)

    of_chances = {f"theta{k + 1}[1]": stats.beta(*alpha[k]) for k in range(2)}
    model = bs.DensityModel(log_likelihood, of_chances | priors, vectorized=True)
    return Reference(model, lambda p: np.column_stack([p[:, 0], 1.0 - p[:, 0], p[:, 1], 1.0 - p[:, 1], p[:, 2:]]))


def _normal_logs(y, means, sd):
    """(n_times, n, 2) log densities of readings y (n_times,) about means (n, 2)."""
    return -0.5 * ((y[:, None, None] - means) / sd) ** 2


def hmm_example(d: SimpleNamespace) -> Reference:
    """Readings of sd one about either of two means."""
    priors = {"mu[1]": stats.truncnorm(-3.0, np.inf, 3.0, 1.0), "mu[2]": bs.priors.normal(10.0, 1.0)}
    return hidden_states(lambda p: _normal_logs(d.y, p, 1.0), priors, np.ones((2, 2)), (2,))


def drive_0(d: SimpleNamespace) -> Reference:
    """Exponential readings of two kinds."""

    def emissions(p):
        pairs = ((d.u, np.maximum(p[:, :2], 1e-300)), (d.v, np.maximum(p[:, 2:], 1e-300)))
        return sum(np.log(rates) - y[:, None, None] * rates for y, rates in pairs)

    of_each = stats.halfnorm(scale=1.0), stats.truncnorm(-3.0, np.inf, 3.0, 1.0)
    priors = {f"{name}[{k + 1}]": of_each[k] for name in ("phi", "lambda") for k in range(2)}
    return hidden_states(emissions, priors, d.alpha, (2, 4))


def drive_1(d: SimpleNamespace) -> Reference:
    """Normal readings of two kinds."""

    def emissions(p):
        return _normal_logs(d.u, p[:, :2], d.tau) + _normal_logs(d.v, p[:, 2:], d.rho)

    priors = {f"{n}[{k + 1}]": bs.priors.normal(3.0 * k, 1.0) for n in ("phi", "lambda") for k in range(2)}
    return hidden_states(emissions, priors, d.alpha, (2, 4))


OTHERS = {
    "arma11": arma11,
    "eight_schools_noncentered": eight_schools,
    "garch11": garch11,
    "gp_pois_regr": gp_pois_regr,
    "gp_regr": gp_regr,
    "hmm_drive_0": drive_0,
    "hmm_drive_1": drive_1,
    "hmm_example": hmm_example,
    "lotka_volterra": lotka_volterra,
    "low_dim_gauss_mix": two_normals,
    "one_comp_mm_elim_abs": one_compartment,
}

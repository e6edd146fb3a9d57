"""What the page of a report draws by itself, as compact JSON: intervals, correlations, draws, tracks, residuals."""

import base64
from collections.abc import Iterator
from functools import partial

import numpy as np

from bayesub.findings import run_numbers
from bayesub.findings.derived import significant
from bayesub.findings.results import Results
from bayesub.io.words import with_unit
from bayesub.report.figures import TRACKS
from bayesub.report.plots import coefficients, trade_offs
from bayesub.report.plots.track import STRAIGHT, X, Y, Z, axis_label

DRAWS, NUMBERS = 400, 16_000  # of the posterior, in the scatter of a pair, and their numbers, at most
READINGS = 30_000  # of all trials; of more, every second, third ..
PLACES = 250  # points of a track
_rounded = partial(significant, digits=7)


def content(results: Results, reference: np.ndarray, word: str) -> dict:
    """What the scripts of a page read.

    `reference` (n_others,): values that ratios refer to, histories of forces left out; `word`: what they are.
    """
    intervals, trials = _intervals(results, reference), list(_trials(results, synthetic=word == "truth"))
    return {"word": word, "intervals": intervals, "pairs": _pairs(results, reference, word), "trials": trials}


def pack(values: np.ndarray, kind: str = "u2") -> dict:
    """Values (n,) as unsigned integers of a `kind`, from the least to the largest, in base64; the last code is nan.

    An error of rounding is at most the range over 131,068, or with ``u4`` over 8.6e9.
    """
    values = np.asarray(values, dtype=float)
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
    most = 2 ** (8 * np.dtype(kind).itemsize) - 2
    step = (high - low) / most or 1.0
    codes = np.where(np.isfinite(values), np.rint((np.nan_to_num(values) - low) / step), most + 1)
    text = base64.b64encode(codes.astype(f"<{kind}").tobytes()).decode("ascii")
    return {"low": float(low), "step": float(step), "kind": kind, "codes": text}


def _intervals(results, reference) -> dict:
    """A row for each parameter, and what the searches found of the coefficients; a reference is None without ratios."""
    sample, n = results.summary, results.problem.n_coefficients
    prior = np.transpose([results.prior_of_others.quantiles(p) for p in coefficients.PRIOR_EDGES])
    values = map(_rounded, (reference, prior, sample.quantiles(coefficients.QUANTILES).T))
    rows = [
        {"name": name, "reference": one if k < n and one else None, "value": one, "prior": ends, "posterior": found}
        for k, (name, one, ends, found) in enumerate(zip(sample.names, *values, strict=True))
    ]
    found = ((e.method, e.solutions[:, [e.names.index(name) for name in sample.names[:n]]]) for e in results.estimates)
    return {"rows": rows, "sets": [{"method": method, "values": _rounded(values.T)} for method, values in found]}


def _pairs(results, reference, word: str) -> dict:
    """Correlations in hundredths below the diagonal, and some draws of every parameter, ratios where there are some."""
    problem, sample = results.problem, results.summary
    divisors = run_numbers.ratio_divisors(problem)
    is_ratio = (np.arange(len(sample.names)) < problem.n_coefficients) & (reference != 0.0)
    n_draws = min(DRAWS, NUMBERS // len(sample.names), len(sample.draws))
    some = np.linspace(0, len(sample.draws) - 1, n_draws).astype(int)
    prior = np.transpose([results.prior_of_others.quantiles(p) for p in coefficients.PRIOR_EDGES]) / divisors[:, None]
    strong, _ = trade_offs.strong_block(sample.names, results.correlation)
    rows, columns = np.tril_indices(len(sample.names), -1)
    own = {t.name: f"{t.name} ({t.unit})" if t.unit else t.name for t in problem.equations.terms}
    return {
        "names": list(sample.names),
        "labels": [
            f"{name} / {word}" if ratio else own.get(name) or with_unit(name)
            for name, ratio in zip(sample.names, is_ratio, strict=True)
        ],
        "strong": [sample.names.index(name) for name in strong],
        "hundredths": np.rint(100 * results.correlation[rows, columns]).astype(int).tolist(),
        "reference": _rounded(reference / divisors),
        "prior": _rounded(np.sort(prior)),
        "draws": [pack(values) for values in (sample.draws[some] / divisors).T],
    }


def _trials(results, *, synthetic: bool) -> Iterator[dict]:
    """Track and residuals of each trial; of very many readings every second, third and so on."""
    stride = -(-len(results.problem.readings) // READINGS)
    for name, problem, draws in results.problem.each_trial(results.draws):
        record, predicted = problem.record, problem.predicted(draws)
        readings, states = problem.truth() if synthetic else (None, None)
        channels = [_channel(c, predicted, readings, problem.rows[c.name], stride) for c in record.channels]
        path = _path(record, problem.motion(draws[:TRACKS]), states)
        yield {"figure": f"track_{name}" if name else "track", "stride": stride, "channels": channels, "path": path}


def _channel(channel, predicted, truth, part, stride: int) -> dict:
    """Readings minus posterior mean, the posterior's own band and the truth, in the unit of the axis."""
    label, factor = axis_label(channel)
    predicted = factor * predicted[:, part][:, ::stride]
    centre = predicted.mean(axis=0)
    low, high = np.quantile(predicted - centre, [0.05, 0.95], axis=0)
    lines = {"residual": factor * channel.values[::stride] - centre, "low": low, "high": high}
    if truth is not None:
        lines["truth"] = factor * truth[part][::stride] - centre
    times, packed = pack(channel.times[::stride], "u4"), {name: pack(values) for name, values in lines.items()}
    return {"label": label, "sd": float(factor * channel.total_sd), "times": times, "lines": packed}


def _path(record, tracks, truth) -> dict:
    """The track from above, of a boat that does not turn its depth against the way north."""
    above = np.ptp(tracks[0, :, Y]) > STRAIGHT * np.ptp(tracks[0, :, X])
    across, up, names = (Y, X, ("east (m)", "north (m)")) if above else (X, Z, ("north (m)", "depth (m)"))
    some = np.linspace(0, tracks.shape[1] - 1, min(PLACES, tracks.shape[1])).astype(int)
    by_state = {channel.state: channel for channel in record.channels}
    wanted = ("y", "x") if above else ("x", "z")
    readings = None
    if set(wanted) <= by_state.keys():
        _, *both = np.intersect1d(*(by_state[state].times for state in wanted), return_indices=True)
        readings = [pack(by_state[s].values[k]) for s, k in zip(wanted, both, strict=True)]
    return {
        "labels": names,
        "downwards": not above,
        "draws": [[pack(track[some, column]) for column in (across, up)] for track in tracks],
        "readings": readings,
        "truth": None if truth is None else [pack(truth[some, column]) for column in (across, up)],
    }

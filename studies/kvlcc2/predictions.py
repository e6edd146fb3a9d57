"""What coefficients predict of a run from its rudder and its start: errors, bands, and turning circles."""

from dataclasses import dataclass

import numpy as np

import bayesub as bs
from kvlcc2 import circles
from kvlcc2.trials import ZERO, Tanker

N_DRAWS, LEVELS = 500, (50, 90)
# Sds of unmodelled forces of a flight, non-dimensional: 2 % of the resistance, and of force and moment of the rudder
# hard over; and how long they stay alike.
FORCES = {"X": 3.8e-5, "Y": 3.3e-5, "N": 1.6e-5}
FORCE_TIME_S, FORCE_KNOTS_S = 60.0, 30.0
CIRCLE_S, CIRCLE_READING_S = 90.0, 0.4  # of a circle, enough for 180 degrees; between its positions


def unmodelled() -> bs.UnknownDisturbance:
    """The forces that the equations leave out."""
    return bs.UnknownDisturbance(tuple(FORCES), FORCES, FORCE_TIME_S, "matern_3_2", FORCE_KNOTS_S)


@dataclass(frozen=True)
class Known:
    """Coefficients, and parameters of single runs, by a method: values and, if it has intervals, draws.

    Attributes
    ----------
    names : parameters
    values : (n_params,)
    draws : (n, n_params), or None
    with_unknowns : whether what is of the run alone, its rudder zero and unmodelled forces, is drawn from the prior
    """

    names: tuple[str, ...]
    values: np.ndarray
    draws: np.ndarray | None = None
    with_unknowns: bool = False

    @classmethod
    def of_estimate(cls, content: dict, rng: np.random.Generator, *, with_unknowns: bool = False) -> "Known":
        """Of an estimate as JSON types, with normal draws if it has a covariance."""
        values, covariance = np.array(content["solutions"][0]), content.get("covariance")
        draws = None if covariance is None else np.tile(values, (N_DRAWS, 1))
        if draws is not None:  # of what was not fitted, which comes last, nothing is uncertain
            n = len(covariance)
            draws[:, :n] = rng.multivariate_normal(values[:n], covariance, N_DRAWS, method="eigh")
        return cls(tuple(content["names"]), values, draws, with_unknowns)

    def parameters(self, problem: bs.Problem, name: str, rng: np.random.Generator) -> np.ndarray:
        """(1 + n, n_params) parameters of a problem of the run of that name: by the values, and by the draws."""
        middle = problem.prior.mean.copy()
        histories = np.array([parameter.startswith("disturbance_") for parameter in problem.names])
        middle[histories] = 0.0
        n = 0 if self.draws is None else len(self.draws)
        members = np.repeat(middle[None], 1 + n, axis=0)
        if self.with_unknowns and n:
            members[1:] = problem.prior.sample(rng, n)
        for k, parameter in enumerate(problem.names):
            source = next((s for s in (parameter, f"{parameter}[{name}]") if s in self.names), None)
            if source is not None and not histories[k]:
                place = self.names.index(source)
                members[0, k] = self.values[place]
                if n:
                    members[1:, k] = self.draws[:, place]
        return members


def of_run(tanker: Tanker, name: str, known: dict[str, Known], seed: int) -> tuple[dict, dict]:
    """Errors and coverage of each method on a run, and arrays of headings: readings, band and means."""
    problem = tanker.problem(name, unmodelled())
    rows, readings = problem.rows, problem.readings
    result: dict = {"duration_s": float(problem.duration), "errors": {}, "coverage": {}, "half_width_deg": {}}
    headings = [readings[rows["yaw"]]]
    for method, one in known.items():
        rng = np.random.default_rng(seed)
        members = one.parameters(problem, name, rng)
        flights = problem.predicted(members)
        point, flights = flights[0], flights[1:][np.isfinite(flights[1:]).all(axis=1)]
        if len(members) > 1:
            result.setdefault("failed", {})[method] = len(members) - 1 - len(flights)
        if len(flights):
            noisy = flights + problem.sds * rng.standard_normal(flights.shape)
            bands = {level: np.percentile(noisy, [50 - level / 2, 50 + level / 2], axis=0) for level in LEVELS}
            inside = {level: (low <= readings) & (readings <= high) for level, (low, high) in bands.items()}
            result["coverage"][method] = {str(level): float(part.mean()) for level, part in inside.items()}
        if one.with_unknowns:  # beside what the mean of the coefficients predicts, the mean of what is predicted
            result["errors"][f"{method}, mean of flights"] = errors(problem, flights.mean(axis=0))
            headings += list(bands[90][:, rows["yaw"]])
        result["errors"][method] = errors(problem, point)
        headings.append(point[rows["yaw"]])
    arrays = {f"{name} times": problem.channels["yaw"][0].times}
    arrays[f"{name} headings"] = np.degrees(np.stack(headings)).astype(np.float32)
    return result, arrays


def errors(problem: bs.Problem, track: np.ndarray) -> dict:
    """Root mean squares of heading and position of readings (n_readings,); None if they ended early."""
    if not np.isfinite(track).all():
        return {"heading_deg": None, "track_m": None}
    rows, off = problem.rows, track - problem.readings
    heading = np.degrees(np.sqrt(np.mean(off[rows["yaw"]] ** 2)))
    position = np.sqrt(np.mean(off[rows["x"]] ** 2 + off[rows["y"]] ** 2))
    return {"heading_deg": float(heading), "track_m": float(position)}


def best_zero(tanker: Tanker, name: str, known: Known) -> dict:
    """The rudder zero with which the values follow a run best, and what a tenth of a degree does."""
    problem = tanker.problem(name)
    values = known.parameters(problem, name, np.random.default_rng(0))[0]
    k, yaw = problem.names.index(ZERO), problem.rows["yaw"]
    zeros = np.linspace(-3.0, 3.0, 241)
    batch = np.repeat(values[None], len(zeros), axis=0)
    batch[:, k] = zeros
    off = problem.predicted(batch)[:, yaw] - problem.readings[yaw]
    rms = np.degrees(np.sqrt(np.mean(off**2, axis=1)))
    best = int(np.nanargmin(rms))
    moved = np.degrees(np.sqrt(np.mean((off[best] - off[best - 4 if best > 120 else best + 4]) ** 2)))
    return {"zero_deg": float(zeros[best]), "heading_deg": float(rms[best]), "by_tenth_deg": float(moved)}


def of_circle(tanker: Tanker, name: str, side: str, known: dict[str, Known], seed: int) -> dict:
    """Advance and diameter of a circle: of the test, as published, and by each method with its 90 % interval."""
    problem = tanker.problem(name, unmodelled(), CIRCLE_READING_S).truncated(CIRCLE_S)
    test = circles.of_log(tanker.log(name))
    result: dict = {
        key: {"test": test[key], "published": dict(zip(("test", "predicted"), pair, strict=True)), "methods": {}}
        for key, pair in circles.PUBLISHED[side].items()
    }
    for method, one in known.items():
        members = one.parameters(problem, name, np.random.default_rng(seed))
        motions = problem.motion(members)
        measures = [_measures(motion) for motion in motions]
        for key, content in result.items():
            point, *draws = (measure[key] for measure in measures)
            kept = [value for value in draws if np.isfinite(value)]
            numbers = {"value": point if np.isfinite(point) else None}
            if kept:
                low, high = np.percentile(kept, [5.0, 95.0])
                numbers |= {"low": float(low), "high": float(high)}
            content["methods"][method] = numbers
            if one.with_unknowns and kept:
                content |= {method: numbers["value"], "low": numbers["low"], "high": numbers["high"]}
    return result


def _measures(motion):
    if not np.isfinite(motion).all():
        return dict.fromkeys(circles.MEASURES, np.nan)
    return circles.measured(motion[:, 0], motion[:, 1], np.degrees(np.unwrap(motion[:, 5])))

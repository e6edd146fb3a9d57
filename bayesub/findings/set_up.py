"""What was done, for the box at the top of a report: boat, manoeuvre, sensors, prior, equations, disturbances."""

from dataclasses import fields

import numpy as np

from bayesub.io.words import powers, with_unit
from bayesub.logs import log_files
from bayesub.problem.distributions import WHITE, LogNormal, Normal, Prior, Uniform
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import UnknownSd
from bayesub.problem.noise import Noise
from bayesub.problem.priors import CoefficientPrior, Given, Spread
from bayesub.problem.problem import Problem
from bayesub.sensors.record import Channel

AnyProblem = Problem | JointProblem


def rows(problem: AnyProblem) -> dict[str, str]:
    """The rows of the box that a problem has by itself: title -> text."""
    trials = {name: trial for name, trial, _ in problem.each_trial(problem.prior.mean)}
    first, vehicle = next(iter(trials.values())), problem.vehicle
    equations, one = problem.equations, len(trials) == 1
    described = vehicle.description.rstrip(".")
    plane = f"{first.simulator.subproblem} plane only" if first.simulator.subproblem else "all six degrees of freedom"
    step = max(trial.simulator.step for trial in trials.values())
    unknowns = {name: prior for name, prior in problem.nuisance_priors.items() if prior is not WHITE}  # no histories
    histories = {name: [one.disturbances.knots for one in trial.histories] for name, trial in trials.items()}
    forces = {
        name: "; ".join(f"unknown histories on {', '.join(one.axes)}, {len(one.times)} knots each" for one in some)
        for name, some in histories.items()
    }
    result = {
        "vehicle": f"{vehicle.name}{f' ({described})' if described else ''}: {vehicle.length_m:.4g} m long, "
        f"{vehicle.speed_mps:.3g} m/s at the start, water of {vehicle.water_density_kgm3:.5g} kg/m³",
        "manoeuvre" if one else "manoeuvres": "; ".join(_manoeuvre(*item) for item in trials.items()),
        "sensors": "; ".join(_by_trial({name: _sensors(trial) for name, trial in trials.items()})),
        "truth": _truth(trials),
        "prior": _prior(first.spread, problem),
        "other unknowns": "; ".join(f"{with_unit(name)}: {_distribution(prior)}" for name, prior in unknowns.items()),
        "equations": f"{equations.name}, {len(equations.names)} terms, {problem.n_coefficients} free, {plane}; "
        f"integrated in steps of {step:.3g} s",
        "disturbances": "; ".join(_by_trial({name: text or "none inferred" for name, text in forces.items()})),
    }
    return {title: text for title, text in result.items() if text}


def noise_sds(problem: AnyProblem, parameters: np.ndarray) -> dict[str, float]:
    """Channel, as in `problem.channels` -> sd of its noise with rounding, SI units, at parameters (n_params,).

    Of noise whose sd is integrated out it is the root mean square of the errors there.
    """
    sds = {}
    for name, trial, values in problem.each_trial(parameters):
        for one in trial.likelihood.each(trial.arguments(values[None])[1]):
            if isinstance(one.model, UnknownSd):
                errors = trial.predicted(values[None])[0] - trial.readings
                sd = np.sqrt(np.mean(errors[one.part] ** 2))
            else:
                sd = np.hypot(getattr(one.members, "sd", 0.0), getattr(one.model, "resolution", 0.0) / np.sqrt(12.0))
            sds[f"{one.name}[{name}]" if name else one.name] = float(np.squeeze(sd))
    return sds


def _by_trial(texts: dict[str, str]) -> list[str]:
    """One text where it is that of all trials, otherwise each after the name of its trial."""
    if len(set(texts.values())) == 1:
        return [next(iter(texts.values()))]
    return [f"{name}: {text}" for name, text in texts.items()]


def _manoeuvre(name: str, trial) -> str:
    kind = "simulated" if trial.record.truth is not None else "a log"
    return f"{f'{name}: ' if name else ''}{trial.manoeuvre.name} ({kind}), {trial.manoeuvre.duration:.4g} s"


def _sensors(trial) -> str:
    """The channels of a trial; those alike but for their names together."""
    groups: dict[str, list[str]] = {}
    for channel, noise in trial.channels.values():
        groups.setdefault(_noise(channel, noise) + _interval(channel), []).append(_column(channel))
    return "; ".join(f"{', '.join(names)}: {text}" for text, names in groups.items())


def _column(channel: Channel) -> str:
    return with_unit(log_files.HEADERS[channel.quantity]).partition(" (")[0]


def _noise(channel: Channel, noise: Noise) -> str:
    """The noise of a channel as it is modelled, in the unit of its column."""
    header = log_files.HEADERS[channel.quantity]
    unit, factor = with_unit(header).partition("(")[2].rstrip(")"), 1.0 / log_files.si_factor(header)
    values = {field.name: getattr(noise, field.name) for field in fields(noise)}  # type: ignore[arg-type]  # all are dataclasses
    parts = [noise.words] if noise.words else []
    if "sd" in values:
        parts.append(f"sd {factor * values['sd']:.3g} {unit}".rstrip())
    if values.get("resolution"):
        parts.append(f"rounded to {factor * values['resolution']:.3g} {unit}".rstrip())
    if "dof" in values:
        parts.append(f"{values['dof']:.3g} degrees of freedom")
    if "correlation_time_s" in values:
        parts.append(f"correlation time {values['correlation_time_s']:.3g} s")
    return ", ".join(parts) or type(noise).__name__


def _interval(channel: Channel) -> str:
    """How often a channel reads: intervals that are not all the same by their median."""
    n, intervals = len(channel.times), np.diff(channel.times)
    if not len(intervals):
        return ", one reading"
    about = "" if np.allclose(intervals, np.median(intervals), rtol=0.01) else "about "
    return f", {n} readings, {about}every {np.median(intervals):.3g} s"


def _truth(trials: dict) -> str:
    """Current and forces of a simulated truth that are not in the vehicle file."""
    if any(trial.record.truth is None for trial in trials.values()):
        return ""
    texts = {}
    for name, trial in trials.items():
        idle = trial.vehicle.idle(trial.simulator.subproblem)
        flown = np.array([key not in idle for key in trial.equations.names])
        others = (trial.record.truth != trial.vehicle.xi)[flown].any()
        parts = [f"coefficients {'other than those of' if others else 'of'} the vehicle file"]
        off = {key: value for key, value in trial.record.nuisances.items() if value and not key.startswith("sd_")}
        parts += [f"{with_unit(key)} {value:.3g}" for key, value in off.items()]
        if trial.record.forces is not None:
            parts.append(f"random forces on {', '.join(trial.record.forces.axes)}")
        texts[name] = ", ".join(parts)
    return "; ".join(_by_trial(texts))


def _prior(spread: CoefficientPrior, problem) -> str:
    """The prior of the coefficients, and how far its centre is from the reference."""
    if isinstance(spread, Given):
        given = [name for name in problem.names[: problem.n_coefficients] if name in spread.priors]
        rest = problem.n_coefficients - len(given)
        others = f"; {_spread(spread.others)} for the other {rest}" if rest else ""
        return f"given one by one for {len(given)} coefficients{others}"
    guess, reference = problem.coefficient_prior.guess, problem.reference[: problem.n_coefficients]
    off = np.abs(guess / reference - 1.0) if reference.all() else np.array([np.nan])
    trials = [trial for _, trial, _ in problem.each_trial(problem.prior.mean)]
    word = "truth" if all(trial.record.truth is not None for trial in trials) else "vehicle file"
    about = f"about the {word}" if not off.any() else f"about a guess that is off the {word} by up to"
    if off.any():
        about += f" {100.0 * off.max():.2g} % (median {100.0 * np.median(off):.2g} %)"
    return f"{_spread(spread)} {about}" if np.isfinite(off).all() else _spread(spread)


def _spread(spread: CoefficientPrior) -> str:
    assert isinstance(spread, Spread)  # the other kind is given one by one
    size, each = f"{100.0 * spread.spread:.3g} %", "for each axis" if spread.by_axis else "for all"
    kinds = {
        "uniform": f"uniform within {size}",
        "log-normal": f"log-normal with an sd of {size}",
        "hierarchical": f"log-normal with an unknown sd near {size}, one {each},",
    }
    return kinds.get(spread.kind, f"normal with an sd of {size}")


def _distribution(prior: Prior) -> str:
    """A prior of one parameter."""
    if isinstance(prior, Uniform):
        return f"{prior.lower[0]:.4g} to {prior.upper[0]:.4g}, uniform"
    if isinstance(prior, LogNormal):
        return f"{prior.median[0]:.4g}, log-normal with an sd of {100.0 * prior.log_sd[0]:.3g} %"
    return f"{prior.mean[0]:.4g} ± {prior.sd[0]:.3g}{', normal' if isinstance(prior, Normal) else ''}"


def dimensional(problem: AnyProblem) -> list[dict]:
    """Of each free coefficient the ``factor`` that makes it dimensional, SI, and the ``si_unit`` that it then has."""
    factors, names = problem.vehicle.dimensional_factors[problem.columns], problem.names[: problem.n_coefficients]
    units = [powers(problem.equations.unit(name)) for name in names]
    return [{"si_factor": factor, "si_unit": unit} for factor, unit in zip(factors.tolist(), units, strict=True)]

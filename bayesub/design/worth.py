"""What each part of a trial brings: its minutes, its sensors, further sensors, and values from a towing tank.

All are taken at the coefficients of the vehicle, from the derivatives of one flight as far as that goes. A value from a
towing tank with the variance s^2 changes their covariance C to ``C - c c' / (C_kk + s^2)``, c its column.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from bayesub.design.information import Information
from bayesub.design.judge import Judge, Sensed
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.problem.nuisance import ON_READINGS
from bayesub.sensors import flat
from bayesub.sensors.sensor import Sensor, channel_name

WIDEST = 1e6  # of a bracket about the sd that half of the gain takes, over the sd that the coefficient has


def by_minute(judge: Judge, manoeuvre: Manoeuvre, minutes: Iterable[float]) -> dict[float, Information]:
    """Minutes -> what the trial would have determined had it ended then."""
    sensed = _sensed(judge, manoeuvre)
    return {minute: sensed.information(sensed.times <= 60.0 * minute)[0] for minute in minutes}


def by_sensor(judge: Judge, manoeuvre: Manoeuvre) -> dict[str, Information]:
    """Channel -> what the trial determines without it."""
    sensed = _sensed(judge, manoeuvre)
    places = np.arange(len(sensed.times))
    return {c: sensed.information(~np.isin(places, places[rows]))[0] for c, rows in sensed.rows.items()}


def further_sensors(
    judge: Judge, manoeuvre: Manoeuvre, extra: Mapping[str, Sensor | Iterable[Sensor]]
) -> dict[str, Information]:
    """Name -> what the trial determines with a further sensor, or instrument, where and when the present one reads."""
    step = judge.step_s or judge.accurate_step(manoeuvre)
    worth, present = {}, {channel_name(sensor.quantity): sensor for sensor in judge.sensors}
    unknown = judge.problem(manoeuvre, step).forward.nuisances.parameters
    of_noise = {one.name: one.channel for one in unknown if one.attribute not in ("", *ON_READINGS)}
    for name, sensors in extra.items():
        added = {channel_name(sensor.quantity): sensor for sensor in flat([sensors])}
        for channel, new in added.items():
            if (old := present.get(channel)) is not None:
                added[channel] = replace(old, column=new.column, sd=new.sd, resolution=new.resolution)
        noise = {channel: one for channel, one in judge.noise.items() if channel not in added}
        nuisance = {one: prior for one, prior in judge.nuisance.items() if of_noise.get(one) not in added}
        sensors = tuple((present | added).values())
        better = replace(judge, sensors=sensors, noise=noise, nuisance=nuisance, draws=None)
        (worth[name],) = Sensed(better, manoeuvre, step).information()
    return worth


def _sensed(judge: Judge, manoeuvre: Manoeuvre) -> Sensed:
    judge = replace(judge, draws=None)
    return Sensed(judge, manoeuvre, judge.step_s or judge.accurate_step(manoeuvre))


@dataclass(frozen=True)
class TankValue:
    """One coefficient measured in a towing tank, after those before it."""

    name: str  # of the coefficient
    gain: float  # mean over the other coefficients of the logarithm of the sd before over the sd after
    information: Information  # of the trial, this value and those before it
    n_known: int  # coefficients known to the share that was asked for
    half_gain_sd: float  # relative sd of the value with which the gain is half of that of an exact one


def unlocking(information: Information, relative_sd: float, n: int, *, share: float = 0.1) -> list[TankValue]:
    """The `n` values that unlock most, greedily: each is the one with the largest gain after those before it.

    They are measured to a relative sd; a coefficient counts as known to a share of its value.
    """
    left = np.flatnonzero(information.values).tolist()  # what is zero has no relative sd
    values: list[TankValue] = []
    while left and len(values) < n:
        sds = relative_sd * np.abs(information.values) / information.prior_sd
        gains = {k: gain(information.covariance, k, sds[k]) for k in left}
        k = max(gains, key=gains.__getitem__)
        half = _half_gain(information, k)
        information = information.with_known([k], relative_sd)
        values.append(TankValue(information.names[k], gains[k], information, information.n_known(share), half))
        left.remove(k)
    return values


def gain(covariance: np.ndarray, k: int, sd: float) -> float:
    """Mean logarithm of the sds of all but coefficient k, before over after k is measured with an sd."""
    variances = np.diag(covariance)
    shares = covariance[k] ** 2 / (variances * (variances[k] + sd**2))
    return float(-0.5 * np.mean(np.log1p(-np.minimum(np.delete(shares, k), 1.0 - 1e-12))))


def _half_gain(information: Information, k: int) -> float:
    covariance = information.covariance
    wanted, scale = 0.5 * gain(covariance, k, 0.0), np.sqrt(covariance[k, k])
    if not wanted > 0.0:
        return float("inf")
    ends = scale / WIDEST, scale * WIDEST
    excess = [gain(covariance, k, sd) - wanted for sd in ends]
    if excess[0] <= 0.0 or excess[1] >= 0.0:
        return float("nan")
    sd = optimize.brentq(lambda log_sd: gain(covariance, k, np.exp(log_sd)) - wanted, *np.log(ends))
    return float(np.exp(sd) * information.prior_sd[k] / abs(information.values[k]))

"""What options, minutes, sensors and towing-tank values bring to a trial of suboff, beside its best manoeuvre."""

from collections.abc import Sequence

import numpy as np

from bayesub.design.information import Information
from bayesub.design.judge import Judge
from bayesub.design.worth import by_minute, by_sensor, further_sensors, unlocking
from bayesub.sensors import DVL, INS, Pressure, Sensor, Track
from richest import options
from richest.appraisal import SHARE, appraiser_of

OPTION_STEP_S = 4.0  # of suboff, with which options are compared
TANK_SD, N_TANK = 0.02, 12  # relative, of a value from a towing tank
EXTRA: dict[str, Sensor | tuple] = {
    "position to 0.5 m": Track(0.5, 0.1, 1.0, channels=("x", "y", "z")),
    "heading to 0.05 deg": Sensor("yaw_deg", 0.05, interval_s=1.0),
    "accelerometers, 1 mm/s²": INS(sd_mps2=1e-3, channels=("udot", "vdot", "wdot")),
    "angular accelerations, 0.01 deg/s²": INS(sd_degps2=0.01, channels=("pdot", "qdot", "rdot")),
    "gyros ten times better": INS(sd_degps=0.001, channels=("p", "q", "r")),
    "attitude ten times better": INS(sd_deg=0.005, channels=("roll", "pitch", "yaw")),
    "Doppler log ten times better": DVL(sd_mps=0.0005),
    "depth ten times better": Pressure(sd_m=0.01),
}


def option(names: Sequence[str], seed: int, n_judgements: int, k: int) -> dict:
    """What a search finds with the k-th of some options, as JSON types."""
    name = names[k]
    cost, result = options.best(name, seed, n_judgements, OPTION_STEP_S)
    manoeuvres = cost.manoeuvres(np.asarray(result.numbers))
    information = [cost.judge.information(m)[0] for m in manoeuvres]
    within = all(cost.range.penalty(cost.range.margins(m)) == 0.0 for m in manoeuvres)
    return {"name": name, "cost": round(result.cost, 3), "within": within} | counts(
        sum(information[1:], information[0])
    )


def counts(information: Information) -> dict:
    """How much is known, as JSON types."""
    return {
        "n_coefficients": len(information.names),
        "n_known": information.n_known(SHARE),
        "n_sharper": information.n_sharper,
        "d": round(float(information.d_optimality), 4),
    }


def worth(vehicle: str, sensors: str, spec: dict) -> dict:
    """What each minute, each sensor, further sensors and values from a towing tank bring to one manoeuvre."""
    appraiser = appraiser_of(vehicle)
    manoeuvre = appraiser.manoeuvre(spec)
    judge = Judge(appraiser.boat, appraiser.sensors[sensors], step_s=appraiser.accurate_step(manoeuvre))
    (whole,) = judge.information(manoeuvre)
    minutes = np.linspace(0.1, 1.0, 10) * manoeuvre.duration / 60.0
    return {
        "whole": counts(whole),
        "minutes": {f"{m:.3g}": counts(i) for m, i in by_minute(judge, manoeuvre, minutes).items()},
        "without": {name: counts(w) for name, w in by_sensor(judge, manoeuvre).items()},
        "further": {name: counts(i) for name, i in further_sensors(judge, manoeuvre, EXTRA).items()},
        "tank": [
            {"name": v.name, "n_known": v.n_known, "half_gain_sd": float(f"{v.half_gain_sd:.3g}")}
            for v in unlocking(whole, TANK_SD, N_TANK, share=SHARE)
        ],
    }

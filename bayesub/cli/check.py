"""The command `check`: what an input file is, and the card of a vehicle or of the data of a study."""

import time
from pathlib import Path

import numpy as np

from bayesub.cli.run import prepared
from bayesub.io import log_files, toml_files
from bayesub.io.errors import InputError, error_source
from bayesub.model.hulls import load_hull
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.model.vehicles import load_vehicle
from bayesub.report import data_card, vehicle_card, vehicle_lines
from bayesub.sensors import flat
from bayesub.study import script, study
from bayesub.study.trial_section import read_instruments

Card = vehicle_card.Card | data_card.DataCard


def checked(path: Path) -> tuple[str, Card | None]:
    """What a file is, and the card of a vehicle or of the data of a study."""
    if path.suffix == ".py" or path.suffix.lower() == ".csv":
        return _described(path), None
    keys = toml_files.read_toml_table(path)
    if "coefficients" in keys:
        boat = load_vehicle(path)
        used = int((boat.xi != 0).sum())
        size = f"{boat.length_m:g} m at {boat.speed_mps:g} m/s"
        known = int(np.isfinite(boat.sd).sum())
        told = f", {known} with a standard deviation" if known else ""
        text = f"vehicle '{boat.name}', {size}, {used} of 101 coefficients not zero{told}"
        return text, vehicle_card.check(boat)
    if "vehicle" in keys:
        setup = prepared(path, study.load_study(path))
        return _cost(setup), _data_card(path, setup)
    return _described(path), None


def _data_card(path: Path, setup: study.Setup) -> data_card.DataCard | None:
    """The card of the data of a study; None if the boat of the prior means does not complete the trials."""
    problem = setup.problem
    if not np.isfinite(problem.predicted(problem.prior.mean)).all():
        return None
    with error_source(str(path)):
        return data_card.check(problem, f"{setup.study.name}: {setup.vehicle.name}")


def _described(path: Path) -> str:
    if path.suffix == ".py":
        return f"study script: {script.question(path)}"
    if path.suffix.lower() == ".csv":
        log = log_files.read_log(path)
        times = log["time"]
        columns = ", ".join(log_files.HEADERS[name] for name in log)
        return f"log of {len(times)} rows from {times[0]:g} to {times[-1]:g} s with {columns}"
    keys = toml_files.read_toml_table(path)
    if "hull" in keys:
        hull = load_hull(path)
        return f"geometry of a hull of {hull.file.hull.length_m:g} m that displaces {hull.mass_kg:.4g} kg"
    if "kind" in keys:
        file = read_manoeuvre(path)
        return f"manoeuvre '{file.name}' of kind {file.kind}, {file.duration_s:g} s"
    if "sensors" in keys:
        channels = flat([section.build() for section in read_instruments(path).sensors])
        return f"instruments that read {', '.join(sensor.column for sensor in channels)}"
    raise InputError(
        f"{path}: is neither a vehicle (no 'coefficients'), a geometry (no 'hull'), a manoeuvre (no 'kind'), a study "
        "(no 'vehicle') nor instruments (no 'sensors')"
    )


def _cost(setup: study.Setup) -> str:
    """Time a batch, and count on what the sampler usually needs."""
    problem = setup.problem
    batch = np.repeat(problem.prior.mean[None], 64, axis=0)
    problem.log_prob(batch)  # compiles
    began = time.perf_counter()
    for _ in range(4):
        problem.log_prob(batch)
    rate = 4 * len(batch) / (time.perf_counter() - began)
    trials = problem.each_trial(problem.prior.mean)
    told = "; ".join(_trial(name, p, setup.trials[name], centre) for name, p, centre in trials)
    return (
        f"study '{setup.study.name}': {setup.vehicle.name}, {told}; "
        f"{rate:.0f} log posteriors a second, so a million take {1e6 / rate:.0f} s"
    )


def _trial(name: str, problem, trial, centre) -> str:
    """A trial of a study in words, and whether it is possible at the prior means (n_params,)."""
    besides = problem.n_params - problem.n_coefficients
    unknown = f"{problem.n_coefficients} free coefficients" + (f" and {besides} other parameters" if besides else "")
    left_out = f" ({trial.n_left_out} outside the controls left out)" if trial.n_left_out else ""
    return (
        f"{f'{name}: ' if name else ''}{trial.manoeuvre.name}, {unknown}, {len(problem.readings)} readings{left_out}, "
        f"step {problem.simulator.step:g} s{_failure(problem, centre)}"
    )


def _failure(problem, centre) -> str:
    if np.isfinite(problem.log_likelihood(centre)[0]):
        return ""
    status = problem.trajectory(centre).status[0]
    why = "the readings are impossible" if status == "ok" else f"the boat {status.replace('_', ' ')}"
    return f", and at the prior means {why}"


def lines(card: Card | None) -> list[str]:
    """A card in words."""
    if card is None:
        return []
    return card.lines() if isinstance(card, data_card.DataCard) else vehicle_lines.lines(card)

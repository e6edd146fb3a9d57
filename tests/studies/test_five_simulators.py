"""Five simulators of others: published numbers, their truth in our equations, their logs by our maps."""

import json
import math
from types import ModuleType

import numpy as np
import pytest
from support import mariner as twin

import bayesub as bs
from bayesub.io import toml_files
from bayesub.logs import log_files, readers
from bayesub.logs.log_map import read_map
from bayesub.model.simulator import Simulator
from bayesub.study.schema.trial_log import read_trial
from strangers import gazebo, mariner, mmg, npsauv, remus, tables, trials

ALL = (mariner, npsauv, remus, gazebo, mmg)
BUILT_IN = (mariner, npsauv)
NAMES = {module: module.NAME for module in ALL}


@pytest.fixture
def ordered(monkeypatch):
    """ordered(module, seconds, row_s, degrees): the run "fitted" of a simulator with other orders of its rudder."""

    def change(module: ModuleType, seconds, row_s, degrees):
        monkeypatch.setitem(module.SECONDS, "fitted", seconds)
        monkeypatch.setattr(module, "ROW_S", row_s)
        monkeypatch.setitem(module.DEGREES, "fitted", degrees)
        return module.fly(module.PARAMETERS, "fitted")

    return change


# The textbook of the MSS toolbox (Fossen 2002), as in tests/model/equations/test_abkowitz.py, m.
TEXTBOOK = {"start": 769, "advance": 943, "transfer": 534, "tactical diameter": 1311}
TEXTBOOK |= {"largest advance": 947, "largest transfer": 1315, "steady radius": 711}


def test_mariner_turns_as_in_the_textbook(ordered):
    """Fifteen degrees to port at 99.5 s; with Euler steps of 0.1 s all seven numbers are those of the book."""
    log = ordered(mariner, 700.0, 0.1, ((99.45, -15.0),))
    track = np.column_stack([log[name] for name in ("t", "x", "y", "psi", "u", "v", "r")])
    track[:, 4] += mariner.SPEED
    measures = twin.turning_circle(track, 99.9, (89.5, 179.5))
    assert {name: round(x) for name, x in measures.items()} == TEXTBOOK


# Of the package python_vehicle_simulator at 1500 rpm, by tests/model/equations/test_remus.py: m/s, and degrees/s by
# degrees of rudder.
PACKAGE_SPEED, PACKAGE_RATES = 2.512, {4.0: 3.007, 10.0: 5.778, 13.6: 7.132}
PACKAGE_MASSES = (31.03, 0.1244, 4.040, 4.028)
PACKAGE_ADDED = (0.839, 29.44, 29.44, 0.0336, 3.426, 3.426)


def test_remus_has_masses_and_motion_of_the_package(monkeypatch, ordered):
    boat = remus.Boat(remus.PARAMETERS)
    assert np.diag(boat.rigid)[[0, 3, 4, 5]] == pytest.approx(PACKAGE_MASSES, rel=1e-3)
    assert np.diag(boat.added) == pytest.approx(PACKAGE_ADDED, rel=2e-3)
    monkeypatch.setitem(remus.REVOLUTIONS, "fitted", ((0.0, 1500.0),))
    for degrees, rate in {0.0: 0.0, **PACKAGE_RATES}.items():
        log = ordered(remus, 60.0, 0.1, ((0.0, degrees),))
        assert math.degrees(log["r"][-1]) == pytest.approx(rate, rel=1e-3, abs=1e-6)
        if degrees == 0.0:
            assert log["u"][-1] == pytest.approx(PACKAGE_SPEED, rel=1e-3)


def test_gazebo_has_the_coriolis_forces_of_its_unit_test():
    """Hydrodynamics_TEST.cc of gz-sim: added masses and velocities 1 to 6; its matrix times the velocity."""
    p = dict.fromkeys(gazebo.PARAMETERS, 0.0) | {"xDotU": -1.0, "yDotV": -2.0, "nDotR": -6.0}
    assert gazebo.water(p, 1.0, 2.0, 6.0) == (-4.0 * 6.0, 1.0 * 6.0, 4.0 * 1.0 - 1.0 * 2.0)
    assert gazebo.water(gazebo.PARAMETERS, 0.0, 0.5, 0.0)[1] == pytest.approx(-601.27 * 0.25 - 12.5)


# Free-running model of KVLCC2 at MARIN, SIMMAN of 2008, from the order to port and starboard: lengths.
MARIN_ADVANCE, MARIN_DIAMETER = (2.83, 2.93), (3.09, 3.34)


def test_tanker_turns_as_its_model_in_the_basin(ordered):
    """Rudder 35 degrees: between the turns to both sides of the free-running model, give or take six per cent."""
    log = ordered(mmg, 200.0, 0.2, ((0.0, 35.0),))
    turned = np.degrees(log["psi"])
    advance, diameter = (np.interp(a, turned, log[f"{axis}_position"]) for a, axis in ((90.0, "x"), (180.0, "y")))
    for value, measured in ((advance, MARIN_ADVANCE), (diameter, MARIN_DIAMETER)):
        assert 0.94 * min(measured) < value / mmg.LENGTH < 1.06 * max(measured)


def test_tanker_goes_straight_at_its_speed(ordered):
    log = ordered(mmg, 100.0, 0.2, ())
    assert log["u_velo"][-1] == pytest.approx(mmg.SPEED, abs=1e-3)


def test_auv_of_the_postgraduate_school_propels_itself(ordered):
    """u = 0.012 n; and the block of 0.53 m in pure sway: Cdy rho/2 0.53 m 5.83 m v^2."""
    log = ordered(npsauv, 50.0, 0.1, ())
    assert log["u"][-1] == pytest.approx(npsauv.SPEED, abs=1e-9)
    none = dict.fromkeys(npsauv.PARAMETERS, 0.0) | {"Cdy": 0.5, "Cdn": 0.5}
    _, y, n = npsauv.forces(none, 0.0, 0.4, 0.0, 0.0, 0.0)
    assert y == pytest.approx(-0.5 * 512.5 * 0.53 * 5.83 * 0.16)
    assert n == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("module", ALL, ids=NAMES.get)
def test_guess_is_the_published_boat(module, tmp_path):
    """Each coefficient of the vehicle that the fit starts from is that of the simulator."""
    boat = module.vehicle(tmp_path, lacking=False)
    ours = module.counterparts(module.PARAMETERS)
    names = [name for name, value in zip(boat.equations.names, boat.xi, strict=True) if value != 0.0]
    planar = set(boat.equations.subproblems["horizontal"])
    assert set(ours) == {name for name in names if name in planar}
    values = dict(zip(boat.equations.names, boat.xi, strict=True))
    assert [values[name] for name in ours] == pytest.approx(list(ours.values()), rel=3e-3)


# Largest difference of a reading from our flight of the truth, over its noise: Euler's steps, and at sea what six
# degrees of freedom do in the plane. With steps a tenth as long.
OFF = {mariner: 1.0, npsauv: 3.0, remus: 3.0, gazebo: 0.2, mmg: 0.2}


@pytest.mark.parametrize(
    "module",
    [pytest.param(one, marks=pytest.mark.slow) if one is remus else one for one in ALL],
    ids=NAMES.get,
)
def test_truth_in_our_equations_reproduces_the_log(module, tmp_path, monkeypatch):
    """A boat unlike the guess, flown by our simulator from the documented start with the converted controls."""
    rng = np.random.default_rng(5)
    p = {name: value * (1.0 + 0.1 * rng.standard_normal()) for name, value in module.PARAMETERS.items()}
    if module in (mariner, npsauv, remus):
        monkeypatch.setattr(module, "STEP_S", module.STEP_S / 10)
    trials.table(tmp_path / "exact.csv", module.fly(p, "unseen"))
    boat = module.vehicle(tmp_path, lacking=False)
    sensors = [bs.sensors.Sensor(column, sd=sd) for column, sd in module.SENSORS.items()]
    log = trials.converted(module, tmp_path / "exact.csv")
    trial = read_trial(log, boat, sensors, subproblem="horizontal", nuisance=module.START)
    truth = module.counterparts(p)
    xi = boat.xi.copy()
    xi[boat.equations.columns(truth)] = list(truth.values())
    for channel in trial.record.channels:
        simulator = Simulator(boat, trial.manoeuvre, channel.times, dt=0.02)
        states, (code,) = simulator.run(xi[None])
        assert code == 0
        values = states[0][:, log_files.STATES.index(channel.state)]
        off = values - channel.values
        if channel.state == "psi":
            off = (off + math.pi) % (2.0 * math.pi) - math.pi
        assert np.abs(off / channel.sd).max() < OFF[module], channel.name


@pytest.mark.parametrize("module", ALL, ids=NAMES.get)
def test_map_names_every_signal_once_and_all_sensors(module, tmp_path):
    """The map converts the columns that the simulator writes; each noisy one is a sensor with the same noise."""
    log_map = read_map(trials.FOLDER / f"{module.NAME}_map.toml", "csv")
    signals = [section.signal for section in log_map.columns.values()]
    assert len(set(signals)) == len(signals)
    assert set(module.NOISE) <= set(signals)
    assert set(module.SENSORS) <= set(log_map.columns)
    for column, sd in module.SENSORS.items():
        noise = module.NOISE[log_map.columns[column].signal]
        assert sd * log_files.si_factor(column) == pytest.approx(noise, rel=1e-9)
    log = module.fly(module.PARAMETERS, "unseen")
    trials.table(tmp_path / "log.csv", {name: values[:50] for name, values in log.items()})
    assert set(signals) <= set(readers.read("csv", [tmp_path / "log.csv"], log_map).signals)


def test_the_fit_is_given_logs_and_no_truth(tmp_path):
    """The folder of logs holds two tables without the parameters, which are in the other one."""
    trials.write(gazebo, tmp_path, np.random.default_rng(1), lacking=False)
    assert sorted(path.name for path in (tmp_path / "logs").iterdir()) == ["fitted.csv", "unseen.csv"]
    truth = json.loads((tmp_path / "truth" / "truth.json").read_text())["coefficients"]
    assert set(truth) == set(gazebo.counterparts(gazebo.PARAMETERS))
    assert abs(truth["Yvdot"] / -126.324739 - 1.0) > 1e-3
    head = (tmp_path / "logs" / "fitted.csv").read_text().splitlines()[0]
    assert not set(head.split(",")) & set(truth)


def test_terms_that_are_left_out_are_held_at_zero(tmp_path):
    for module in ALL:
        folder = tmp_path / module.NAME
        folder.mkdir()
        boat = module.vehicle(folder, lacking=True)
        assert not boat.xi[boat.equations.columns(module.REMOVED)].any()


def row(**changes):
    """Numbers of a row as the study has them."""
    one = {"n_trials": 200, "removed": [], "coverage": {"90%": 0.9}, "path_percent": {"median": 0.3}}
    return one | {"chi_square": 1.0, "n_boats": 5, "called_wrong": 0} | changes


def failed(**changes):
    return [message for holds, message in tables.claims({"boat": row(**changes)}) if not holds]


def test_claims_are_those_of_the_study():
    assert not failed()
    assert failed(coverage={"90%": 0.84})
    assert failed(coverage={"90%": 0.96})
    assert failed(path_percent={"median": 1.2})
    assert failed(path_percent={"median": None})
    assert not failed(removed=["Nr"], coverage={"90%": 0.2})  # what is left does not exceed the noise
    assert not failed(removed=["Nr"], chi_square=2.0, called_wrong=5)
    assert failed(removed=["Nr"], chi_square=2.0, called_wrong=4)


def test_a_run_that_is_not_completed_counts_as_far_off():
    assert tables.quartiles([0.1, 0.2, None]) == {"median": 0.2, "largest": None}
    assert tables.quartiles([None, None, 0.2])["median"] is None


def test_vehicles_name_their_equations(tmp_path):
    """Each own set is found beside its vehicle, and its terms are those of the plane."""
    for module in ALL:
        if module not in BUILT_IN:
            path = trials.FOLDER / f"{module.NAME}.toml"
            assert toml_files.read_toml_table(path)["equations"] == f"{module.NAME}_terms.toml"
            assert module.vehicle(tmp_path, lacking=False).equations.degrees_of_freedom == 3

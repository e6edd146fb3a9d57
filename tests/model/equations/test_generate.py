"""Forces of kernels are those of the equation set, whatever its terms, and so are their derivatives."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from support import slow_twin, user_set

import bayesub as bs
from bayesub.io import toml_files
from bayesub.kernels.variations import of_dense
from bayesub.kernels.workspace import BODY
from bayesub.logs.log_files import STATES
from bayesub.model.equations import AXES, load_equations
from bayesub.model.equations.generate import EXTERNAL, source
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator

# Eighth-order central differences.
OFFSETS = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = np.array([3.0, -32.0, 168.0, -672.0, 672.0, -168.0, 32.0, -3.0]) / 840.0


def planes(equations):
    return [*equations.subproblems] if equations.degrees_of_freedom == 3 else [None, *equations.subproblems]


EXAMPLE = Path(__file__).with_name("glider_vertical.txt")


def test_example_of_a_generated_text():
    """What is generated can be read; it is that of a small set, as an example."""
    assert EXAMPLE.read_text() == source(load_equations("glider"), "vertical", external=True)


@pytest.mark.parametrize("name", toml_files.built_in("equations"))
def test_a_plane_computes_its_own_terms_only(name):
    """The forces have one line for each term that acts without acceleration; the first two of an axis stay."""
    equations = load_equations(name)
    for plane in planes(equations):
        module = ast.parse(source(equations, plane))
        forces = next(f for f in module.body if getattr(f, "name", "") == "forces")
        lines = source(equations, plane).splitlines()[forces.lineno : forces.end_lineno]
        names = [line.partition("  # ")[2] for line in lines if "c[" in line]
        own = [n for n in equations.active(subproblem=plane) if n not in equations.added_masses]
        steady = [[t.name for t in equations.terms if t.axis == axis and not t.is_added_mass] for axis in AXES]
        first = {name for of_axis in steady if set(of_axis) & set(own) for name in of_axis[:2]}
        assert names == [t.name for t in equations.terms if t.name in {*own, *first}]


@pytest.mark.parametrize(
    ("name", "plane"), [("suboff", "horizontal"), ("auv690", "horizontal"), ("suboff", "vertical")]
)
def test_a_plane_flies_like_all_equations(name, plane):
    """The vehicle confined to a plane moves in all equations as it does in those of the plane.

    Terms that are left out are zeros in the sums of the others, so that only the contraction of products differs.
    """
    boat = bs.load_vehicle(name)
    flown = bs.load_manoeuvre(plane, boat)
    times = np.linspace(0.0, min(120.0, flown.duration), 41)
    of_plane = Simulator(boat, flown, times, subproblem=plane, dt=0.5)
    of_all = Simulator(boat.restricted(plane), flown, times, subproblem=None, dt=0.5)
    assert of_plane.kernels is not of_all.kernels
    sets = boat.xi * np.random.default_rng(3).uniform(0.9, 1.1, (11, len(boat.xi)))
    confined = np.where(of_plane.vehicle.xi == 0.0, 0.0, sets)
    states, status = of_plane.run(sets)
    expected, status_of_all = of_all.run(confined)
    assert not status.any()
    assert not status_of_all.any()
    np.testing.assert_allclose(states, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    names = [n for n in boat.equations.subproblems[plane] if boat.xi[boat.equations.index[n]] != 0.0]
    derivatives = of_plane.sensitivities(boat.xi, (*names, "mass", "u0"))
    others = of_all.sensitivities(of_plane.vehicle.xi, (*names, "mass", "u0"))
    assert np.all(np.abs(derivatives - others) <= 1e-11 * np.abs(others).max(axis=(0, 1)))


@pytest.fixture(scope="module")
def vehicle(boat, tmp_path_factory):
    """A boat with every kind of symbol in its equations and nothing symmetric."""
    return loaded(boat, tmp_path_factory, "every_symbol.toml")


@pytest.fixture(scope="module")
def included(boat, tmp_path_factory):
    """The same, the rigid body's velocity terms in the coefficients."""
    return loaded(boat, tmp_path_factory, "included.toml")


def loaded(boat, tmp_path_factory, equations):
    folder = tmp_path_factory.mktemp("every_symbol")
    user_set.write(folder)
    path = folder / "boat.toml"
    path.write_text(tomli_w.dumps(user_set.content(boat, equations)))
    return bs.load_vehicle(path)


@pytest.fixture
def random_motions(motions, rng):
    """States, controls of every_symbol and propeller speeds: ahead, astern and at rest, some not drifting."""
    states, controls, rpm = motions
    wide = np.column_stack([controls, rng.uniform(-5e4, 5e4, len(states)), rng.uniform(-90.0, 90.0, len(states))])
    return states, wide, rpm


def forces_of(equations, vehicle, states, controls, rpm, accelerations):
    """(n, 6) hydrodynamic forces by regressors times coefficients."""
    with_uc = np.column_stack([controls, rpm / vehicle.rpm_per_mps])
    blocks = equations.regressors(states, accelerations, with_uc, vehicle.constants)
    dimensional = vehicle.xi * vehicle.dimensional_factors
    return np.stack([blocks[a] @ dimensional[equations.columns(equations.names_of_axis(a))] for a in AXES], axis=1)


def mechanical(boat, states, rpm, rigid_body):
    """(n, 6) hydrostatics, propulsion and, less, the velocity terms of the rigid body, all of the twin."""
    rows = []
    for state, n in zip(states, rpm, strict=True):
        force = np.array(slow_twin.hydrostatics(boat, state[3], state[4])) + slow_twin.propulsion(boat, state[6], n)
        rows.append(force - rigid_body * np.array(slow_twin.rigid_body(boat, state[6:], [0.0] * 6)))
    return np.array(rows)


def test_forces_are_regressors_times_coefficients(vehicle, boat, random_motions):
    """M times the accelerations of the kernels, at random states."""
    states, controls, rpm = random_motions
    accelerations = bs.accelerations(vehicle, states, controls, rpm)
    rest = forces_of(vehicle.equations, vehicle, states, controls, rpm, np.zeros((len(states), 6)))
    parts = mechanical(boat, states, rpm, rigid_body=1.0)
    close(accelerations @ vehicle.mass_matrix.T, rest + parts, rest, parts)
    # And the mass matrix is what the regressors of accelerations say.
    moved = forces_of(vehicle.equations, vehicle, states, controls, rpm, accelerations) - rest
    rigid = np.array([slow_twin.rigid_body(boat, np.zeros(6), a) for a in accelerations])
    close(accelerations @ vehicle.mass_matrix.T, rigid - moved, rigid, moved)


def close(values, expected, *parts):
    """Equal to the round-off of their largest part, of forces and moments apart."""
    size = np.max([np.abs(part) for part in parts], axis=0)
    for columns in (slice(0, 3), slice(3, 6)):
        scale = size[:, columns].max(axis=1, keepdims=True)
        # The mass matrix and its inverse, of condition number up to a thousand after scaling, both act.
        assert np.all(np.abs(values - expected)[:, columns] <= 1e-11 * scale)


def test_the_rigid_body_in_the_coefficients_and_forces_from_outside(included, boat, random_motions, rng):
    """Then only the mass matrix holds it; forces from outside act as they are, and in proportion to u."""
    states, controls, rpm = random_motions
    kernel = user_set.families()[1]
    outside = np.hstack([rng.uniform(-1e6, 1e6, (len(states), 12)), np.zeros((len(states), 4))])  # and no weights
    all_controls = np.column_stack([controls, rpm / included.rpm_per_mps, outside])
    body = np.concatenate([included.body, included.constants])[None]
    dimensional = (included.xi * included.dimensional_factors)[None]
    accelerations = kernel.body_accelerations(dimensional, body, states[None].copy(), all_controls)[0]
    forces = forces_of(included.equations, included, states, controls, rpm, np.zeros((len(states), 6)))
    parts = mechanical(boat, states, rpm, rigid_body=0.0)
    external = outside[:, :6] + outside[:, 6:12] * states[:, 6:7]
    close(accelerations @ included.mass_matrix.T, forces + parts + external, forces, parts, external)


@pytest.fixture(scope="module")
def turning(vehicle):
    """An unsteady turn of six seconds with every velocity, rate and control away from zero, and no change of sign."""
    times = np.arange(0.0, 6.01, 0.5)
    swing = (1.0 - np.cos(times / 3.0))[:, None]
    controls = np.array([0.1, 0.04, 0.03, 3e4, 70.0]) + swing * np.array([0.1, -0.02, 0.02, 1e4, 5.0])
    initial = np.array([10.0, -20.0, 90.0, 0.1, -0.08, 0.5, 7.0, 0.6, -0.9, -0.011, -0.006, 0.03])
    rpm = vehicle.rpm_per_mps * (7.6 + 0.3 * swing[:, 0])
    return Manoeuvre("turning", times, controls, rpm, initial, columns=user_set.COLUMNS)


def differences(run, n):
    """Derivatives of run(offsets (8, n) in steps) -> (8, n_times, n_outputs), one column after another."""
    columns = []
    for k in range(n):
        offsets = np.zeros((len(OFFSETS), n))
        offsets[:, k] = OFFSETS
        columns.append(np.tensordot(WEIGHTS, run(offsets), axes=1))
    return np.stack(columns, axis=-1)


def agree(derivatives, expected, noise):
    """To a millionth of the largest, and to the noise (n_outputs, n) of the differences."""
    error = np.abs(derivatives - expected).max(axis=0)
    assert np.all(error <= 1e-7 * np.abs(expected).max(axis=0) + noise)
    assert np.median(error / np.maximum(np.abs(expected).max(axis=0), 1e-300)) < 1e-9


ROUND_OFF = 1e-13 * np.array([100, 100, 100, 1, 1, 1, 10, 1, 1, 0.1, 0.1, 0.1])[:, None]  # of states


def test_sensitivities_are_differences(vehicle, turning):
    """By every coefficient, body number and initial state, between the steps too."""
    simulator = Simulator(vehicle, turning, np.linspace(0.3, 6.0, 7), dt=0.25)
    states = simulator.run(vehicle.xi)[0][0]
    assert np.all(np.diff(np.sign(states[:, 6:]), axis=0) == 0)
    xi, body, initial = vehicle.xi, vehicle.body, turning.initial_state
    names = vehicle.equations.names
    step = 1e-3 * np.abs(xi)
    by_coefficients = differences(lambda offsets: simulator.run(xi + offsets * step)[0], len(names)) / step
    agree(simulator.sensitivities(xi, names), by_coefficients, ROUND_OFF / step)
    sets = np.repeat(xi[None], len(OFFSETS), axis=0)
    size = 1e-3 * np.abs(body)
    by_body = differences(lambda offsets: simulator.run(sets, body=body + offsets * size)[0], len(BODY))
    factor = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
    size = np.where([name[0] == "b" and name[1:].isdigit() for name in BODY], size / factor, size)
    agree(simulator.sensitivities(xi, BODY), by_body / size, ROUND_OFF / size)
    size = 1e-3 * np.abs(initial)
    by_start = differences(lambda offsets: simulator.run(sets, initial=initial + offsets * size)[0], len(STATES)) / size
    agree(simulator.sensitivities(xi, [f"{state}0" for state in STATES]), by_start, ROUND_OFF / size)


@pytest.mark.parametrize("external", [False, True])
def test_sensitivities_by_amounts_of_controls(vehicle, included, turning, external):
    """Offsets of each control, and a share of it, by the kernels' own derivatives and by differences.

    Of the propeller speed only what is in the terms counts, which is why that of the polynomial is not varied.
    """
    boat = included if external else vehicle
    family = user_set.families()[external]
    simulator = Simulator(vehicle, turning, [6.0], dt=0.25)
    stages = simulator._stages
    outside = np.tile([*np.linspace(-3e5, 5e5, 12), 2e5, -1e6, 5e5, 3e5], (*stages.shape[:2], 1))
    stages = np.concatenate([stages, outside], axis=2) if external else stages
    varied = [k for k in range(stages.shape[2]) if k != len(user_set.COLUMNS)]
    variations = np.zeros((*stages.shape[:2], len(varied) + 1, stages.shape[2]))
    for n, k in enumerate(varied):
        variations[:, :, n, k] = 1.0
    variations[:, :, -1, 0] = stages[:, :, 0]  # a rudder of other effectiveness
    dimensional = boat.xi * boat.dimensional_factors
    body = np.concatenate([boat.body, boat.constants])
    times, rows = np.linspace(0.3, 6.0, 7), np.arange(12)
    n = len(varied) + 1
    size = 1e-3 * np.array([*np.abs(stages).max(axis=(0, 1))[varied], 1.0])
    reference = np.linspace(-1.0, 1.0, n) * size  # amounts about which the derivatives are taken

    def run(offsets):
        batch = len(offsets)
        states, status = family.integrate(
            np.repeat(dimensional[None], batch, axis=0),
            np.repeat(body[None], batch, axis=0),
            np.repeat(turning.initial_state[None], batch, axis=0),
            stages,
            of_dense(variations),
            reference + offsets * size,
            0.25,
            times,
            100.0,
            rows,
        )
        assert not status.any()
        return states

    moved = stages + np.einsum("n,stnk->stk", reference, variations)
    history = family.fly(dimensional[None], body[None], turning.initial_state[None], moved, 0.25, 100.0)
    columns = [(len(dimensional) + 6 * k + axis, axis) for k in range(n) for axis in range(6)]
    sources, axes = (np.array(part) for part in zip(*columns, strict=True))
    derivatives, _ = family.sensitivities(
        dimensional[None],
        body[None],
        history,
        moved,
        of_dense(variations),
        np.arange(6 * n).reshape(n, 6),
        0.25,
        times,
        np.zeros(0, dtype=int),
        sources,
        np.ones(len(columns)),
        axes,
        np.zeros((len(columns), 12)),
        rows,
    )
    by_amounts = np.add.reduceat(derivatives, np.arange(0, len(columns), 6), axis=1).swapaxes(1, 2)
    agree(by_amounts, differences(run, n) / size, ROUND_OFF / size)
    if external:
        assert len(EXTERNAL) == stages.shape[2] - len(user_set.COLUMNS) - 1


def test_generated_text_depends_on_the_terms_only(vehicle):
    """Titles, labels and meanings change no kernel; a regressor, an axis or the number of stations does."""
    equations = vehicle.equations
    text = source(equations, None)
    renamed = [replace(term, label="$a$", meaning="b") for term in equations.terms]
    assert source(replace(equations, title="t", reference="r", terms=tuple(renamed)), None) == text
    assert source(replace(equations, stations=6), None) != text
    assert source(replace(equations, rigid_body_terms="in_coefficients"), None) != text
    assert source(equations, "horizontal") != text

"""Small motions about straight flight: roots are those of the simulator, and speeds are where they change."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model.boats import Boats
from bayesub.model.linear_motion import PLANES, critical_speed, inversion_speed, period, roots, stability_index
from bayesub.model.simulator import Simulator
from bayesub.model.standard_manoeuvres import Z, fly

SUBOFF = bs.load_vehicle("suboff")


def _one(vehicle, **speed):
    vehicle = replace(vehicle, **speed)
    return Boats(vehicle, vehicle.xi[None])


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("name", ["suboff", "auv690", "remus100"])
def test_roots_are_eigenvalues_of_the_jacobian_of_the_flown_motion(name, plane):
    """The state after a time T, differentiated by that at the start, is the exponential of the matrix times T."""
    vehicle, states = bs.load_vehicle(name), PLANES[plane]
    time = 1e-3 * vehicle.length_m / vehicle.speed_mps
    still = bs.load_manoeuvre("horizontal", vehicle)  # straight on for a while
    simulator = Simulator(vehicle, still, np.array([time]), dt=0.1 * time, subproblem=plane)
    flown = simulator.sensitivities(vehicle.xi, [f"{state}0" for state in states], states)[0]
    expected = np.log(np.linalg.eigvals(flown).astype(complex)) / time
    found = roots(_one(vehicle), plane)[0]
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), rel=1e-5)
    assert np.all(np.diff(found.real) <= 0.0)


def test_at_the_critical_speed_oscillations_neither_grow_nor_decay():
    vehicle = bs.load_vehicle("auv690")
    (speed,) = critical_speed(_one(vehicle))
    slower, at, faster = (roots(_one(vehicle, speed_mps=f * speed), "vertical")[0] for f in (0.9, 1.0, 1.1))
    assert at[0].real == pytest.approx(0.0, abs=1e-6 * abs(at[0]))
    assert abs(at[0].imag) > 0.0
    assert slower[0].real < 0.0 < faster[0].real
    assert period(_one(vehicle, speed_mps=speed))[0] == pytest.approx(2.0 * np.pi / abs(at[0].imag))


def test_a_boat_with_an_index_above_zero_has_no_critical_speed_and_one_without_righting_moment_none_either():
    assert stability_index(_one(SUBOFF), "vertical")[0] > 0.0
    assert np.isnan(critical_speed(_one(SUBOFF))[0])
    vehicle = bs.load_vehicle("auv690")
    body = vehicle.body.copy()
    body[workspace.ZB] = body[workspace.ZG]
    unrighted = replace(vehicle, body=body)
    assert np.isnan(critical_speed(_one(unrighted))[0])
    assert roots(_one(unrighted), "vertical")[0, 0].real > 0.0


def test_the_inversion_speed_is_that_of_the_linear_equations():
    """U^2 = W BG Zd / (Zw Md - Mw Zd) on (rho/2) l^3, of a boat whose weight is its buoyancy."""
    c = dict(zip(SUBOFF.equations.names, SUBOFF.xi * SUBOFF.dimensional_factors, strict=True))
    arm = SUBOFF.body[workspace.ZG] - SUBOFF.body[workspace.ZB]
    square = SUBOFF.body[workspace.WEIGHT] * arm * c["Zuu_ds"] / (c["Muw"] * c["Zuu_ds"] - c["Zuw"] * c["Muu_ds"])
    assert inversion_speed(_one(SUBOFF))[0] == pytest.approx(np.sqrt(square), rel=1e-5)


def test_below_the_inversion_speed_the_planes_act_the_other_way_round():
    (speed,) = inversion_speed(_one(SUBOFF))
    rates = []
    for factor in (0.7, 1.4):
        depths = fly(_one(SUBOFF, speed_mps=factor * speed), 60.0, "vertical", {"stern_plane_deg": (0.0, 1.0)})[0, :, Z]
        rates.append(depths[-1] - depths[-100])
    assert rates[0] < 0.0 < rates[1]

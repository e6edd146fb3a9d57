"""The published model of the tanker KVLCC2 as a prior: its forces, and how the set of the study follows them."""

import math

import numpy as np
import pytest

import bayesub as bs
from kvlcc2 import published
from kvlcc2.trials import FOLDER
from strangers import mmg

MEANS = {key: mean for key, (mean, _) in published.CONSTANTS.items()}


def test_forces_equal_those_of_another_program() -> None:
    """Hull, propeller and rudder of `strangers.mmg`, motion by motion, with its wake."""
    motion = published.motions(np.random.default_rng(3))[:200]
    found = published.forces(MEANS | {"w_P0": mmg.WAKE}, motion)
    unit, p = 0.5 * mmg.DENSITY * mmg.LENGTH**2 * mmg.DRAUGHT, mmg.PARAMETERS | {"R_0": 0.0}
    resistance = p["thrust"] * mmg.propeller(mmg.SPEED, 0.0, 0.0, published.REVOLUTIONS)[0] / mmg.SPEED**2
    wanted = []
    for u, v, r, to_port in motion.tolist():
        push, inflow, load = mmg.propeller(u, v, r, published.REVOLUTIONS)
        normal, (x, y, n) = mmg.rudder(u, v, r, -to_port, inflow, load), mmg.hull(p, u, v, r)
        x += p["thrust"] * push - resistance * (u * u + v * v) + p["drag"] * normal * math.sin(to_port)
        y += -p["side"] * normal * math.cos(to_port) - unit * p["m_x"] * u * r
        wanted.append((x + unit * p["m_y"] * v * r, y, n + p["arm"] * normal * math.cos(to_port)))
    np.testing.assert_allclose(found, np.transpose(wanted), rtol=1e-9, atol=1e-9)


def test_thrust_is_the_measured_one() -> None:
    assert published.thrust(published.SPEED * (1.0 - MEANS["w_P0"])) == pytest.approx(40.85, rel=0.02)  # HSVA's files


def test_vehicle_file_and_set_follow_the_published_model() -> None:
    boat = bs.load_vehicle(FOLDER / "vehicle.toml")
    xi, prior = published.prior(boat)
    np.testing.assert_allclose(boat.xi, xi, rtol=1e-4, atol=1e-9)
    motion = published.motions(np.random.default_rng(4))
    states = np.zeros((len(motion), 12))
    states[:, published.positions("u", "v", "r")] = motion[:, :3]
    blocks = boat.equations.regressors(states, np.zeros((len(motion), 6)), motion[:, [3, 3]], boat.constants)
    for axis, force, most in zip("XYN", published.forces(MEANS, motion), (0.04, 0.01, 0.025), strict=True):
        columns = boat.equations.columns(boat.equations.names_of_axis(axis))
        missed = blocks[axis] @ (xi * boat.dimensional_factors)[columns] - force
        assert np.std(missed) < most * np.std(force)
    for name, sd in published.SIDES.items():  # which the published model does not have
        assert prior.priors[name].sd == pytest.approx(sd)
        assert prior.priors[name].mean == 0.0

"""What is unique on the horizontal plane, by symbolic algebra: structural identifiability of the rational reduction.

Solved for their accelerations, the equations of motion are rational in the coefficients and linear in functions of the
velocities, such as u v. A motion shows the factors of these functions, if they are independent along it, and nothing
else: what leaves all factors as they are is null. The functions are written here by hand from
the model manual, section 4, with w, p and q zero.
"""

from dataclasses import replace

import numpy as np
import pytest
import sympy

import bayesub as bs
from bayesub.inference.identifiability import null_space
from bayesub.kernels.workspace import THRUST
from bayesub.model.coefficients import HORIZONTAL, INDEX
from bayesub.model.simulator import Simulator

X = {"Xuu": "uu", "Xvv": "vv", "Xuu_drdr": "uudd", "Xvr": "vr", "Xrr": "rr"}
Y = {
    "Yuu": "uu",
    "Yuv": "uv",
    "Yv_absnu": "v|v|",
    "Yuu_dr": "uud",
    "Yur": "ur",
    "Yv_absr": "v|r|",
    "Yu_absr_dr": "u|r|d",
}
N = {"Nuu": "uu", "Nuv": "uv", "Nv_absnu": "v|v|", "Nuu_dr": "uud", "Nur": "ur", "Nabsnu_r": "|v|r", "Nr_absr": "r|r|"}
Y, N = Y | {"Yu_absr_dr": "u|r|d"}, N | {"Nu_absr_dr": "u|r|d"}


def exact(value):
    """A number as a fraction."""
    return sympy.Rational(str(float(value)))


def null_of_algebra(boat, signs):
    """(n_null, n) null directions in non-dimensional coefficients, and the names (n,).

    `signs` is -1 where v and r always differ in sign, so that v|r| is -|v|r, 1 where they always agree, and 0 where
    they do neither.
    """
    body, length = boat.rigid_body, boat.length_m
    half = 0.5 * boat.water_density_kgm3
    mass, inertia = (exact(body[key] / (half * length**n)) for key, n in (("mass", 3), ("Izz", 5)))
    lever = exact(body["xG"] / length)
    of = {name: sympy.Symbol(name) for name in HORIZONTAL}
    surge = sympy.Matrix([[mass - of["Xudot"]]])
    lateral = sympy.Matrix([
        [mass - of["Yvdot"], mass * lever - of["Yrdot"]],
        [mass * lever - of["Nvdot"], inertia - of["Nrdot"]],
    ])  # fmt: skip
    thrust = {key: exact(body[b] / (half * length**2)) for key, b in (("uu", "b1"), ("u", "b2"), ("1", "b3"))}
    known = [{"vr": mass, "rr": mass * lever} | thrust, {"ur": -mass}, {"ur": -mass * lever}]
    factors = []
    for matrix, axes, constants in ((surge, [X], known[:1]), (lateral, [Y, N], known[1:])):
        rows = []
        for terms, row in zip(axes, constants, strict=True):
            row = dict(row)
            for name, function in terms.items():
                sign = signs if function == "v|r|" and signs else 1
                function = "|v|r" if function == "v|r|" and signs else function
                row[function] = row.get(function, 0) + sign * of[name]
            rows.append(row)
        functions = sorted({function for row in rows for function in row})
        forces = sympy.Matrix([[row.get(function, 0) for function in functions] for row in rows])
        factors += list(matrix.inv() * forces)
    slopes = sympy.Matrix(factors).jacobian([of[name] for name in HORIZONTAL])
    values = {of[name]: exact(boat.xi[INDEX[name]]) for name in HORIZONTAL}
    return np.array([list(v) for v in slopes.subs(values).nullspace()], dtype=float), HORIZONTAL


def of_motion(boat, manoeuvre):
    """Our null space of the track of a manoeuvre."""
    record = bs.observe(bs.simulate(boat, manoeuvre), bs.sensors.Track(0.5, 0.1, 5.0), np.random.default_rng(1))
    problem = bs.Problem(boat, manoeuvre, record, free=HORIZONTAL, prior=bs.priors.relative_normal(0.25))
    values = boat.xi[[INDEX[name] for name in problem.names]]
    return null_space(problem, values)


def orthonormal(vectors, scale):
    """Orthonormal rows that span the vectors (n_null, n) over a scale (n,)."""
    return np.linalg.qr((vectors / scale).T)[0].T


@pytest.mark.parametrize(
    ("name", "signs", "n_null"),
    [("horizontal", -1, 3), ("zigzag_20_20", 0, 2)],
    ids=["spiral, v against r", "zig-zag"],
)
def test_null_space_is_that_of_the_algebra(suboff, name, signs, n_null):
    """On the spiral v and r never have one sign, and yaw equations are free by one more direction than on a zig-zag."""
    manoeuvre = bs.load_manoeuvre(name, suboff)
    v, r = Simulator(suboff, manoeuvre, np.arange(20.0, manoeuvre.duration)).run(suboff.xi)[0][0, :, [7, 11]]
    assert (np.max(v * r) < 1e-9) == (signs == -1)
    null, (vectors, names) = of_motion(suboff, manoeuvre), null_of_algebra(suboff, signs)
    assert len(vectors) == len(null) == n_null
    scale = np.maximum(np.abs(suboff.xi[[INDEX[name] for name in names]]), 1e-5)
    ours = orthonormal(np.array([[vector.get(name, 0.0) for name in names] for vector in null.vectors]), scale)
    cosines = np.linalg.svd(ours @ orthonormal(vectors, scale).T, compute_uv=False)
    np.testing.assert_allclose(cosines, 1.0, atol=1e-6)


def test_known_thrust_makes_surge_unique(suboff):
    """Without it the equation of surge may be multiplied by any number; with it no null direction has a part there."""
    coasting = replace(suboff, body=np.array([0.0 if key in THRUST else x for key, x in suboff.rigid_body.items()]))
    for boat, has_part in ((suboff, False), (coasting, True)):
        vectors, names = null_of_algebra(boat, 0)
        assert vectors[:, [k for k, name in enumerate(names) if name.startswith("X")]].any() == has_part

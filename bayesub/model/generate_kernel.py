"""Writes ``hydrodynamics.py``, the force kernel and its derivatives, from the table of the 101 terms.

    python -m bayesub.model.generate_kernel

The generated file is committed, so that it can be read, cached and stepped through; a test checks that it is current.
"""

import textwrap
from pathlib import Path

from bayesub.io.log_files import ACCELERATIONS, VELOCITIES
from bayesub.model.coefficients import AXES, TERMS

TARGET = Path(__file__).parents[1] / "kernels" / "hydrodynamics.py"

_HEADER = '''\
"""Hydrodynamic forces of one lane, by bayesub.model.generate_kernel from the table of coefficients: do not edit."""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = {added_mass}


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, u, v, w, p, q, r, dr, db, ds):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    nu = sqrt(v * v + w * w)
{forces}


@inline
def hydrodynamic_gradient(work, i, u, v, w, p, q, r, dr, db, ds):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    nu = sqrt(v * v + w * w)
    inverse = 1.0 / nu if nu > 0.0 else 0.0
    nu_v, nu_w = v * inverse, w * inverse
{gradient}


@inline
def store_regressors(row, u, v, w, p, q, r, udot, vdot, wdot, pdot, qdot, rdot, dr, db, ds):
    """Write the regressors of the 101 terms into `row`."""
    nu = sqrt(v * v + w * w)
{regressors}
'''

_STEADY = [(k, term) for k, term in enumerate(TERMS) if not term.is_added_mass]


def derivative(factors: list[str], variable: str) -> str:
    """Derivative of a regressor, a product of factors, with respect to a velocity; empty if it is zero."""
    slopes = {variable: [], f"abs({variable})": [f"sgn({variable})"]}
    if variable in ("v", "w"):
        slopes["nu"] = [f"nu_{variable}"]
    products = []
    for n, factor in enumerate(factors):
        if factor in slopes:
            others = factors[:n] + factors[n + 1 :]
            products.append("*".join([*slopes[factor], *others]))
    return " + ".join(products)


def source() -> str:
    """The text of the generated module."""
    added = tuple(
        (AXES.index(t.axis), ACCELERATIONS.index(t.regressor), k) for k, t in enumerate(TERMS) if t.is_added_mass
    )
    forces, gradient = [], []
    for axis in AXES:
        forces += _sum(axis, [(k, t.name, t.regressor) for k, t in _STEADY if t.axis == axis])
        for variable in VELOCITIES:
            terms = [(k, t.name, derivative(t.factors, variable)) for k, t in _STEADY if t.axis == axis]
            gradient += _sum(f"{axis}_{variable}", [term for term in terms if term[2]])
    forces.append(f"return {', '.join(AXES)}")
    columns = ["(" + ", ".join(f"{axis}_{variable}" for axis in AXES) + ")" for variable in VELOCITIES]
    gradient += ["return (", *(f"    {column}," for column in columns), ")"]
    regressors = [f"row[{k}] = {t.regressor}  # {t.name}" for k, t in enumerate(TERMS)]
    text = _HEADER.replace("{added_mass}", str(added))
    for name, lines in (("forces", forces), ("gradient", gradient), ("regressors", regressors)):
        text = text.replace(f"{{{name}}}", textwrap.indent("\n".join(lines), "    "))
    return text


def _sum(target, terms):
    """Lines that assign the sum of coefficient times expression to `target`."""
    if not terms:
        return [f"{target} = 0.0"]
    signs = [""] + ["+ "] * (len(terms) - 1)
    return [
        f"{target} = (",
        *(
            f"    {sign}work[(COEFFICIENTS + {k}) * LANES + i] * ({expression})  # {name}"
            for sign, (k, name, expression) in zip(signs, terms, strict=True)
        ),
        ")",
    ]


if __name__ == "__main__":
    TARGET.write_text(source())

"""Added mass of ellipsoids and of finned sections in ideal fluid, and the forces that follow from it.

Added masses are in units of the fluid's density, that is m^3, m^3 per metre of length and so on. Sources: Lamb,
Hydrodynamics (1932), articles 114, 115 and 124; Newman, Marine Hydrodynamics (1977), sections 4.13 and 4.17; Munk,
NACA report 184 (1924); Pabst (1930), in Korotkin, Added Masses of Ship Structures (2009); thesis section 3.5.1.
"""

import numpy as np

from bayesub.logs.log_files import ACCELERATIONS, VELOCITIES
from bayesub.model.equations import AXES, EquationSet

N_ANGLES = 4096  # of the boundary of a section; its fin roots make the Fourier sum converge as 1/n


def ellipsoid(a: float, b: float, c: float) -> tuple[np.ndarray, np.ndarray]:
    """Lamb's factors of an ellipsoid with semi-axes a (along x), b (y) and c (z): sphere, spheroids, disc and all.

    They are (3,) added masses along x, y, z in units of the displaced mass, and (3,) added moments of inertia about
    these in units of that of the displaced fluid. A body of revolution has Lamb's k1 and k2 as the first two factors of
    mass and k' as the second of inertia.
    """
    # SciPy is imported where it computes, because a command that only reads files starts sooner without it.
    from scipy import special

    squares = (np.array([a, b, c], dtype=float) / max(a, b, c)) ** 2
    turns = [(1, 2, 0), (2, 0, 1), (0, 1, 2)]
    volume = np.sqrt(squares.prod())
    alpha = np.array([2.0 / 3.0 * volume * special.elliprd(squares[i], squares[j], squares[k]) for i, j, k in turns])
    inertia = np.zeros(3)
    for j, k, i in turns:
        difference, total, slope = squares[j] - squares[k], squares[j] + squares[k], alpha[k] - alpha[j]
        if difference != 0.0:
            inertia[i] = difference**2 * slope / (total * (2.0 * difference - total * slope))
    return alpha / (2.0 - alpha), inertia


def long_ovoid(radius: float) -> float:
    """Surge added mass of a long Rankine ovoid, whose ends are blunter than an ellipsoid's: half a sphere, m^3.

    It does not depend on the length (the model of Munk 1923 in thesis section 3.5.1). The momentum of a source and a
    sink, flux times distance, is that of the displaced and the added mass together (Newman section 4.14), and each end
    of the ovoid holds (pi/3) r^3 less than a cylinder that ends at the source.
    """
    return 2.0 * np.pi / 3.0 * radius**3


def section(radius: float | np.ndarray, top: float | np.ndarray, bottom: float | np.ndarray) -> np.ndarray:
    """Sway added mass per length of a circle with a fin above and below, m^2 (radius and tips from the axis, m).

    Joukowski's map takes the section to a plate and that to a circle; without fins it is pi r^2, with equal fins
    pi (s^2 - r^2 + r^4/s^2) (Newman, table 4.3). Fins at the sides lie in the stream and change nothing.
    """
    first, second = (_plate(radius, np.maximum(tip, radius)) for tip in (top, bottom))
    return np.pi * ((first + second) ** 2 / 4.0 - 3.0 * radius**2)


def _plate(radius, tip):
    """The end of the plate to which Joukowski's map takes a fin."""
    return tip + np.where(tip > 0.0, radius**2 / np.maximum(tip, np.finfo(float).tiny), 0.0)


def section_roll(radius: float, top: float, bottom: float) -> float:
    """Roll added moment of inertia per length of a circle with a fin above and below, m^4.

    On the boundary the stream function of the rotation is -|z|^2/2, so with |z|^2 = sum of A_n cos n theta on the
    circle to which the section is mapped, it is (pi/4) sum of n A_n^2. A plate has (pi/8) s^4 (Newman, table 4.3).
    """
    return _roll(radius, max(top, radius), max(bottom, radius), 2.0)


def cruciform_roll(radius: float, tip: float) -> float:
    """Roll added moment of inertia per length of a circle with four equal fins, m^4; (2/pi) s^4 without the circle.

    The square of z takes it to a section with two fins, around which it goes twice.
    """
    return 2.0 * _roll(radius**2, tip**2, tip**2, 1.0) if tip > radius else 0.0


def _roll(radius, top, bottom, power):
    from scipy import fft

    first, second = _plate(radius, top), _plate(radius, bottom)
    angles = np.pi * (np.arange(N_ANGLES) + 0.5) / N_ANGLES
    on_plate = np.abs(0.5 * (first - second) + 0.5 * (first + second) * np.cos(angles))
    on_fin = 0.5 * (on_plate + np.sqrt(np.maximum(on_plate**2 - 4.0 * radius**2, 0.0)))
    distance = np.where(on_plate > 2.0 * radius, on_fin, radius)
    amplitudes = fft.dct(distance**power) / N_ANGLES
    return np.pi / 4.0 * np.sum(np.arange(N_ANGLES) * amplitudes**2)


def finite_span(span: float, chord: float) -> float:
    """Added mass of a rectangular plate in units of its strips (Pabst 1930); 1 for a short span, chord/span for a long.

    The span is from tip to tip, m.
    """
    ratio = span / chord
    return (1.0 - 0.425 * ratio / (1.0 + ratio**2)) / np.sqrt(1.0 + ratio**2)


def coefficients_of(added: np.ndarray, equations: EquationSet) -> np.ndarray:
    """The coefficients of a body in ideal fluid from its added-mass matrix (Kirchhoff; Lamb article 124).

    Momentum p and angular momentum h are `added` times the velocities; the force is -dp/dt - omega x p and the moment
    -dh/dt - omega x h - velocity x p. Products of speeds that the equations do not have are left out. `added` (6, 6) is
    symmetric; like the coefficients (n_terms,), which lack their factors, it is per density of the fluid.
    """
    added = np.asarray(added, dtype=float)
    quadratic = products_of(added)
    xi = np.zeros(len(equations.terms))
    for k, term in enumerate(equations.terms):
        axis, factors = AXES.index(term.axis), [factor.code for factor in term.parsed.factors]
        if term.is_added_mass:
            xi[k] = -added[axis, ACCELERATIONS.index(term.regressor)]
        elif len(factors) == 2 and set(factors) <= set(VELOCITIES):
            i, j = (VELOCITIES.index(factor) for factor in factors)
            xi[k] = quadratic[i, j, axis] + (quadratic[j, i, axis] if i != j else 0.0)
    return xi


def products_of(added: np.ndarray) -> np.ndarray:
    """Forces and moments (6, 6, 6) for a product of two velocities, of an added mass (6, 6) in ideal fluid."""
    units = np.eye(6)
    return np.array([[_convective(one, added @ other) for other in units] for one in units])


def _convective(velocity, momentum):
    """Force and moment (6,) of a momentum (6,) carried along by a moving frame."""
    moment = np.cross(velocity[3:], momentum[3:]) + np.cross(velocity[:3], momentum[:3])
    return -np.concatenate([np.cross(velocity[3:], momentum[:3]), moment])

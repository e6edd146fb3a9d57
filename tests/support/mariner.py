"""The Mariner class ship once more: non-dimensional, scalar, slow and independent of bayesub.

Typed from the tables of Chislett & Strom-Tejsen (1965) as they are coded in mariner.m of the MSS toolbox
(github.com/cybergalactic/MSS, CRAFT/SHIP/models/mariner.m, revision of 2024-04-19), with its own integration. Symbols
are those of the source: u is the change of surge speed, d the rudder angle, all divided by powers of speed and length.
"""

import itertools
import math

import numpy as np

LENGTH, SPEED = 160.93, 7.7175  # m, m/s
MASS, INERTIA, XG = 798e-5, 39.2e-5, -0.023
RATE, LIMIT = math.radians(5.0), math.radians(40.0)  # of the rudder, rad/s and rad; its time constant is 1 s

TABLE = """
    Xudot  -42    Yvdot  -748     Nvdot  4.646
    Xu    -184    Yrdot  -9.354   Nrdot  -43.8
    Xuu   -110    Yv    -1160     Nv      -264
    Xuuu  -215    Yr     -499     Nr      -166
    Xvv   -899    Yvvv  -8078     Nvvv    1636
    Xrr     18    Yvvr  15356     Nvvr   -5483
    Xdd    -95    Yvu   -1160     Nvu     -264
    Xudd  -190    Yru    -499     Nru     -166
    Xrv    798    Yd      278     Nd      -139
    Xvd     93    Yddd    -90     Nddd      45
    Xuvd    93    Yud     556     Nud     -278
                  Yuud    278     Nuud    -139
                  Yvdd     -4     Nvdd      13
                  Yvvd   1190     Nvvd    -489
                  Y0       -4     N0         3
                  Y0u      -8     N0u        6
                  Y0uu     -4     N0uu       3
"""
_CELLS = TABLE.split()
COEFFICIENTS = {name: float(f"{value}e-5") for name, value in zip(_CELLS[::2], _CELLS[1::2], strict=True)}


def _lateral(axis, u, v, r, d):
    """Side force or yaw moment, which have the same seventeen terms but for the accelerations."""
    c = {name[1:]: value for name, value in COEFFICIENTS.items() if name[0] == axis}
    hull = c["v"] * v + c["r"] * r + c["vvv"] * v**3 + c["vvr"] * v**2 * r + c["vu"] * v * u + c["ru"] * r * u
    rudder = c["d"] * d + c["ddd"] * d**3 + c["ud"] * u * d + c["uud"] * u**2 * d
    both = c["vdd"] * v * d**2 + c["vvd"] * v**2 * d
    return hull + rudder + both + c["0"] + c["0u"] * u + c["0uu"] * u**2


def accelerations(surge, sway, yaw, d, *, constant_speed=False):
    """udot, vdot (m/s^2) and rdot (rad/s^2) at velocities in m/s and rad/s and a rudder angle in rad.

    The speed that makes everything non-dimensional is that of the moment, as in mariner.m, or the constant trial speed.
    """
    speed = SPEED if constant_speed else math.hypot(surge, sway)
    u, v, r = (surge - SPEED) / speed, sway / speed, yaw * LENGTH / speed
    c = COEFFICIENTS
    x = c["Xu"] * u + c["Xuu"] * u**2 + c["Xuuu"] * u**3 + c["Xvv"] * v**2 + c["Xrr"] * r**2 + c["Xrv"] * r * v
    x += c["Xdd"] * d**2 + c["Xudd"] * u * d**2 + c["Xvd"] * v * d + c["Xuvd"] * u * v * d
    y, n = _lateral("Y", u, v, r, d), _lateral("N", u, v, r, d)
    m11, m22, m33 = MASS - c["Xudot"], MASS - c["Yvdot"], INERTIA - c["Nrdot"]
    m23, m32 = MASS * XG - c["Yrdot"], MASS * XG - c["Nvdot"]
    determinant = m22 * m33 - m23 * m32
    vdot, rdot = (m33 * y - m23 * n) / determinant, (m22 * n - m32 * y) / determinant
    return x / m11 * speed**2 / LENGTH, vdot * speed**2 / LENGTH, rdot * speed**2 / LENGTH**2


def fly(order, duration, step=0.1, *, euler=False, constant_speed=False):
    """Sail from straight motion at the trial speed.

    Parameters
    ----------
    order : callable
        Rudder angle ordered (rad) at a time (s) and a heading (rad), asked once a step.
    duration, step : float
        s.
    euler : bool
        Integrate as the scripts of the MSS toolbox do, else by the classical Runge-Kutta scheme.
    constant_speed : bool
        As in :func:`accelerations`.

    Returns
    -------
    (n, 8) array
        Time, x, y, heading, surge, sway, yaw rate, rudder angle; m, s, rad.
    """

    def slopes(state, ordered):
        _, _, heading, surge, sway, yaw, d = state
        cosine, sine = math.cos(heading), math.sin(heading)
        turning = min(RATE, max(-RATE, min(LIMIT, max(-LIMIT, ordered)) - d))
        track = (surge * cosine - sway * sine, surge * sine + sway * cosine, yaw)
        return np.array([*track, *accelerations(surge, sway, yaw, d, constant_speed=constant_speed), turning])

    state = np.array([0.0, 0.0, 0.0, SPEED, 0.0, 0.0, 0.0])
    rows = [np.array([0.0, *state])]
    for k in range(round(duration / step)):
        ordered = order(k * step, state[2])
        k1 = slopes(state, ordered)
        if euler:
            state = state + step * k1
        else:
            k2 = slopes(state + step / 2 * k1, ordered)
            k3 = slopes(state + step / 2 * k2, ordered)
            k4 = slopes(state + step * k3, ordered)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        rows.append(np.array([(k + 1) * step, *state]))
    return np.array(rows)


def turning_circle(track, start, heading_deg=(90.0, 180.0)):
    """Measures of a turn from a track as :func:`fly` returns it, with the rudder ordered at the time `start` (s).

    Advance and transfer are taken where the heading reaches the first angle, the tactical diameter where it reaches the
    second; all in m from where the ship was at `start`, across from the line y = 0.
    """
    times, x, y, heading, surge, sway, yaw = track[:, :7].T
    turned = np.degrees(np.abs(heading))
    first, second = (np.argmax(turned >= angle) for angle in heading_deg)

    def at(k, angle, values):
        return np.interp(angle, turned[k - 1 : k + 1], values[k - 1 : k + 1])

    origin = np.interp(start, times, x)
    return {
        "start": origin,
        "advance": at(first, heading_deg[0], x) - origin,
        "transfer": abs(at(first, heading_deg[0], y)),
        "tactical diameter": abs(at(second, heading_deg[1], y)),
        "largest advance": x.max() - origin,
        "largest transfer": np.abs(y).max(),
        "steady radius": math.hypot(surge[-1], sway[-1]) / abs(yaw[-1]),
    }


def zigzag(angle_deg, start, duration, step=0.1):
    """Zig-zag track of :func:`fly`, first to port: rudder and heading go to one angle, five times; then amidships."""
    side, executes = 1, 1

    def order(time, heading):
        nonlocal side, executes
        if executes <= 5 and -side * math.degrees(heading) >= angle_deg:
            side, executes = -side, executes + 1
        return math.radians(angle_deg) * side if time >= start and executes <= 5 else 0.0

    return fly(order, duration, step)


def overshoots(track, heading_deg):
    """Angles (deg) by which the heading of a zig-zag track goes beyond `heading_deg`, swing by swing."""
    heading = np.degrees(track[:, 3])
    beyond = np.abs(heading) > heading_deg
    swings = np.flatnonzero(np.diff(np.sign(np.where(beyond, heading, 0.0))))
    pairs = itertools.pairwise(swings)
    return np.array([np.abs(heading[a + 1 : b + 1]).max() - heading_deg for a, b in pairs if beyond[a + 1]])

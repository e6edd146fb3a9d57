"""Euler angles and unit quaternions of the same attitude (thesis appendix B; aerospace z-y'-x'' sequence)."""

import math

from bayesub.kernels.jit import spliced


@spliced
def quaternion(phi, theta, psi):
    """(q0, q1, q2, q3) of roll, pitch and yaw (rad), scalar part first."""
    sphi, cphi = math.sin(0.5 * phi), math.cos(0.5 * phi)
    sth, cth = math.sin(0.5 * theta), math.cos(0.5 * theta)
    spsi, cpsi = math.sin(0.5 * psi), math.cos(0.5 * psi)
    return (
        cphi * cth * cpsi + sphi * sth * spsi,
        sphi * cth * cpsi - cphi * sth * spsi,
        cphi * sth * cpsi + sphi * cth * spsi,
        cphi * cth * spsi - sphi * sth * cpsi,
    )


@spliced
def euler_angles(q0, q1, q2, q3):
    """Roll and yaw in -pi .. pi and pitch in -pi/2 .. pi/2 (rad) of a quaternion of any length."""
    length2 = q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3
    sine = 2.0 * (q0 * q2 - q1 * q3) / length2
    return (
        math.atan2(2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3),
        math.asin(min(1.0, max(-1.0, sine))),
        math.atan2(2.0 * (q1 * q2 + q0 * q3), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3),
    )

"""How the attitude is integrated: as Euler angles, and in the families of :mod:`.quaternions` without their limit."""

QUATERNIONS = False

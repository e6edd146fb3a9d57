"""The attitude is integrated as a unit quaternion, which has no limit of pitch."""

QUATERNIONS = True

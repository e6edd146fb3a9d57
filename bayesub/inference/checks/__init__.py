"""Checks: whether chains have converged, whether the model fits, whether intervals hold what they say."""

"""Regression on rounded motions: what the study of this name needs."""

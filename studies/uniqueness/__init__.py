"""Uniqueness of the coefficients: what the study of this name needs."""

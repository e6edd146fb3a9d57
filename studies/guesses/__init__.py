"""Guesses that are off: what the study of this name needs."""

"""Rounded readings: what the study of this name needs."""

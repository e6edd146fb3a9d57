"""Boats under an autopilot: what the study of this name needs."""

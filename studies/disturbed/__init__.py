"""Boats that are pushed by what the equations leave out: what the study of this name needs."""

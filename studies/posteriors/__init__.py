"""Posteriors and identified sets: what the study of this name needs."""

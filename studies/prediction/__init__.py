"""Predictions of unseen manoeuvres: what the study of this name needs."""

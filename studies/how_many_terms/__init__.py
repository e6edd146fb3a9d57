"""Smaller and smaller sets of terms: what the study of this name needs."""

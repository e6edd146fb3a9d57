"""Deterministic methods: what the study of this name needs."""

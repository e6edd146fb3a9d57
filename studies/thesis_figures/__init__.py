"""Figures of the thesis: what the study of this name needs."""

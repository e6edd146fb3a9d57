"""Figures of ill-conditioning."""

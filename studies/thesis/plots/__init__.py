"""Figures that serve one study of the thesis each."""

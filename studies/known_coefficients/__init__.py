"""Coefficients that a towing tank has measured: what the study of this name needs."""

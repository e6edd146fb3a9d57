"""Captive model tests: what the study of this name needs."""

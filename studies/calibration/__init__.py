"""Calibration of posteriors: what the study of this name needs."""

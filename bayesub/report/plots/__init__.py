"""Figures. Drawing reads results and computes nothing that a number in the report depends on."""

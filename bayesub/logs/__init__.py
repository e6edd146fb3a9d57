"""Logs of trials: how files are read and converted, and what their columns say against each other before a fit."""

"""The log of a glider: what the study of this name needs."""

"""The time step: what the study of this name needs."""

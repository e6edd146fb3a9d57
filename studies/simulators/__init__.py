"""The simulators: what the study of this name needs."""

"""Other samplers: what the study of this name needs."""

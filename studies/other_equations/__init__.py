"""Other equation sets: what the study of this name needs."""

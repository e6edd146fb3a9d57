"""Linear fits: what the study of this name needs."""

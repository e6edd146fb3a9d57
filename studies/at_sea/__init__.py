"""Wrong sets of coefficients under disturbances: what the study of this name needs."""

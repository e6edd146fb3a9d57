"""Wrong coefficients that data leave open: what the study of this name needs."""

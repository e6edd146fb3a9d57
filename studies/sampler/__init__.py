"""What a posterior costs: what the study of this name needs."""

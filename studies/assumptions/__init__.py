"""Assumptions of section 7.3 that are relaxed: what the study of this name needs."""

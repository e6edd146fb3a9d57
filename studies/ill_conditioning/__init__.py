"""Ill-conditioning: what the study of this name needs."""

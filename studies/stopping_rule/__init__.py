"""The stopping rule of the thesis's searches: what the study of this name needs."""

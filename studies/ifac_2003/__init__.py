"""The paper of 2003: what the study of this name needs."""

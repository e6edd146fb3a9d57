"""Helpers of the study `strangers`: five simulators that share no code with bayesub, and what is made of their logs."""

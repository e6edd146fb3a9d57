"""Comparison with the thesis: its nine cases, its published numbers, and ours beside them."""

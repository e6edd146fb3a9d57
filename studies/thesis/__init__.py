"""What several studies share: the cases and numbers of the thesis, ours beside them, methods and plots."""

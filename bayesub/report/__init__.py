"""Pages and figures of findings: reports of runs, predictions, comparisons and designed trials, and cards."""

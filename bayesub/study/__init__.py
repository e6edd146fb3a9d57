"""Studies: from a file to a run folder."""

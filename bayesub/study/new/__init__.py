"""New input files to fill in."""

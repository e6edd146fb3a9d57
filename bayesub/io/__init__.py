"""Input and output: files, errors that name them, the terminal, and interruptions."""

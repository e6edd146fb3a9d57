"""A study is prepared once, run into a folder that explains itself, and gives a result."""

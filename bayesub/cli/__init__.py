"""The command line: a module for a command that does more than call one function."""

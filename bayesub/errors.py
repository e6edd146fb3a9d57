"""The one error that users see: a sentence that names the file, the key and the remedy."""


class InputError(ValueError):
    """Bad input. The message is one line, complete in itself; the command line prints it and exits with status 2."""

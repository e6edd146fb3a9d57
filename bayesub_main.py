"""The command `bayesub`: a module of its own, so that Ctrl-C while the package is being imported is answered too."""

import os
import signal


def _stopped(*_) -> None:
    os.write(2, b"bayesub: interrupted before anything was done; run the same command again\n")
    os._exit(130)


def main() -> None:
    """Import the command line and run it; Ctrl-C ends it with exit status 130 at any moment."""
    before = signal.signal(signal.SIGINT, _stopped)
    from bayesub import cli

    signal.signal(signal.SIGINT, before)
    try:
        cli.main()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt

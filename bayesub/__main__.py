"""The command `bayesub`, also as ``python -m bayesub``.

It answers Ctrl-C while the command line itself is being imported.
"""

import os
import signal


def _stopped(*_) -> None:
    os.write(2, b"bayesub: interrupted before anything was done; run the same command again\n")
    os._exit(130)


def main() -> None:
    """Import the command line and run it; Ctrl-C ends it with exit status 130 at any moment."""
    before = signal.signal(signal.SIGINT, _stopped)
    from bayesub.cli import app

    signal.signal(signal.SIGINT, before)
    try:
        app.main()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt


if __name__ == "__main__":
    main()

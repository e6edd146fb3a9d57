"""The command `bayesub`, also as ``python -m bayesub``.

It answers Ctrl-C while the command line itself is being imported. To be told to end is the same, so that what ``kill``,
a cluster or a shutdown ends saves what is done and leaves no worker behind.
"""

import gc
import os
import signal
import threading

_NEW_OBJECTS = 50_000  # before the collector looks at them; with Python's 700 it takes an eighth of a compilation


def _stopped(*_) -> None:
    os.write(2, b"bayesub: interrupted before anything was done; run the same command again\n")
    os._exit(130)


def _unless_stopped(died: threading.ExceptHookArgs) -> None:
    """Say what ended a thread, but not that of loky whose pieces were taken from it, which is how a run ends early."""
    if died.exc_type is not KeyError or getattr(died.thread, "name", "") != "ExecutorManagerThread":
        threading.__excepthook__(died)


def main() -> None:
    """Import the command line and run it; Ctrl-C ends it with exit status 130 at any moment."""
    gc.set_threshold(_NEW_OBJECTS)
    before = signal.signal(signal.SIGINT, _stopped)
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    threading.excepthook = _unless_stopped
    from bayesub.cli import app

    signal.signal(signal.SIGINT, before)
    try:
        app.main()
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt
        gc.freeze()  # nor to collect: to look at all of it once more takes most of a second


if __name__ == "__main__":
    main()

"""Ctrl-C that is not lost, and Ctrl-C that lets a step be finished and saved first."""

import _thread
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

AGAIN_S = 0.02  # after which a lost interruption is repeated


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C inside the block raises KeyboardInterrupt out of it, whatever becomes of the exception on the way.

    Compiled code turns it into a SystemError, and a library that is being imported perhaps into an ImportError. Where
    no exception can be raised, as in the callback of a weak reference, Python drops it; then it comes again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed, hook = threading.Event(), sys.unraisablehook

    def press(*_):
        pressed.set()
        raise KeyboardInterrupt

    def dropped(unraisable):
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            threading.Timer(AGAIN_S, _thread.interrupt_main).start()
        else:
            hook(unraisable)

    before = signal.signal(signal.SIGINT, press)
    sys.unraisablehook = dropped
    try:
        yield
    except Exception:
        if pressed.is_set():
            raise KeyboardInterrupt from None
        raise
    finally:
        signal.signal(signal.SIGINT, before)
        sys.unraisablehook = hook


@contextmanager
def deferred() -> Iterator[Callable[[], bool]]:
    """Gives a function that says whether Ctrl-C was pressed; pressed again it does at once what it did before.

    Only the main thread receives signals; in another one nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    pressed = threading.Event()

    def press(*_):
        pressed.set()
        signal.signal(signal.SIGINT, before)

    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, press)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)

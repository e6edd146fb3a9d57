"""Ctrl-C that is not lost, and Ctrl-C that lets a step be finished and saved first."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

AGAIN_S = 0.02  # after which an interruption that could not be is repeated
# Machine code is made and loaded: an exception that a callback of the linker drops would leave a function without its
# code, and the call of that ends the process. A thread begins: not yet noted, it would be waited for for ever.
_IN_ONE_PIECE = ("numba.", "llvmlite.", "concurrent.futures.thread.")


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C inside the block raises KeyboardInterrupt out of it, whatever becomes of the exception on the way.

    Compiled code turns it into a SystemError, and a library that is being imported perhaps into an ImportError. Where
    no exception can be raised, as in the callback of a weak reference, Python drops it; then it comes again, as it does
    when machine code has been loaded or a thread has begun.
    """
    main = threading.main_thread()
    if threading.current_thread() is not main:
        yield
        return
    pressed, hook, repeated = threading.Event(), sys.unraisablehook, []

    def press(_, frame):
        pressed.set()
        if _must_end_first(frame):
            again()
        else:
            raise KeyboardInterrupt

    def again():
        repeated.append(threading.Timer(AGAIN_S, signal.pthread_kill, (main.ident, signal.SIGINT)))
        repeated[-1].start()

    def dropped(unraisable):
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            again()
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
        for timer in repeated:
            timer.cancel()


def _must_end_first(frame) -> bool:
    """Whether a function that is being executed is of a library that would not survive."""
    while frame is not None:
        if f"{frame.f_globals.get('__name__', '')}.".startswith(_IN_ONE_PIECE):
            return True
        frame = frame.f_back
    return False


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

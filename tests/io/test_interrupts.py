"""Ctrl-C where Python cannot raise, and where it must not."""

import os
import signal
import time

import pytest

from bayesub.io.interrupts import interruptible

CALLBACK = """
def linked(press):
    try:
        press()
    except KeyboardInterrupt:  # what a callback of the linker does with it
        return "no machine code"
    return "machine code"
"""


def press():
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.1)


def callback_of(module):
    functions = {"__name__": module}
    exec(CALLBACK, functions)
    return functions["linked"]


UNCUT = ("llvmlite.binding.executionengine", "numba.core.codegen", "concurrent.futures.thread")


@pytest.mark.parametrize("module", UNCUT)
def test_what_must_not_be_cut_ends_before_the_interruption(module):
    came = []

    def work():
        came.append(callback_of(module)(press))
        time.sleep(5.0)
        came.append("too late")

    with pytest.raises(KeyboardInterrupt), interruptible():
        work()
    assert came == ["machine code"]


def test_anything_else_is_interrupted_at_once():
    came = []
    with interruptible():
        came.append(callback_of("numbatic")(press))
    assert came == ["no machine code"]


class Reference:
    """Its end is a place where no exception can be raised."""

    def __del__(self):
        press()


def test_what_python_drops_comes_again():
    came = []

    def work():
        reference = Reference()
        del reference
        time.sleep(5.0)
        came.append("too late")

    with pytest.raises(KeyboardInterrupt), interruptible():
        work()
    assert came == []


def test_no_interruption_is_left_behind():
    def work():
        callback_of("numba")(press)
        press()

    with pytest.raises(KeyboardInterrupt), interruptible():
        work()
    time.sleep(0.1)  # in which a repeated one would come

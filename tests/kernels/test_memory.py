"""What a process frees it keeps for its next arrays, and its threads sleep between loops."""

import os
import subprocess
import sys

import pytest

from bayesub.kernels import memory

BATCHES = """
import resource
import {imported}
def batch():
    return len(bytearray(b"1") * {size})  # NumPy has ways of its own by version
batch()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    batch()
print((resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before) / 20)
"""
SIZE = 512 * 600 * 6 * 8  # of a large array; imports leave smaller gaps, which the system need not fill again
PAGES = SIZE / 4096


def faults(imported="bayesub.kernels.jit", **settings):
    """Pages that the system gives for each batch."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MALLOC_")} | settings
    command = [sys.executable, "-c", BATCHES.format(imported=imported, size=SIZE)]
    return float(subprocess.run(command, env=environment, capture_output=True, check=True, text=True).stdout)


@pytest.mark.skipif(not memory.keep_freed_memory(), reason="the C library is another, or the environment decides")
def test_the_next_batch_takes_no_new_pages():
    """And where the environment wants small thresholds, all of them: it decides."""
    assert faults() < 0.05 * PAGES
    small = {"MALLOC_MMAP_THRESHOLD_": "131072"}
    if faults("numba.extending", **small) > 0.9 * PAGES:  # numba 0.61 keeps freed memory by itself
        assert faults(**small) > 0.9 * PAGES


def test_another_library_or_an_environment_that_decides_is_left_alone(monkeypatch):
    monkeypatch.setenv("MALLOC_ARENA_MAX", "2")
    assert not memory.keep_freed_memory()
    monkeypatch.delenv("MALLOC_ARENA_MAX")
    monkeypatch.setattr(memory.sys, "platform", "darwin")
    assert not memory.keep_freed_memory()


@pytest.mark.parametrize(("given", "used"), [({}, "passive"), ({"OMP_WAIT_POLICY": "active"}, "active")])
def test_threads_wait_asleep_unless_the_environment_decides(given, used):
    environment = {key: value for key, value in os.environ.items() if key != "OMP_WAIT_POLICY"} | given
    command = [sys.executable, "-c", "import os, bayesub.kernels.jit; print(os.environ['OMP_WAIT_POLICY'])"]
    assert subprocess.run(command, env=environment, capture_output=True, check=True, text=True).stdout.strip() == used

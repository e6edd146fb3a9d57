"""Kernels are compiled once, in a process of their own."""

import os
import subprocess
import sys
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from support import every_kernel

import bayesub as bs
from bayesub.kernels import compilation
from bayesub.model import closed_loop
from bayesub.sampling import polynomial

NAME = "equations"


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """A process that has not compiled yet, with an empty cache; forget() makes it another such process."""
    serial = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))
    monkeypatch.setattr(compilation, "gathered", SimpleNamespace(variants=(serial,)))
    monkeypatch.delenv("BAYESUB_COMPILING", raising=False)
    monkeypatch.setattr(numba.config, "DISABLE_JIT", False)
    forget = lambda: monkeypatch.setattr(compilation, "_done", set())  # noqa: E731
    forget()
    return SimpleNamespace(cache=tmp_path, forget=forget)


def script(path):
    return f"import os; open({str(path)!r}, 'a').write(os.environ['BAYESUB_COMPILING'])"


def test_once_for_an_installation(fresh):
    """The script runs in a process that knows that it compiles, and later processes see the stamp that it left."""
    path = fresh.cache / "runs"
    for _ in range(3):
        compilation.ensure(script(path), NAME)
        fresh.forget()
    assert path.read_text() == "1"
    assert len(list(fresh.cache.glob("compiled-*"))) == 1


def test_once_for_each_equations(fresh):
    """Other equations have a script and a stamp of their own."""
    path = fresh.cache / "runs"
    for name in ("equations", "others", "equations"):
        compilation.ensure(script(path), name)
    assert path.read_text() == "11"
    assert len(list(fresh.cache.glob("compiled-*"))) == 2


def test_failure_does_no_harm(fresh):
    """A script that fails leaves no stamp; the kernels are then compiled where they are used."""
    compilation.ensure("raise SystemExit(3)", NAME)
    assert not list(fresh.cache.glob("compiled-*"))


def test_another_processor_is_another_installation(fresh, monkeypatch):
    """NUMBA_CPU_NAME names the processor for which kernels are compiled, which have their own stamp."""
    path = fresh.cache / "runs"
    for processor in ("haswell", "skylake"):
        monkeypatch.setattr(compilation, "_processor", lambda name=processor: name)
        compilation.ensure(script(path), NAME)
        fresh.forget()
    assert path.read_text() == "11"
    assert len({stamp.name for stamp in fresh.cache.glob("compiled-*")}) == 2
    asked = "from bayesub.kernels.compilation import _processor; print(_processor())"
    names = [
        subprocess.run(
            [sys.executable, "-c", asked], env=os.environ | given, capture_output=True, text=True, check=True
        ).stdout
        for given in ({"NUMBA_CPU_NAME": "haswell"}, {"NUMBA_CPU_NAME": "skylake"})
    ]
    assert names[0] != names[1]


def test_not_in_the_process_that_compiles(fresh, monkeypatch):
    """There it would go on for ever."""
    monkeypatch.setenv("BAYESUB_COMPILING", "1")
    compilation.ensure(script(fresh.cache / "runs"), NAME)
    assert not list(fresh.cache.iterdir())


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_a_study_compiles_nothing_else():
    """After the calls of the process that compiles no kernel gets another signature, whatever the noise."""
    finished = subprocess.run([sys.executable, every_kernel.__file__], capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.split() == []


def test_whoever_flies_asks_for_compiled_kernels(monkeypatch, suboff):
    """A closed loop is flown before there is a simulator, and so are accelerations."""
    packages = [suboff.kernels(subproblem).package for subproblem in ("vertical", None)]
    asked = []
    monkeypatch.setattr(compilation, "ensure", lambda _, name: asked.append(name))
    flight = closed_loop.Flight(suboff, "vertical", 1.0, np.zeros((3, 3)), np.eye(12)[6] * 7.5)
    flight.hold({}, 1)
    assert asked == packages[:1]
    bs.accelerations(suboff, np.eye(12)[6:7] * 7.5, np.zeros((1, 3)), 80.0)
    assert asked == packages


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_products_of_polynomials_have_the_same_bits_uncompiled(monkeypatch, rng):
    """Whoever compiles them, and for which processor: the compiler may not contract or reorder."""
    along, slopes = rng.standard_normal((8, 33)), rng.standard_normal((36 + 56 + 35, 33))

    def found():
        terms, gradient = np.empty(slopes.shape), np.zeros(along.shape)
        polynomial._products(along, (6, 4), terms)
        polynomial._products_pullback(along, (6, 4), slopes, gradient)
        return terms, gradient

    compiled = found()
    for name in ("_products", "_products_pullback", "_multiply", "_add_multiple"):
        monkeypatch.setattr(polynomial, name, getattr(polynomial, name).py_func)
    for one, other in zip(compiled, found(), strict=True):
        np.testing.assert_array_equal(one, other)

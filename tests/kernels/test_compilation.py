"""Kernels are compiled once, in a process of their own."""

from types import SimpleNamespace

import pytest

from bayesub.kernels import compilation


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """A process that has not compiled yet, with an empty cache; forget() makes it another such process."""
    monkeypatch.setattr(compilation, "integrate", SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path))))
    monkeypatch.delenv("BAYESUB_COMPILING", raising=False)
    forget = lambda: monkeypatch.setattr(compilation.ensure, "done", False)  # noqa: E731
    forget()
    return SimpleNamespace(cache=tmp_path, forget=forget)


def script(path):
    return f"import os; open({str(path)!r}, 'a').write(os.environ['BAYESUB_COMPILING'])"


def test_once_for_an_installation(fresh):
    """The script runs in a process that knows that it compiles, and later processes see the stamp that it left."""
    path = fresh.cache / "runs"
    for _ in range(3):
        compilation.ensure(script(path))
        fresh.forget()
    assert path.read_text() == "1"
    assert len(list(fresh.cache.glob("compiled-*"))) == 1


def test_failure_does_no_harm(fresh):
    """A script that fails leaves no stamp; the kernels are then compiled where they are used."""
    compilation.ensure("raise SystemExit(3)")
    assert not list(fresh.cache.glob("compiled-*"))


def test_not_in_the_process_that_compiles(fresh, monkeypatch):
    """There it would go on for ever."""
    monkeypatch.setenv("BAYESUB_COMPILING", "1")
    compilation.ensure(script(fresh.cache / "runs"))
    assert not list(fresh.cache.iterdir())

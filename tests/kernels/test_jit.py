"""What is compiled is kept, found again and called: what numba and LLVM have to be like for that."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import llvmlite
import numba
import numpy as np
import pytest
from numba import prange
from support import every_kernel

from bayesub.inference.sampling import polynomial
from bayesub.kernels import compiled_files, integrate, jit
from bayesub.kernels.jit import processor

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder that nothing has been compiled into."""
    monkeypatch.setattr(compiled_files, "folder", lambda: tmp_path / "compiled")
    return tmp_path / "compiled"


def doubled(given):
    given.out[0] = given.work[0] + given.work[0]


@jit.jit
def _fill(k, values, result):
    if values[k] < 0.0:
        raise ValueError("of a loop")
    result[k] = 2.0 * values[k] + k


@jit.jit
def _sum_and_double(values):
    return values.sum(), 2.0 * values


@jit.jit(threads=True)
def _fill_all(values, result):
    for k in prange(len(values)):
        _fill(np.int64(k), values, result)


@jit.jit
def _fill_and_sum(values, result):
    for k in range(len(values)):
        _fill(k, values, result)
    return _sum_and_double(values)


def test_loops_call_one_another():
    """As numba lets them, with several results, arrays among them, and errors."""
    values, result = np.arange(5.0), np.zeros(5)
    _fill_all(values, result)
    np.testing.assert_array_equal(result, 3.0 * values)
    total, doubled_values = _fill_and_sum(values, result)
    assert total == 10.0
    np.testing.assert_array_equal(doubled_values, 2.0 * values)
    with pytest.raises(ValueError, match="of a loop"):
        _fill_and_sum(-values, result)


@pytest.mark.usefixtures("cache")
def test_the_code_of_a_loop_is_no_part_of_others():
    """It would be optimised, and perhaps round, in each of them in another way."""
    values, compiled = np.arange(5.0), jit.jit(_fill_and_sum.py_func)
    compiled(values, np.zeros(5))
    (called,) = _fill.overloads.values()
    caller = next(iter(compiled.overloads.values())).library._final_module
    assert called.fndesc.llvm_func_name in {each.name for each in caller.functions if each.is_declaration}


@pytest.mark.usefixtures("cache")
def test_a_loop_is_not_loaded_without_those_that_it_calls():
    """If one was compiled again it may have another name, by which the others do not call it."""
    kinds = (numba.typeof(np.zeros(1)),) * 2
    kept, compiled = jit._Kept(_fill_and_sum.py_func, {}), jit.jit(_fill_and_sum.py_func)
    compiled.compile(kinds)
    kept.save_overload(kinds, compiled.overloads[kinds])
    context = jit.cpu_target.target_context
    called = {name: jit._loops[name] for name in jit._loops if jit._loops[name][1] == "_fill"}
    assert jit._is_loaded(*next(iter(called.values())), next(iter(called)))
    assert not jit._is_loaded(*next(iter(called.values())), "another name")
    assert kept.load_overload(kinds, context) is not None


def test_the_processor_is_named_as_numba_names_it():
    """System, name and features; LLVM takes them as they are, and has vectors of a width that divides a block."""
    system, name, features = processor()
    assert system.count("-") >= 2
    assert name
    assert set(features[:1]) <= {"+", "-"}
    assert jit._width() in (2, 4, 8)


def test_a_unit_is_compiled_once(cache, monkeypatch):
    """The second time it is loaded: nothing is written in LLVM again."""
    jit.unit_address(doubled, "twice")
    (file,) = cache.iterdir()
    monkeypatch.setattr(jit, "_module", None)
    assert jit.unit_address(doubled, "twice") > 0
    assert [*cache.iterdir()] == [file]


@pytest.mark.parametrize("harm", ["half written", "one bit", "empty", "of another program", "a folder"])
def test_what_is_damaged_is_compiled_again(cache, harm):
    """Half-written, damaged and foreign files do no harm, and are replaced."""
    jit.unit_address(doubled, "harmed")
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    file.unlink()
    if harm == "a folder":
        file.mkdir()
    else:
        spoilt = bytes([*whole[:60], whole[60] ^ 1, *whole[61:]])
        file.write_bytes({"half written": whole[:-100], "one bit": spoilt, "empty": b""}.get(harm, b"\x7fELF" * 50))
    assert jit.unit_address(doubled, "harmed") > 0
    if harm != "a folder":
        assert file.read_bytes() == whole


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path, monkeypatch, capfd):
    """What is compiled is used, and nothing is said."""
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(compiled_files, "folder", lambda: tmp_path / "file" / "compiled")
    assert jit.unit_address(doubled, "unkept") > 0
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("foreign", ["file", "folder"])
def test_machine_code_of_another_user_is_not_loaded(cache, monkeypatch, foreign):
    """Nor from a folder of another: it is code."""
    compiled_files.save("key", b"content")
    assert compiled_files.load("key") == b"content"
    path, me = (cache if foreign == "folder" else cache / "key.compiled"), os.getuid()
    monkeypatch.setattr(compiled_files.os, "getuid", lambda: me + 12345 if me else me)
    if me:
        assert compiled_files.load("key") is None
    else:  # the superuser may give it away
        os.chown(path, 12345, 12345)
        assert compiled_files.load("key") is None


def test_a_cache_that_cannot_be_written_into_is_read(cache, monkeypatch):
    """A folder of a system that is mounted read-only gives what it has."""

    def refuse(*_, **__):
        raise OSError(30, "Read-only file system")

    compiled_files.save("key", b"content")
    for name in ("utime", "replace"):
        monkeypatch.setattr(compiled_files.os, name, refuse)
    monkeypatch.setattr(compiled_files.tempfile, "mkstemp", refuse)
    compiled_files.save("other", b"content")
    assert compiled_files.load("key") == b"content"
    assert [file.name for file in cache.iterdir()] == ["key.compiled"]


def test_a_full_disk_leaves_no_half_file(cache, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compiled_files.os, "fdopen", full)
    compiled_files.save("key", b"content")
    assert [*cache.iterdir()] == []


def test_variants_for_one_thread_and_for_all_are_kept_apart():
    """They have the same text and take the same types."""
    one, all_of_them = integrate._on_one_thread, integrate._on_all_threads
    assert one._cache._key(()) != all_of_them._cache._key(())
    assert len({loop._cache._key(()) for loop in (_fill, _fill_all, _fill_and_sum)}) == 3


def test_several_may_keep_the_same_at_once(cache):
    """Whoever is last leaves a whole file, and nothing else is left."""
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(compiled_files.save, ["key"] * 40, [bytes(100_000)] * 40))
    assert [file.name for file in cache.iterdir()] == ["key.compiled"]
    assert compiled_files.load("key") == bytes(100_000)


def test_what_makes_machine_code_names_it(monkeypatch):
    """Another source, processor, or version of numba, llvmlite or bayesub has a file of its own."""
    others = [
        (jit, "processor", lambda: ("x86_64-pc-linux-gnu", "haswell", "")),
        (numba, "__version__", "0.0"),
        (llvmlite, "__version__", "0.0"),
        (jit, "_sources", lambda _: b"edited"),
    ]
    keys = {jit._key("a"), jit._key("b"), jit._key("a", "b"), jit._key("ab")}
    for where, name, value in others:
        with monkeypatch.context() as changed:
            changed.setattr(where, name, value)
            keys.add(jit._key("a"))
    assert len(keys) == 4 + len(others)


def test_what_was_used_longest_ago_goes_first(cache, monkeypatch):
    """When the folder is too large; a file that was loaded counts as used."""
    monkeypatch.setattr(compiled_files, "MAX_BYTES", 3500)
    for k in range(3):
        compiled_files.save(str(k), bytes(1000))
        os.utime(cache / f"{k}.compiled", (k, k))
    assert compiled_files.load("0") == bytes(1000)
    compiled_files.save("3", bytes(1000))
    assert sorted(file.stem for file in cache.iterdir()) == ["0", "2", "3"]


@pytest.mark.slow
def test_first_runs_and_later_ones_have_the_same_bits(tmp_path):
    """A study that compiles everything and one that loads it; each loop is compiled for one list of types."""

    def run():
        environment = every_kernel.environment(tmp_path)
        done = subprocess.run(
            [sys.executable, every_kernel.__file__], env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return every_kernel.read(done.stdout)

    first, second = run(), run()
    assert first.compiled > 10
    assert first.several == second.several == []
    assert second.compiled == 0
    assert first.digest == second.digest


def test_products_of_polynomials_have_the_same_bits_uncompiled(monkeypatch, rng):
    """Whoever compiles them, and for which processor: the compiler may not contract or reorder."""
    along, chosen = rng.standard_normal((8, 33)), rng.random(36 + 56 + 35) < 0.7
    slopes = rng.standard_normal((np.count_nonzero(chosen), 33))

    def found():
        terms, gradient = np.empty(slopes.shape), np.zeros(along.shape)
        polynomial._products(along, (6, 4), chosen, terms)
        polynomial._products_pullback(along, (6, 4), chosen, slopes, gradient)
        return terms, gradient

    compiled = found()
    for name in ("_products", "_products_pullback", "_multiply", "_add_multiple"):
        monkeypatch.setattr(polynomial, name, getattr(polynomial, name).py_func)
    for one, other in zip(compiled, found(), strict=True):
        np.testing.assert_array_equal(one, other)

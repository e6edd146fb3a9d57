"""Lane functions: the same by machine code and by NumPy, for every equation set; and what they refuse."""

import traceback

import numba
import numpy as np
import pytest
from support import lane_functions, user_set

from bayesub.io import toml_files
from bayesub.kernels import compiled_files, jit, lanes
from bayesub.kernels.families import UNITS, family
from bayesub.kernels.workspace import BODY, BODY_ROWS, COEFFICIENTS, INVERSE_MASS, LANES, STAGE
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import source

SETS = [
    (name, plane, external)
    for name in toml_files.built_in("equations")
    for plane in (["horizontal"] if name in ("abkowitz", "mmg") else [None, "horizontal", "vertical"])
    for external in (False, True)
]
compiled_only = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


def families():
    yield from (family(source(load_equations(name), plane, external)) for name, plane, external in SETS)
    yield from user_set.families()


def workspace(kernels, rng):
    """Boats of any kind, ahead, astern and at rest, turning and not, with any controls."""
    work = lane_functions.aligned(kernels.n_rows)
    work[:] = rng.standard_normal(work.shape)
    work[STAGE + 6] = [3.0, -2.0, 0.0, 1.0, 1.0, 5.0, 0.5, 1.0]
    work[STAGE + 7 : STAGE + 9, 3] = 0.0  # no drift
    work[STAGE + 9 : STAGE + 12, 4] = 0.0  # not turning
    work[STAGE + 6 : STAGE + 12, 2] = 0.0
    work[BODY_ROWS : BODY_ROWS + len(BODY)] += 2.0
    work[INVERSE_MASS : INVERSE_MASS + 36] *= 0.1
    work[COEFFICIENTS:] *= 0.5
    return work, rng.standard_normal(kernels.equations.N_CONTROLS)


def results(run, work, control, n_rows):
    """What a unit leaves in a copy of `work` and in rows of its own."""
    written, out = lane_functions.aligned(len(work)), lane_functions.aligned(n_rows)
    written[:] = work
    run(written, control, out, 0.7, 1.3)
    return np.concatenate([written, out])


@compiled_only
@pytest.mark.parametrize("name", UNITS)
def test_machine_code_is_what_numpy_computes(name, rng):
    """Of every unit of every set, sub-problem and kind of controls; they differ by contracted products only."""
    for kernels in families():
        function, of = kernels.lane_function(name), kernels.equations
        work, control = workspace(kernels, rng)
        n_rows = max(of.N_COEFFICIENTS, 6 * of.N_CONTROLS)
        expected = results(lanes.interpreted(function), work, control, n_rows)
        found = results(lane_functions.compiled(function, name, kernels.source), work, control, n_rows)
        size = np.abs(expected).max()
        assert np.abs(found - expected).max() <= 1e-13 * size  # some 300 roundings of parts of the largest
        changed = np.concatenate([work, np.zeros((n_rows, LANES))]) != expected
        assert changed.any() or (name == "slopes" and of.N_CONTROLS == of.ORDERED_SPEED + 1 == 1)


@compiled_only
@pytest.mark.parametrize("width", [2, 4])
def test_vectors_of_any_width_give_the_same_bits(width, rng, monkeypatch, tmp_path):
    monkeypatch.setattr(compiled_files, "folder", lambda: tmp_path)
    kernels = family(source(load_equations("booth"), None))
    work, control = workspace(kernels, rng)
    found = []
    for vectors in (width, 8):
        monkeypatch.setattr(jit, "_width", lambda n=vectors: n)
        unit = lane_functions.compiled(kernels.lane_function("stage"), f"{vectors} at once")
        found.append(results(unit, work, control, 1))
    np.testing.assert_array_equal(*found)


def test_older_llvm_gets_pointers_with_types():
    """LLVM 15, of the oldest numba, and those from 16 on, which know pointers without types only."""
    old = lanes.written(
        lambda given: given.out.__setitem__(0, given.work[1] * given.control[2]), "f", 4, typed_pointers=True
    )
    assert "double* noalias %work" in old
    assert "load <4 x double>, <4 x double>*" in old
    assert " ptr " not in old


def test_a_branch_on_a_value_is_refused():
    """With a remedy, and not by taking one of the branches for all lanes."""
    with pytest.raises(TypeError, match="choose"):
        lanes.written(lambda given: given.work[0] if given.work[0] > 0.0 else given.work[1], "f", 4)


def test_choices_of_tuples_and_of_truths():
    """By parts, by NumPy and in machine code."""

    def function(given):
        x, y = given.work[0], given.work[1]
        larger, smaller = lanes.choose(x > y, (x, y), (y, x))
        between = lanes.choose(x > 0.0, y > 0.0, y < 0.0)
        given.out[0], given.out[1], given.out[2] = larger, smaller, lanes.choose(between, 1.0, 0.0)

    work, out = lane_functions.aligned(2), lane_functions.aligned(3)
    work[0], work[1] = np.arange(-4.0, 4.0), 0.5
    lanes.interpreted(function)(work, np.zeros(1), out, 0.0, 0.0)
    np.testing.assert_array_equal(out[:2], [np.maximum(*work), np.minimum(*work)])
    np.testing.assert_array_equal(out[2], work[0] > 0.0)
    if not numba.config.DISABLE_JIT:
        found = lane_functions.aligned(3)
        lane_functions.compiled(function, "choices")(work, np.zeros(1), found, 0.0, 0.0)
        np.testing.assert_array_equal(found, out)


def test_a_traceback_shows_the_line_of_the_forces():
    """The module of the forces is no file, and can be read in a traceback all the same."""
    kernels = family(source(load_equations("booth"), "horizontal"))
    try:
        kernels.equations.forces([None] * 101, [0.1] * 4, [1.0], *np.ones(6))
    except TypeError:
        text = traceback.format_exc()
    assert "c[0] * (u*u)  # Xuu" in text
    assert "booth" in text

"""Posteriors on disk."""

import os
import subprocess
import sys
import warnings
from dataclasses import replace

import h5py
import matplotlib as mpl
import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.inference.sampling import Posterior, posterior_file
from bayesub.inference.sampling.posterior import JUDGED_STEPS


@pytest.fixture
def posterior(rng):
    """Independent draws, so that every effective sample size is about the number of draws."""
    chain = rng.standard_normal((4, 300, 10, 3)) * [1.0, 2.0, 3.0] + [0.0, 5.0, -5.0]
    return Posterior(
        names=("Xuu", "Yuv", "Nuv"),
        chain=chain,
        log_prob=-0.5 * np.sum(chain**2, axis=-1),
        prior_mean=np.zeros(3),
        prior_sd=np.full(3, 10.0),
        n_warmup=100,
        acceptance=0.5,
        evaluations=16_000,
        seconds=2.0,
        failures={"diverged": 1, "left_envelope": 0},
    )


def test_a_saved_posterior_comes_back_with_the_diagnostics_of_the_whole_chain(posterior, tmp_path):
    posterior_file.save(posterior, tmp_path / "posterior.nc")
    loaded = posterior_file.load(tmp_path / "posterior.nc")
    assert loaded.names == posterior.names
    assert loaded.n_steps == 300
    np.testing.assert_array_equal(loaded.chain, posterior.chain)
    np.testing.assert_array_equal(loaded.log_prob, posterior.log_prob)
    for key in ("tau", "rhat", "bulk_ess", "tail_ess", "prior_mean", "prior_sd"):
        np.testing.assert_array_equal(getattr(loaded, key), getattr(posterior, key))
    assert loaded.failures == posterior.failures
    assert loaded.criteria == posterior.criteria
    assert loaded.converged == posterior.converged


def test_a_long_chain_is_thinned_to_its_last_step(posterior, tmp_path, rng):
    long = Posterior(
        **vars(posterior) | {"chain": rng.standard_normal((4, 1003, 10, 3)), "log_prob": np.zeros((4, 1003, 10))}
    )
    posterior_file.save(long, tmp_path / "posterior.nc")
    loaded = posterior_file.load(tmp_path / "posterior.nc")
    assert loaded.chain.shape[1] <= 2 * JUDGED_STEPS
    np.testing.assert_array_equal(loaded.chain[:, -1], long.chain[:, -1])
    assert loaded.n_steps == 1003


def test_arviz_reads_the_file_and_agrees_on_rhat_and_ess(posterior, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what ArviZ says on import is not ours
        import arviz as az

        posterior_file.save(posterior, tmp_path / "posterior.nc")
        read = az.from_netcdf(str(tmp_path / "posterior.nc"))
        converted = posterior_file.to_arviz(posterior)
        for k, name in enumerate(posterior.names):
            draws = np.asarray(read["posterior"][name])
            assert draws.shape == (4, 3000)
            np.testing.assert_array_equal(draws, np.asarray(converted["posterior"][name]))
            # Both estimate 12,000 independent draws; ESS estimates of white noise scatter by a few per cent.
            assert az.ess(draws) == pytest.approx(posterior.bulk_ess[k], rel=0.15)
            assert az.rhat(draws) == pytest.approx(posterior.rhat[k], abs=0.002)


def test_a_file_that_is_no_posterior_is_one_clear_line(tmp_path):
    (tmp_path / "posterior.nc").write_text("not HDF5")
    with refused("format"):
        posterior_file.load(tmp_path / "posterior.nc")


def test_a_posterior_saves_loads_and_summarises_itself(posterior, tmp_path):
    """The public face: one table a posterior, and a file that comes back with its costs."""
    counted = replace(posterior, jacobians=50, jacobian_price=8.0)
    counted.save(tmp_path / "posterior.nc")
    loaded = Posterior.load(tmp_path / "posterior.nc")
    assert loaded.work == counted.work == 16_400
    table = loaded.summary()
    assert list(table.index) == ["Xuu", "Yuv", "Nuv"]
    assert list(table.columns) == ["mean", "sd", "q5", "median", "q95", "contraction", "rhat", "bulk_ess", "tail_ess"]
    np.testing.assert_array_equal(table["sd"], posterior.sd)
    np.testing.assert_array_equal(table.loc["Yuv", "median"], posterior.quantiles(0.5)[1])


@pytest.mark.slow
def test_the_notice_of_arviz_does_not_reach_the_user(tmp_path):
    """Not even on the first import of the day, and with every warning shown."""
    script = """
import numpy as np
from bayesub.inference.sampling import Posterior
chain = np.random.default_rng(1).standard_normal((4, 60, 4, 1))
posterior = Posterior(("Xuu",), chain, chain[..., 0], np.zeros(1), np.ones(1), 20, 0.5, 100, 1.0, {})
posterior.to_arviz()
"""
    assert output(script, tmp_path / "posterior") == (0, "", "")
    script = """
import numpy as np
from matplotlib.figure import Figure
from bayesub.report.plots.corner import contours
contours(Figure().subplots(), np.random.default_rng(1).uniform(size=(500, 2)))
"""
    assert output(script, tmp_path / "corner") == (0, "", "")


def output(script, home):
    """Exit status and what a process prints in which every warning is shown."""
    home.mkdir()
    environment = os.environ | {"XDG_CACHE_HOME": str(home), "MPLCONFIGDIR": mpl.get_configdir(), "HOME": str(home)}
    words = [sys.executable, "-W", "always::FutureWarning", "-c", script]
    process = subprocess.run(words, env=environment, capture_output=True, text=True)
    return process.returncode, process.stdout, process.stderr


def test_what_was_changed_or_is_no_number_is_named(posterior, tmp_path):
    """Draws, and what convergence is believed from, edited as other programs do; and a file that is cut."""
    path = tmp_path / "posterior.nc"
    posterior_file.save(posterior, path)
    whole = path.read_bytes()
    for group, name, value in (("posterior", "Nuv", -3.0), ("convergence", "rhat", 1.0), ("posterior", "Nuv", np.nan)):
        path.write_bytes(whole)
        with h5py.File(path, "a") as file:
            file[group][name][..., :1] = value
        with refused("format") as error:
            posterior_file.load(path)
        assert str(error.value).startswith(f"{path}: is damaged")
    for content in (whole[: len(whole) // 2], b""):
        path.write_bytes(content)
        with pytest.raises(bs.InputError, match=r"posterior\.nc: is"):
            posterior_file.load(path)


def test_a_damaged_byte_is_seen_before_hdf5_reads_it(posterior, tmp_path, monkeypatch, rng):
    """A structure of HDF5 that is damaged may hang its reader."""
    path = tmp_path / "posterior.nc"
    posterior_file.save(posterior, path)
    whole = bytearray(path.read_bytes())
    monkeypatch.setattr(posterior_file.xr, "open_datatree", lambda *_, **__: pytest.fail("HDF5 was asked"))
    for place in (0, 8, len(whole) - 33 - len(posterior_file.SEAL), *rng.integers(0, len(whole) - 60, 3)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with refused("format"):
            posterior_file.load(path)


def test_a_file_of_before_there_were_digests_is_read(posterior, tmp_path):
    path = tmp_path / "posterior.nc"
    posterior_file.save(posterior, path)
    with h5py.File(path, "a") as file:
        del file["posterior"].attrs[posterior_file.DIGEST]
    np.testing.assert_array_equal(posterior_file.load(path).chain, posterior.chain)

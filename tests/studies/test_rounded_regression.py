"""Regression on rounded motion."""

import numpy as np
import pytest

import bayesub as bs
from rounding import regression
from thesis import cases


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("suboff")


def test_fine_resolutions_leave_the_truth(boat):
    """Rounded to 1e-12 the estimates are the truth; rounded as in the thesis some are many times too large."""
    fine, coarse = (
        regression.trial(boat, 0, resolution, cases.held("coupled")) for resolution in ((1e-12, 1e-12), (0.01, 0.001))
    )
    truth = boat.xi[bs.coefficients.columns(fine["names"])]
    scale = np.where(truth == 0, 1.0, np.abs(truth))
    errors = {name: np.abs(np.array(t["values"]["rounded"]) - truth) / scale for name, t in
              (("fine", fine), ("coarse", coarse))}  # fmt: skip
    assert errors["fine"].max() < 1e-3
    assert errors["coarse"].max() > 3
    assert fine["position_m"] < 1e-3


def test_summary_separates_bias_from_noise(boat, rng):
    """An error that is always the same is biased and one that changes sign is not; both are covered or missed."""
    names = ["Xuu", "Yuv"]
    truth = boat.xi[bs.coefficients.columns(names)]
    errors = np.column_stack([0.5 + 0.01 * rng.standard_normal(100), rng.standard_normal(100)]) * np.abs(truth)
    results = [
        {
            "names": names,
            "values": dict.fromkeys(regression.FITS, (truth + error).tolist()),
            "standard_errors": dict.fromkeys(regression.FITS[:2], np.abs(truth).tolist()),
            "position_m": 1.0,
        }
        for error in errors
    ]
    result = regression.summary(results, boat.xi)
    fit = result["fits"]["rounded"]
    assert regression.biased(fit).tolist() == [True, False]
    assert fit["coverage"][0] == 1.0
    assert fit["coverage"][1] == pytest.approx(0.95, abs=0.09)
    assert "coverage" not in result["fits"]["total least squares"]
    np.testing.assert_allclose(regression.errors(results, boat.xi)["rounded"], errors, atol=1e-15)


def test_a_manoeuvre_without_a_result_is_left_out(boat, monkeypatch):
    monkeypatch.setattr(regression, "trial", lambda _, seed, *__: None if seed == 1 else {"seed": seed})
    results = list(regression.trials(boat, 3, (0.01, 0.001), ()))
    assert [result["seed"] for result in results] == [0, 2]

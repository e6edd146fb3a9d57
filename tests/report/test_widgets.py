"""What the page draws by itself: packed numbers keep their values, correlations and residuals are those of the run."""

import base64
import json

import numpy as np
import pytest
from support.laplace import posterior_of, spiral_problem

from bayesub.findings import derived
from bayesub.findings.results import Results, numbers_of
from bayesub.inference import identifiability
from bayesub.inference.baselines import sqp
from bayesub.report import report, widgets
from bayesub.report.figures import _found, figures


def unpacked(packed):
    """As the script of the page reads it."""
    codes = np.frombuffer(base64.b64decode(packed["codes"]), f"<{packed['kind']}").astype(float)
    none = 2.0 ** (8 * np.dtype(packed["kind"]).itemsize) - 1
    return np.where(codes == none, np.nan, packed["low"] + packed["step"] * codes)


@pytest.fixture(scope="module")
def results(spiral_track):
    problem = spiral_problem(spiral_track)
    posterior = posterior_of(problem, np.random.default_rng(1))
    estimates = [sqp(problem.naive(), rng=np.random.default_rng(3), n_starts=2)]
    spectrum = identifiability.fisher(problem, posterior.best)
    return Results(problem, estimates, spectrum, posterior, None, 1)


@pytest.fixture(scope="module")
def numbers(results):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "N_DRAWS", 16)
        return numbers_of(results)


@pytest.fixture(scope="module")
def content(results):
    return widgets.content(results, results.problem.reference[results.problem.others], "truth")


@pytest.mark.parametrize("kind", ["u2", "u4"])
def test_packed_values_are_right_to_half_a_step(kind, rng):
    values = 1e3 + rng.standard_normal(500)
    values[7] = np.nan
    found, bits = unpacked(widgets.pack(values, kind)), 8 * int(kind[1])
    error = np.abs(found - values)
    assert np.isnan(error[7])
    assert np.nanmax(error) <= 0.5001 * np.ptp(values[~np.isnan(values)]) / (2**bits - 2) + 1e-12
    assert np.nanmax(error) > 0.0


def test_constant_and_missing_values_can_be_packed():
    assert unpacked(widgets.pack([3.0, 3.0])).tolist() == [3.0, 3.0]
    assert np.isnan(unpacked(widgets.pack([np.nan]))).all()


def test_correlations_are_of_what_is_drawn_and_the_same_everywhere(results, numbers, content):
    """Of ratios to the reference: the slope of a pair of opposite signs is not that of its values."""
    pairs, sample, n_coefficients = content["pairs"], results.summary, results.problem.n_coefficients
    n = len(sample.names)
    divisors = np.where(np.arange(n) < n_coefficients, results.problem.reference, 1.0)
    drawn = np.corrcoef((sample.draws / divisors).T)
    assert (drawn * sample.correlation < -0.1).any()
    assert len(pairs["hundredths"]) == n * (n - 1) // 2
    rows, columns = np.tril_indices(n, -1)  # place i (i - 1) / 2 + j, as the script reads it
    np.testing.assert_allclose(np.array(pairs["hundredths"]) / 100, drawn[rows, columns], atol=0.00501)
    some = np.corrcoef([unpacked(packed) for packed in pairs["draws"]])
    for strongest in (*numbers["trade_offs"][:5], *numbers["nuisance_trade_offs"][:2]):
        i, j = map(sample.names.index, strongest["pair"])
        assert strongest["correlation"] == pytest.approx(drawn[i, j], abs=1e-9)
        assert strongest["correlation"] == pytest.approx(some[i, j], abs=0.1)
    captions = captions_of(results)
    i, j = np.unravel_index(np.argmax(np.abs(np.triu(drawn, 1))), drawn.shape)
    words = f"{sample.names[i]} with {sample.names[j]}, correlation {drawn[i, j]:+.2f}"
    assert words in captions["pairs"]
    draws = np.array([unpacked(packed) for packed in pairs["draws"]])
    assert draws.shape == (n, widgets.DRAWS)
    values = draws * np.where(np.arange(n) < results.problem.n_coefficients, results.problem.reference, 1.0)[:, None]
    assert (np.abs(values.mean(axis=1) - sample.mean) < 5.0 * sample.sd / np.sqrt(widgets.DRAWS)).all()


def captions_of(results, baselines=()):
    return {f.name: f.caption for f in figures(results, results.problem.reference, "truth", baselines)}


def test_a_caption_counts_the_tracks_that_are_drawn_and_a_legend_the_searches_that_fit(results, content):
    (trial,) = content["trials"]
    assert f"{len(trial['path']['draws'])} tracks each" in captions_of(results)["fan"]
    for fits, words in (((70.6, 70.61), "none fits"), ((1.0, 1.1), "all fit"), ((1.0, 3.0), "1 fit")):
        sqp = {"method": "SQP", "chi_square_per_reading": fits, "at_bounds": [[], []]}
        assert _found(results, [sqp])[0].label == f"SQP, 2 starts: {words}"


def test_intervals_are_those_of_the_numbers(results, numbers, content):
    rows = content["intervals"]["rows"]
    given_rows = numbers["parameters"] + numbers["nuisance"]
    assert [row["name"] for row in rows] == [row["name"] for row in given_rows]
    n = len(numbers["parameters"])
    assert [row["reference"] is not None for row in rows] == [k < n for k in range(len(rows))]  # of others no ratios
    for row, given in zip(rows, given_rows, strict=True):
        found = [row["posterior"][0], row["posterior"][2], row["posterior"][4]]
        assert found == pytest.approx([given["q5"], given["median"], given["q95"]], rel=1e-6)
        assert row["prior"][0] < given["prior_mean"] < row["prior"][1]
    (search,) = content["intervals"]["sets"]
    assert np.shape(search["values"]) == (n, 2)
    assert np.array(search["values"]) == pytest.approx(results.estimates[0].solutions[:, :n].T, rel=1e-6)


def test_residuals_and_truth_are_minus_the_posterior_mean(results, content):
    (trial,) = content["trials"]
    assert trial["figure"] == "track"
    assert trial["stride"] == 1
    channel, lines = results.problem.record.channels[2], trial["channels"][2]["lines"]
    assert trial["channels"][2]["label"] == "yaw (deg)"
    assert trial["channels"][2]["sd"] == pytest.approx(0.1)
    assert unpacked(trial["channels"][2]["times"]) == pytest.approx(channel.times, abs=1e-6)
    noise = np.degrees(channel.values - results.problem.truth()[0][-len(channel.times) :])
    assert unpacked(lines["residual"]) - unpacked(lines["truth"]) == pytest.approx(noise, abs=1e-4)
    assert (unpacked(lines["low"]) < unpacked(lines["high"])).all()


def test_of_very_many_readings_every_second_or_third_is_drawn(results, monkeypatch):
    monkeypatch.setattr(widgets, "READINGS", len(results.problem.readings) // 3)
    reference = results.problem.reference
    (trial,) = widgets.content(results, reference, "truth")["trials"]
    assert trial["stride"] == 3
    times = results.problem.record.channels[0].times
    assert unpacked(trial["channels"][0]["times"]) == pytest.approx(times[::3], abs=1e-6)


def test_the_content_is_json_without_tags(numbers, content):
    """What a name holds cannot end the script in which it stands."""
    content = json.loads(json.dumps(content, allow_nan=False))
    content["intervals"]["rows"][0]["name"] = "</script><wbr>"
    page = report.page(numbers | {"name": "", "question": "", "seconds": {}}, pictures(), live=content)
    assert page.count("</script>") == page.count("<script") == 4
    assert "<wbr>" not in page


def pictures():
    names = ("coefficients", "criticism", "ladder", "correlation", "directions")
    return dict.fromkeys(names, ("What.", b"picture"))

"""The committed numbers bear out the claims of their studies, and what draws from numbers alone draws again."""

import json
import shutil
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from bayesub.study.run import script
from bayesub.study.run.run_folder import saved_config
from thesis.cases import CASES
from thesis.optimisers import mean_with_error, shares_further

ROOT = Path(__file__).parents[2]
STUDIES = sorted(path.stem for path in (ROOT / "studies").glob("*.py"))
pytestmark = pytest.mark.skipif(not (ROOT / "figures").is_dir(), reason="figures are not part of a source distribution")


def failures(study, numbers):
    """The sentences of the claims that fail."""
    claims = list(script.load(ROOT / "studies" / f"{study}.py").claims(numbers))
    assert claims
    return [sentence for holds, sentence in claims if not holds]


def committed_numbers(study):
    return json.loads((ROOT / "figures" / study / "numbers.json").read_text())


@pytest.mark.parametrize("name", STUDIES)
def test_claims_hold_of_the_committed_numbers(name):
    assert failures(name, committed_numbers(name)) == []


@pytest.mark.parametrize("name", ["criticism", "other_equations", "sampler", "time_step", "wrong_coefficients"])
def test_a_committed_run_is_drawn_again(name, tmp_path):
    """The page says the same, and every figure is there."""
    committed = ROOT / "figures" / name
    for file in committed.glob("*.json"):
        shutil.copy(file, tmp_path)
    result = script.redraw(tmp_path, saved_config(committed), ROOT / "studies" / f"{name}.py")
    assert (result.verdict, result.text) == ("claim holds", "")
    assert (tmp_path / f"{name}.md").read_text() == (committed / f"{name}.md").read_text()
    assert {file.name for file in tmp_path.glob("*.png")} == {file.name for file in committed.glob("*.png")}


def undecided(case, n_starts):
    """The case with so many searches, each of which leaves half of its coefficients further off and half nearer."""
    case = deepcopy(case)
    n = len(case["names"])
    case["sqp"]["starts"] = [[1.1] * n for _ in range(n_starts)]
    case["sqp"]["ratios"] = [[1.2] * (n // 2 + k % 2) + [1.0] * (n - n // 2 - k % 2) for k in range(n_starts)]
    return case


def test_a_few_searches_need_not_decide_what_fifty_must():
    """Three searches about one half contradict nothing; fifty about one half, or three that agree, fail."""
    case = committed_numbers("baselines")["cases"]["auv690 vertical"]
    few, many = ({"cases": {"auv690 vertical": undecided(case, n)}} for n in (3, 50))
    assert failures("baselines", few) == []
    (sentence,) = failures("baselines", many)
    assert sentence.startswith("auv690 vertical: of the coefficients of a search 53% ± 1% end further")
    agreed = undecided(case, 3)
    agreed["sqp"]["ratios"] = [[1.2] * len(case["names"])] * 3
    (sentence,) = failures("baselines", {"cases": {"auv690 vertical": agreed}})
    assert "100% ± 0%" in sentence


def test_the_saved_campaign_decides_every_case():
    """By fifty searches each of the nine cases is decided beyond the 95 % interval of its mean, most beyond twice that.

    Searches end elsewhere with another kernel of the BLAS: the two that are nearest to a half move by their error.
    """
    cases = committed_numbers("baselines")["cases"]
    assert len(cases) == len(CASES)
    decided = np.array([mean_with_error(shares_further(case["sqp"])) for case in cases.values()])
    beyond = np.abs(decided[:, 0] - 0.5) / decided[:, 1]
    assert beyond.min() > 1.0
    assert np.sum(beyond > 2.0) >= 7


def test_linear_programming_without_a_solution_fails_by_name():
    numbers = committed_numbers("baselines")
    case = numbers["cases"]["suboff horizontal"]
    pairs = zip(case["names"], case["errors"]["LP"], strict=True)
    case["errors"]["LP"] = [None if name[0] == "N" else error for name, error in pairs]
    (sentence,) = failures("baselines", numbers)
    assert sentence.startswith("suboff horizontal: linear programming finds no Nuv")


def test_a_posterior_that_has_not_converged_counts_for_nothing():
    """Its case claims nothing, whatever its numbers."""
    numbers = committed_numbers("posteriors")
    case = numbers["suboff vertical"]
    case["inside"]["noisy"]["chi_square"] = 0
    (sentence,) = failures("posteriors", numbers)
    assert sentence == "suboff vertical: 0 of 50 sets from noisy readings fit as well as the posterior"
    case["converged"] = False
    assert failures("posteriors", numbers) == []


def test_five_sets_may_miss_what_fifty_must_reach():
    """Four of five sets contradict no share of nine tenths, two do; of fifty, forty-four are too few."""
    reached = script.load(ROOT / "studies" / "posteriors.py").reached
    assert [reached(count, 5, 0.9) for count in (5, 4, 2)] == [True, True, False]
    assert [reached(count, 50, 0.9) for count in (45, 44)] == [True, False]

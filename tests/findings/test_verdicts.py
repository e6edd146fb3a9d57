"""The verdict on a run: the gravest of what is wrong, each with words and a status of its own that the manual lists."""

import re

import pytest

from bayesub.cli.learn import pages
from bayesub.findings.verdicts import MEANING, STATUS, in_words, verdict_on, worst

RIGHT = {
    "convergence": {"converged": True},
    "criticism": {"fits": True},
    "predictions": [{"predicts": True}],
    "conflict": {"refuted": False},
    "cross_check": {"verdict": "agree"},
}
WRONG = {  # verdict -> the numbers that it follows from
    "in conflict with the prior": {"conflict": {"refuted": True}},
    "contradicts itself": {"rests_on": [{"off": None}, {"off": -5.0}]},
    "does not predict": {"predictions": [{"predicts": True}, {"predicts": False}]},
    "does not fit": {"criticism": {"fits": False}},
    "not confirmed": {"cross_check": {"verdict": "disagree"}},
    "not converged": {"convergence": {"converged": False}},
}


def test_a_run_of_which_nothing_is_wrong():
    assert verdict_on(RIGHT) == "converged and fits"
    assert verdict_on(RIGHT | {"predictions": []}) == "converged and fits"
    assert in_words("converged and fits") == "CONVERGED AND FITS"


@pytest.mark.parametrize("verdict", WRONG)
def test_each_fault_has_its_words_and_with_graver_ones_those_have_the_last_word(verdict):
    assert verdict_on(RIGHT | WRONG[verdict]) == verdict
    assert in_words(verdict) == f"{verdict.upper()}: {MEANING[verdict]}"
    lesser = list(WRONG)[: list(WRONG).index(verdict)]
    together = RIGHT | WRONG[verdict]
    for one in lesser:
        together |= WRONG[one]
    assert verdict_on(together) == verdict


def test_statuses_differ_and_the_manual_lists_them():
    """0 only of what may be used; 1 is an unexpected failure and 2 bad input."""
    bad = {verdict: status for verdict, status in STATUS.items() if status > 2}
    assert len(set(bad.values())) == len(bad) == 8
    assert {verdict for verdict, status in STATUS.items() if status == 0} == {
        "converged and fits",
        "claim holds",
        "skipped",
    }
    rows = dict(re.findall(r"^\| (\d+) \| `([A-Z ]+)`", pages()["commands"].text, flags=re.MULTILINE))
    assert {int(status): words.lower() for status, words in rows.items()} == {s: v for v, s in bad.items()}


def test_the_gravest_of_several():
    assert worst(["claim holds", "does not fit", "skipped"]) == "does not fit"
    assert worst(["not converged", "failed", "claim failed"]) == "failed"

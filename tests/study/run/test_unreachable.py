"""What no run can do is refused by `check` and before anything is sampled."""

import pytest
from support import refusals, small_study

WRONG = {
    "a coefficient twice": ({"free": {"coefficients": ["Xuu", "Yuv", "Xuu"]}}, "conflict", "free"),
    "too few ensembles for R-hat": ({"sampler": {"n_ensembles": 3}}, "value", "sampler.n_ensembles"),
    "more than judged steps hold": ({"sampler": {"ess": 40_000.0}}, "value", "sampler.ess"),
    "more than eight walkers hold": (
        {"prior": {"kind": "relative_uniform", "half_width": 0.5, "sd": None}, "sampler": {"ess": 8_000.0}},
        "value",
        "sampler.ess",
    ),
    "more times than judged steps": ({"sampler": {"taus": 200.0}}, "value", "sampler.taus"),
    "no vehicle": ({"vehicle": None}, "missing", "vehicle"),
}


@pytest.mark.parametrize(("changes", "kind", "key"), WRONG.values(), ids=WRONG)
def test_a_study_that_no_run_ends_well(changes, kind, key, tmp_path, bayesub):
    (tmp_path / "s.toml").write_text(small_study.text(**changes))
    for words in (["check", tmp_path / "s.toml"], ["run", tmp_path / "s.toml", "-o", tmp_path / "run"]):
        status, _, err = bayesub(*map(str, words))
        assert (status, err.count("\n")) == (2, 1)
        refusals.check(bayesub.error, kind, key)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("quick", "kind", "key"),
    [({"foo": 1}, "unknown", "foo"), ({"sampler": {"n_ensembles": 2}}, "value", "sampler.n_ensembles")],
)
def test_the_quick_version_is_checked_too(quick, kind, key, tmp_path, bayesub):
    (tmp_path / "s.toml").write_text(small_study.text(quick=quick))
    assert bayesub("check", str(tmp_path / "s.toml"))[0] == 2
    refusals.check(bayesub.error, kind, key)


@pytest.mark.parametrize("sampler", [{"ess": 40_000.0, "n_walkers": 64}, {"ess": 8_000.0}])
def test_more_walkers_hold_more(sampler, tmp_path, bayesub):
    (tmp_path / "s.toml").write_text(small_study.text(sampler=sampler))
    assert bayesub("check", str(tmp_path / "s.toml"))[0] == 0


@pytest.mark.parametrize(
    "text", ["duration_s = 100.0\n", "depth_change_m = 3.0\nrudder_deg = 10.0\nrudder_degps = 4.0\n"]
)
def test_limits_are_known_by_any_key(text, tmp_path, bayesub):
    (tmp_path / "limits.toml").write_text(text)
    status, out, _ = bayesub("check", str(tmp_path / "limits.toml"))
    assert (status, "limits of a trial" in out) == (0, True)
    (tmp_path / "limits.toml").write_text(text + "duratoin_s = 100.0\n")
    assert bayesub("check", str(tmp_path / "limits.toml"))[0] == 2
    refusals.check(bayesub.error, "unknown", "duratoin_s")


@pytest.mark.parametrize("name", ["trial.mat", "trial.parquet", "trial.jsonl"])
def test_what_is_to_be_converted_first(name, tmp_path, bayesub):
    (tmp_path / name).write_bytes(bytes(range(256)))
    assert bayesub("check", str(tmp_path / name))[0] == 2
    refusals.check(bayesub.error, "format")
    assert "bayesub convert" in str(bayesub.error)

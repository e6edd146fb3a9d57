"""The study with the lines that its residuals ask for."""

import pytest
from support import small_study

from bayesub.study.run.infer import suggest
from bayesub.study.schema.study_file import load_study

LINES = {
    "bias": ("[nuisance]\nbias_yaw_deg = { mean = 0.0, sd = 2.0 }\n", "nuisance", {"bias_yaw_deg", "x0_m"}),
    "coefficient": ('[free]\ncoefficients = ["Xuu"]\n', "free", {"coefficients"}),
    "slow noise": ('[noise.x_m]\nkind = "ar1"\nsd = 0.2\ncorrelation_time_s = 4.0\n', "noise", {"x_m", "y_m"}),
    "disturbance": (
        '[disturbance]\naxes = ["X"]\nsd = { X = { median = 0.1, log_sd = 0.7 } }\ncorrelation_time_s = 4.0\n',
        "disturbance",
        {"axes", "sd", "correlation_time_s"},
    ),
}
HAS = {
    "noise": {"x_m": {"kind": "student_t", "dof": 4.0}, "y_m": {"kind": "unknown_sd"}},
    "nuisance": {"x0_m": {"mean": 0.0, "sd": 1.0}},
}


@pytest.mark.parametrize("kind", LINES)
def test_it_is_read_with_the_lines_and_names_the_same_files(tmp_path, kind):
    """Sections that the study has are joined; of a noise model that is replaced no key is left."""
    lines, section, keys = LINES[kind]
    (tmp_path / "run").mkdir()
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "turn.csv").write_text("time_s,rudder_deg\n0,0\n60,5\n")
    source = small_study.write(tmp_path / "own" / "study.toml", manoeuvre="turn.csv", **HAS)
    source.write_text(f"# why\n{source.read_text()}")
    study = load_study(source)
    file = suggest(study, lines, tmp_path / "run")
    again = load_study(file)
    assert file.read_text().startswith("# why\n")
    assert again.manoeuvre == "../own/turn.csv"
    assert again.path(again.manoeuvre) == study.path("turn.csv")
    assert set(again.model_dump(exclude_none=True)[section]) >= keys
    assert again.noise["y_m"] == study.noise["y_m"]
    if kind == "slow noise":
        assert "dof" not in str(again.noise["x_m"])

"""The page of our numbers beside the thesis's: it has every row, every path leads somewhere, and nothing is typed."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from thesis import cases as thesis
from thesis import counterparts, page
from thesis.counterparts import NONE, NOT_KEPT, NOT_RUN, Entry

FIGURES = Path(__file__).parents[2] / "figures"
CONTENT = counterparts.load()
SECTIONS, BEYOND = CONTENT.sections, CONTENT.beyond
committed = pytest.mark.skipif(not FIGURES.is_dir(), reason="figures are not part of a source distribution")


def all_rows(folder):
    """Row by its path in the thesis's numbers; those of sections that stand a second time are not among them."""
    sections = {name: section for name, section in SECTIONS.items() if not section.of}
    return {row.path: row for name, section in sections.items() for row in counterparts.rows(folder, name, section)}


def planted(folder, study, numbers):
    """A folder of runs with one study of these numbers."""
    (folder / study).mkdir(parents=True, exist_ok=True)
    (folder / study / "numbers.json").write_text(json.dumps(numbers))
    return folder


def test_every_row_of_the_thesis_has_a_counterpart_or_a_reason(tmp_path):
    found = all_rows(tmp_path)
    assert set(found) == {path for path, _ in counterparts.leaves(thesis.published())}
    for path, row in found.items():
        assert row.ours in (NOT_RUN, NONE), path
        assert row.sentence.endswith("."), path
        assert (row.ours == NONE) == row.sentence.startswith("No counterpart: "), path


def test_every_legible_row_of_every_table_is_there():
    """Rows are counted table by table against what the scan leaves; the others are of the text, and all are in one."""
    tables = thesis.legible()
    rows = ["/".join(path) for path, _ in counterparts.leaves(thesis.published())]
    text = tables.pop("text")
    assert set(tables) >= {"1", "2", "3", "4", "5", "6-8", "9", "28", "29", "30-32", "34-36", "37-39", "IFAC 1"}
    counted = []
    for name, table in tables.items():
        own = [row for row in rows if any(row.startswith(f"{place}/") for place in table["at"])]
        assert len(own) == table["legible"] <= table["rows"], name
        counted += own
    rest = [row for row in rows if any(row == place or row.startswith(f"{place}/") for place in text)]
    assert sorted(counted + rest) == sorted(rows)
    assert len(rows) > 150


def test_a_row_has_a_legible_number():
    for path, values in counterparts.leaves(thesis.published()):
        assert any(isinstance(v, str) or not np.isnan(v) for v in values), path


def test_every_entry_is_some_rows_own():
    for name, section in SECTIONS.items():
        paths = [path for path, _ in counterparts.leaves(thesis.published()[section.of or name])]
        owners = {next(e.thesis for e in section.rows if e.keys(path) is not None) for path in paths}
        assert owners == {entry.thesis for entry in section.rows}, name


@committed
def test_every_path_leads_to_a_number_of_its_study():
    for name, section in SECTIONS.items():
        for row in counterparts.rows(FIGURES, name, section):
            assert row.ours != NOT_KEPT, row.path
            study = row.entry.study or section.study
            run = (FIGURES / study / "numbers.json").is_file()
            assert (row.ours == NOT_RUN) == (bool(study and row.entry.ours) and not run), row.path


@committed
def test_every_link_leads_somewhere_and_every_figure_is_drawn():
    links = re.findall(r"\]\(([^)]+)\)", page.page(FIGURES))
    assert len(links) > len(SECTIONS)
    for link in links:
        assert (FIGURES / link).exists(), link
    for section in SECTIONS.values():
        if (FIGURES / section.study / "numbers.json").is_file():
            for file in section.figures.values():
                assert (FIGURES / (file if "/" in file else f"{section.study}/{file}")).is_file(), file
    for file in CONTENT.figures.values():
        assert (FIGURES / file).is_file(), file


@committed
def test_the_committed_page_is_that_of_the_committed_numbers():
    text = (FIGURES / "README.md").read_text(encoding="utf-8")
    assert text == page.page(FIGURES), "python studies/thesis figures writes it anew"


def test_ratios_are_of_what_the_study_found(tmp_path):
    """Twice the thesis's numbers, in metres for its millimetres, have ratios of two; the mean is over searches."""
    published = thesis.published()["sqp"]["horizontal"]
    cases = {}
    for k, vehicle in enumerate(thesis.VEHICLES):
        cases[f"{vehicle} horizontal"] = {
            "names": ["a", "b", "c"],
            "sqp": {
                "position_m": [2e-3 * x * published["mean_max_position_error_mm"][k] for x in (0.5, 1.0, 1.5)],
                "costs": [2 * published["mean_converged_cost"][k], None],
                "initial_costs": [2e5 * published["mean_converged_cost"][k]],
                "efforts": [90, 150],
            },
        }
    found = all_rows(planted(tmp_path, "baselines", {"cases": cases}))
    for key in ("mean_max_position_error_mm", "mean_converged_cost"):
        assert found["sqp", "horizontal", key].ratios == pytest.approx([2.0] * 3, rel=1e-12)
    row = found["sqp", "horizontal", "mean_max_position_error_mm"]
    lengths = [bs.load_vehicle(vehicle).length_m for vehicle in thesis.VEHICLES]
    assert row.scaled_ratios == pytest.approx([2.0 * lengths[0] / length for length in lengths], rel=1e-12)
    assert found["sqp", "horizontal", "orders_of_reduction"].ours == pytest.approx([5.0] * 3, rel=1e-12)
    assert found["sqp", "horizontal", "evaluations_per_coefficient"].ours == [40.0] * 3
    assert found["sqp", "horizontal", "m"].ours == [3, 3, 3]
    assert found["sqp", "horizontal", "m"].ratios == []
    assert found["sqp", "horizontal", "mean_seconds"].ours == NOT_KEPT
    assert found["prediction", "all", "max"].ours == NOT_RUN


def test_lengths_scale_and_fewer_numbers_of_the_thesis_are_compared_by_means(tmp_path):
    """Boats that err by the same share of their length err alike on a boat as long as suboff."""
    boats = {name: bs.load_vehicle(name) for name in thesis.VEHICLES}
    errors = {f"{name} horizontal": {"hold": {"position_m": {"0.1": 0.01 * b.length_m}}} for name, b in boats.items()}
    row = all_rows(planted(tmp_path, "time_step", errors))["time_step", "max_position_error_m", "horizontal", "0.1"]
    length = boats["suboff"].length_m
    assert row.ours == pytest.approx([0.01 * length] * 3, rel=1e-12)
    assert row.thesis == [0.688, 0.695]
    assert row.ratios == pytest.approx([0.01 * length / 0.6915], rel=1e-12)


def test_one_number_of_the_thesis_has_a_percentile_among_fifty_of_ours(tmp_path):
    costs = {"case1": {"starting_cost": [1e8, 2e8, 3e8, 4e8]}, "case3": {"starting_cost": [1e8]}}
    row = all_rows(planted(tmp_path, "ifac_2003", costs))["ifac_2003", "starting_cost", "case1"]
    assert row.percentile == 75.0
    assert row.ratios == []
    assert "| 3.3e+08 | 2.5e+08 (1.15e+08 to 3.85e+08) | thesis's at 75 % |" in page.page(tmp_path)


def test_what_the_scan_has_lost_is_a_dash_and_has_no_ratio(tmp_path):
    keys = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r", "cost")
    numbers = {"between": {v: {"other convention": dict.fromkeys(keys, 1.14)} for v in thesis.VEHICLES}}
    text = page.page(planted(tmp_path, "simulators", numbers))
    assert "| 0.57, -, 0.108 | 1.14, 1.14, 1.14 | 2, -, 11 |" in text


def test_words_have_no_ratio(tmp_path):
    numbers = {"cases": {"one": {"LP": {"errors": {"Xuu": 1e-9, "Yuv": 3e-8}}}}}
    row = all_rows(planted(tmp_path, "linear", numbers))["linear_programming", "relative_error"]
    assert row.ours == [3e-8]
    assert row.ratios == []


@pytest.mark.parametrize(
    ("path", "values"),
    [("a/*/c", [1, 2, 3]), ("a/x/c", [1, 2]), ("b", [4]), ("a/z", None), ("b/c", None), ("d", None)],
)
def test_paths_take_lists_apart_and_do_not_invent(path, values):
    numbers = {"a": {"x": {"c": [1, [2, None]]}, "y": {"c": 3}}, "b": 4, "d": [None]}
    if values is None:
        with pytest.raises(KeyError):
            counterparts.at(numbers, path)
    else:
        assert counterparts.at(numbers, path) == values


def test_a_star_is_one_key():
    entry = Entry("m/*/*", "{0} {1}", "")
    assert entry.keys(("m", "horizontal", "0.1")) == ["horizontal", "0.1"]
    assert entry.keys(("m", "horizontal")) is None
    assert entry.keys(("n", "horizontal", "0.1")) is None


def test_a_study_is_picked_up_when_it_has_run(tmp_path):
    """Before, the page says so; no number of another folder gets there."""
    planted(tmp_path, "uniqueness", {})
    assert f"| wrong_coefficients | {BEYOND['wrong_coefficients']} | {NOT_RUN} |" in page.page(tmp_path)
    extremes = {"max": 431.2, "mean": 1.0, "median": 1.0, "min": 1.0}
    kinds = dict.fromkeys(("best", "middle", "worst", "random", "simulation"), extremes)
    numbers = {"all": extremes, "cost": extremes, "kinds": kinds}
    planted(tmp_path, "prediction", dict.fromkeys(thesis.VEHICLES, numbers))
    for name in ("wrong_coefficients", "towing"):
        planted(tmp_path, name, {})
        (tmp_path / name / "config.toml").write_text(f'question = "Why {name}?"\n')
    (tmp_path / "towing" / "seconds.json").write_text('{"seconds": 3720}')
    command = Path(page.__file__).parent
    done = subprocess.run([sys.executable, command, tmp_path], capture_output=True, text=True, check=True)
    assert done.stdout == f"beside the thesis: {tmp_path / 'README.md'}\n"
    text = (tmp_path / "README.md").read_text()
    assert "| 215.6, 113.7, 88.56 | 431, " in text
    assert "| 2, " in text
    assert "| [wrong_coefficients](wrong_coefficients) |" in text
    assert "| [towing](towing) |  | Why towing? |" in text
    assert "1 of 2 runs: 1 h 02 min together. Those that claim seconds ran alone on two cores" in text
    assert "| towing: 1 h 02 min |  |  |  |" in text


def test_a_folder_without_the_thesiss_studies_and_another_readme_are_left_alone(tmp_path):
    planted(tmp_path, "mine", {})
    assert page.write(tmp_path) is None
    planted(tmp_path, "uniqueness", {})
    (tmp_path / "README.md").write_text("# My runs\n")
    with refused("file", "README.md"):
        page.write(tmp_path)
    assert (tmp_path / "README.md").read_text() == "# My runs\n"


def test_damaged_numbers_are_named(tmp_path):
    planted(tmp_path, "uniqueness", {})
    (tmp_path / "uniqueness" / "numbers.json").write_text("{")
    with refused("format", "numbers.json"):
        page.write(tmp_path)


def test_quantities_stand_beside_the_thesis():
    """Ours, the thesis's and the ratio; ours alone where the thesis has none."""
    assert counterparts.comparison(3.0, 2.0) == "3 / 2 = 1.5"
    assert counterparts.comparison(3.0, None) == "3"

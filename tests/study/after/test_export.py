"""`bayesub export`: the formats of a finished run, read back by others' libraries, and bad input in a line."""

import csv
import json
import re
import shutil
import sys
from dataclasses import replace

import arviz as az
import matplotlib.mathtext
import numpy as np
import pandas as pd
import pytest
from support import refusals, small_study

import bayesub as bs
from bayesub.findings.verdicts import STATUS
from bayesub.report.parameter_tables import regressor_latex, rounded
from bayesub.study.after.export import FORMATS
from bayesub.study.after.finished_run import finished_run
from bayesub.study.run import infer

STUDY = small_study.SUBOFF | {
    "manoeuvre": "zigzag_20_20",
    "sensors": [small_study.track(position_sd_m=0.5, interval_s=10.0)],
    "free": {"coefficients": ["Xuu", "Yuv", "Nuv", "Nur", "Yv_absnu"]},
    "nuisance": {"current_north_mps": {"mean": 0.0, "sd": 0.3}},
    "prior": {"sd": 0.2},
    "baselines": {"sqp_starts": 0, "linear_least_squares": False},
    "sampler": {"ess": 100.0},
}
NAMES = ("Xuu", "Yuv", "Nuv", "Nur", "Yv_absnu", "current_north_mps")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a finished run without a report."""
    folder = tmp_path_factory.mktemp("run")
    path = small_study.write(folder / "small.toml", **STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            infer, "write_report", lambda *_, **__: {"verdict": {}, "outcome": {"verdict": "converged and fits"}}
        )
        result = bs.run(path, folder / "small")
    assert result.verdict == "converged and fits"
    return folder / "small"


@pytest.fixture
def exported(run, tmp_path, bayesub):
    """exported(file name, options): the file, which is written anew; status 0 and a line that names it."""

    def export(name, *options):
        path = tmp_path / name
        status, out, err = bayesub("export", run, "-o", path, *options)
        assert (status, err) == (0, "")
        assert out.startswith(f"{path}: ")
        assert ("normal" in " ".join(out.splitlines()[1:])) == name.endswith(".toml")  # which is one
        return path

    return export


def test_every_format_is_a_choice_of_the_command(bayesub):
    _, out, _ = bayesub("export", "--help")
    assert f"[{'|'.join(FORMATS)}]" in "".join(out.split())
    assert "Example: bayesub export" in out


def test_draws_are_those_of_the_posterior(run, exported):
    """CSV, Parquet and NetCDF hold the same numbers; CSV to the last bit, by the reader of another library."""
    posterior = finished_run(run).posterior
    with exported("draws.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["chain", "walker", "log_prob", *NAMES]
    plain = np.array(rows, dtype=float)
    np.testing.assert_array_equal(plain[:, 3:], posterior.draws)
    np.testing.assert_array_equal(plain[:, 2], posterior.log_prob.ravel())
    np.testing.assert_array_equal(np.unique(plain[:, 0]), np.arange(len(posterior.chain)))
    one = plain[(plain[:, 0] == 1) & (plain[:, 1] == 3), 3:]
    np.testing.assert_array_equal(one, posterior.chain[1, :, 3])
    parquet = pd.read_parquet(exported("draws.parquet"))
    np.testing.assert_array_equal(parquet.to_numpy(), plain)
    tree = az.from_netcdf(exported("draws.nc"))
    np.testing.assert_array_equal(np.sort(tree["posterior"]["Nur"].values.ravel()), np.sort(plain[:, 3 + 3]))


def test_the_vehicle_file_is_a_prior(run, exported, tmp_path, bayesub):
    """Of the mean, sd and correlation of the draws; `check` of a study that starts from it says what it costs."""
    posterior, path = finished_run(run).posterior, exported("known.toml")
    vehicle = bs.load_vehicle(path)
    places = vehicle.equations.columns(NAMES[:5])
    np.testing.assert_allclose(vehicle.xi[places], posterior.mean[:5], rtol=1e-12)
    np.testing.assert_allclose(vehicle.sd[places], posterior.sd[:5], rtol=1e-12)
    np.testing.assert_allclose(vehicle.correlation[np.ix_(places, places)], posterior.correlation[:5, :5], atol=1e-12)
    assert "Integrated out: current_north_mps." in path.read_text()
    prior = bs.priors.from_vehicle(vehicle).on(places, vehicle.xi, vehicle.equations)
    np.testing.assert_allclose(prior.sd, posterior.sd[:5], rtol=1e-12)
    second = STUDY | {"vehicle": "known.toml", "prior": {"kind": "vehicle", "sd": None}}
    status, out, err = bayesub("check", small_study.write(tmp_path / "second.toml", **second))
    assert (status, err) == (0, "")
    assert "known.toml" in out or "second" in out


def test_tables(run, exported):
    """Digits follow the sd; every formula is one that a TeX parser takes."""
    posterior = finished_run(run).posterior
    lines = exported("table.md").read_text().splitlines()
    assert [line.count("|") for line in lines] == [7] * (2 + len(NAMES))
    for name, mean, sd, line in zip(NAMES, posterior.mean, posterior.sd, lines[2:], strict=True):
        assert name in line
        found = re.match(r"\(?([-\d.]+) ± ([-\d.]+)\)?(?:e(-?\d+))?", line.split("|")[4].strip())
        scale = 10.0 ** int(found[3] or 0)
        assert float(found[1]) * scale == pytest.approx(mean, abs=0.06 * sd)
        assert float(found[2]) * scale == pytest.approx(sd, rel=0.06)
        assert len(found[1].partition(".")[2]) == len(found[2].partition(".")[2])
    tex = exported("table.tex").read_text()
    assert tex.count(r" \\") == 1 + len(NAMES)
    assert r"\texttt{current\_north\_mps}" in tex
    parser = matplotlib.mathtext.MathTextParser("path")
    formulas = re.findall(r"\$[^$]+\$", tex)
    assert len(formulas) == 5 * 5 + 3
    for formula in formulas:
        parser.parse(formula)


def test_rounding_and_regressors():
    assert rounded([-0.0010013, -0.0009984], 9.1e-7) == (["-1.00130", "-0.99840"], -3)
    assert rounded([123.456, 7.0], 0.5) == (["123.46", "7.00"], 0)
    assert rounded([0.0, 0.0], 0.0) == (["0", "0"], 0)
    assert regressor_latex("u*abs(r)*dr") == r"u \left|r\right| \delta_{r}"
    assert regressor_latex("sgn(v)*nu*v^3") == r"\mathrm{sgn}(v) \nu v^{3}"
    parser = matplotlib.mathtext.MathTextParser("path")
    for name in ("booth", "feldman", "glider", "remus", "abkowitz"):
        for term in bs.load_equations(name).terms:
            parser.parse(f"${regressor_latex(term.regressor)}$")


REFUSED = [
    ("known.xyz", (), "unknown", "--as"),
    ("known", (), "unknown", "--as"),
    ("nowhere/known.toml", (), "file", ""),
    ("nowhere/draws.csv", (), "file", ""),
    ("nowhere/draws.nc", (), "file", ""),
    ("nowhere/draws.parquet", (), "file", ""),
]


@pytest.mark.parametrize(("name", "options", "kind", "key"), REFUSED)
def test_files_that_cannot_be_are_refused_in_a_line(run, tmp_path, bayesub, name, options, kind, key):
    status, _, err = bayesub("export", run, "-o", tmp_path / name, *options)
    assert status == 2
    refusals.check(bayesub.error, kind, key)
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_folders_that_are_no_finished_run(run, tmp_path, bayesub):
    """Each in a line, and nothing is written."""
    copies = {name: tmp_path / name for name in ("unfinished", "old", "script", "drawless", "broken", "damaged")}
    for copy in copies.values():
        shutil.copytree(run, copy)
    (copies["unfinished"] / "outcome.json").unlink()
    (copies["drawless"] / "posterior.nc").unlink()
    (copies["damaged"] / "posterior.nc").write_bytes(b"no NetCDF")
    config = (run / "config.toml").read_text()
    (copies["old"] / "config.toml").write_text(re.sub("(?m)^sources_sha256.*$", "", config))
    (copies["script"] / "config.toml").write_text(f'script_sha256 = "1"\n{config}')
    (copies["broken"] / "config.toml").write_text("name = ")
    (tmp_path / "empty").mkdir()
    expected = (
        ("empty", "state", "config.toml"),
        ("missing", "state", "config.toml"),
        ("unfinished", "state", ""),
        ("old", "state", ""),
        ("script", "state", ""),
        ("drawless", "state", "posterior.nc"),
        ("broken", "format", ""),
        ("damaged", "format", "posterior.nc"),
    )
    for name, kind, key in expected:
        status, out, err = bayesub("export", tmp_path / name, "-o", tmp_path / "known.toml")
        assert (status, out) == (2, "")
        refusals.check(bayesub.error, kind, key)
        assert err.count("\n") == 1
    assert not (tmp_path / "known.toml").exists()
    assert bayesub("export", run, "-o", run / "posterior.nc")[0] == 2
    refusals.check(bayesub.error, "conflict", "-o")
    status, _, err = bayesub("export", run, "-o", tmp_path / "x.toml", "--as", "excel")
    assert status == 2
    assert "'excel' is not one of" in err


def test_a_posterior_that_has_not_converged_is_said_so(run, tmp_path, bayesub, monkeypatch):
    """It is written, with the reason in the file and on the last line, and the status is that of its verdict."""
    from bayesub.study.after import export as exports

    finished = finished_run(run)
    short = replace(finished, posterior=replace(finished.posterior, criteria=bs.Criteria(ess=1e7)))
    monkeypatch.setattr(exports, "finished_run", lambda _: short)
    status, out, _ = bayesub("export", run, "-o", tmp_path / "known.toml")
    assert status == STATUS["not converged"]
    assert out.splitlines()[-1].startswith("NOT CONVERGED: ")
    assert (tmp_path / "known.toml").read_text().startswith("# NOT CONVERGED: ")


def test_the_function_writes_what_the_command_writes(run, exported, tmp_path):
    """With what the command says of the run; a format that is none is refused with those that are."""
    finished = bs.export(str(run), str(tmp_path / "draws.dat"), kind="csv")
    assert (tmp_path / "draws.dat").read_bytes() == exported("draws.csv").read_bytes()
    assert finished.posterior.names == NAMES
    assert finished.vehicle.name == "suboff"
    with refusals.refused("unknown", "--as"):
        bs.export(run, tmp_path / "other.csv", kind="netcfd")
    assert not (tmp_path / "other.csv").exists()


def test_parquet_without_its_library_is_refused_in_a_line(run, tmp_path, bayesub, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert bayesub("export", run, "-o", tmp_path / "draws.parquet")[0] == 2
    refusals.check(bayesub.error, "install", "pyarrow")


def test_the_suffix_gives_way_to_the_option(exported):
    assert json.loads(exported("boat.txt", "--as", "mss-json").read_text())["name"] == "suboff"


def test_a_fleet_is_draws_of_the_posterior(run, tmp_path, bayesub):
    """Each file has the coefficients of the draw that it names; the same seed gives the same files, another others."""
    posterior, vehicle = finished_run(run).posterior, finished_run(run).vehicle

    def fleet(name, seed):
        status, out, err = bayesub("export", run, "-o", tmp_path / name / "boat.m", "--fleet", 10, "--seed", seed)
        assert (status, err) == (0, "")
        assert "10 draws" in out
        return [file.read_text() for file in sorted((tmp_path / name).iterdir())]

    for name in ("one", "again", "other"):
        (tmp_path / name).mkdir()
    one = fleet("one", 4)
    assert [file.name for file in sorted((tmp_path / "one").iterdir())] == [f"boat_{k:02d}.m" for k in range(1, 11)]
    assert one == fleet("again", 4)
    assert not set(one) & set(fleet("other", 5))
    rows = []
    for text in one:
        rows.append(int(re.search(r"draw (\d+) of the posterior, \d+ of 10 by the seed 4", text)[1]))
        value = float(re.search(r"vehicle\.Nv\s*= (\S+);", text)[1])
        assert value == pytest.approx(posterior.draws[rows[-1], NAMES.index("Nuv")], rel=1e-8)
        assert f"vehicle.rho = {vehicle.water_density_kgm3:g};" in text
        assert "on turning_circle, vertical and coupled; without all" in text
    assert len(set(rows)) == 10
    status, _, err = bayesub("export", run, "-o", tmp_path / "draws.csv", "--fleet", 2)
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "conflict", "--fleet")
    status, _, err = bayesub("export", run, "-o", tmp_path / "boat.sdf", "--fleet", len(posterior.draws) + 1)
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "limit", "--fleet")
    assert not (tmp_path / "boat.sdf").exists()


@pytest.mark.parametrize(("fleet", "key"), [(-1, "--fleet"), (2.5, "--fleet"), ("3", "fleet")])
def test_a_fleet_that_is_no_number_of_draws_is_refused(run, tmp_path, fleet, key):
    with refusals.refused("value", key):
        bs.export(run, tmp_path / "boat.m", fleet=fleet)
    assert not list(tmp_path.iterdir())


def test_the_body_that_was_inferred_is_in_the_files_and_what_else_was_is_named(finished, tmp_path, bayesub):
    """Mass and inertia are posterior means, and of a fleet those of the draw; a scale of the rudder is said to lack."""
    body = {"mass_kg": {"mean": 1700.0, "sd": 50.0}, "Izz_kgm2": {"mean": 5500.0, "sd": 200.0}}
    folder = finished("loaded", nuisance=body | {"scale_rudder": {"mean": 1.0, "sd": 0.05}})
    posterior = finished_run(folder).posterior
    places = [posterior.names.index(name) for name in body]

    def told(text):
        matrix = np.array(re.search(r"vehicle\.MRB = \[(.*?)\]", text, flags=re.DOTALL)[1].split(), float).reshape(6, 6)
        return matrix[0, 0], matrix[5, 5]

    for options in ((), ("--fleet", 3)):
        status, out, err = bayesub("export", folder, "-o", tmp_path / "boat.m", *options)
        assert (status, err) == (0, "")
        assert "of what was inferred it has not: scale_rudder" in out
    text = (tmp_path / "boat.m").read_text()
    assert told(text) == pytest.approx(posterior.mean[places], rel=1e-8)
    assert "scale_rudder" in text
    for k in (1, 2, 3):
        text = (tmp_path / f"boat_{k}.m").read_text()
        row = int(re.search(r"draw (\d+) of the posterior", text)[1])
        assert told(text) == pytest.approx(posterior.draws[row][places], rel=1e-8)


def test_what_is_fixed_in_a_run_is_fixed_in_the_files(exported, monkeypatch):
    """A coefficient that the prior of the study fixes has that value for a simulator, not the one of the vehicle."""
    from bayesub.study.after import export as exports

    monkeypatch.setattr(exports, "prior_of", lambda _: (None, {"Yur": 0.0123}))
    assert re.search(r"vehicle\.Yr\s*= 0\.0123;", exported("boat.m").read_text())


@pytest.mark.parametrize("command", ["export RUN -o known.toml", "predict RUN zigzag_20_20 -o p", "report RUN"])
@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("posterior.nc", None),  # draws that were changed, with a digest of their own
        ("estimates.json", b"{}"),
        ("outcome.json", b""),
        ("outcome.json", b"[]"),
        ("outcome.json", b'{"good": true, "name": "small"}'),
    ],
)
def test_a_run_whose_files_were_changed_is_refused(run, tmp_path, monkeypatch, bayesub, command, file, content):
    """In a line that names the file; what a report, an export or a prediction says is of the draws of the run."""
    monkeypatch.chdir(tmp_path)
    copied = shutil.copytree(run, tmp_path / "copied")
    (copied / "numbers.json").write_text('{"seconds": {}}')
    if content is None:
        posterior = finished_run(run).posterior
        replace(posterior, chain=1.5 * posterior.chain).save(copied / file)
    else:
        (copied / file).write_bytes(content)
    status, _, error = bayesub(*(copied if word == "RUN" else word for word in command.split()))
    assert (status, error.count("\n")) == (2, 1)
    assert f"{copied}: {file} is damaged" in error

"""Captive model tests: the posterior of a table is that of textbook regression, and a vehicle file passes it on."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.design.captive import SD, known_by

FREE = ("Yuv", "Yuu_dr", "Nuv", "Nuu_dr", "Xuu")
DRIFTS, RUDDERS = np.radians([-12.0, -8.0, -4.0, 4.0, 8.0, 12.0]), (-20.0, 0.0, 20.0)


@pytest.fixture(scope="module")
def simple(suboff):
    """A boat with five coefficients, one of which the file knows to a tenth."""
    xi = np.where([name in FREE for name in suboff.equations.names], suboff.xi, 0.0)
    sd = np.full(len(xi), np.nan)
    sd[suboff.equations.index["Yuv"]] = 0.1 * abs(xi[suboff.equations.index["Yuv"]])
    return replace(suboff, xi=xi, sd=sd)


def towed(boat, rng, size, *, seen=True):
    """Lines of a table of oblique tows with errors: forces by the formulas of a textbook, for one value of the rest."""
    c = dict(zip(boat.equations.names, boat.xi.tolist(), strict=True))
    sds = ",Y_prime_sd,N_prime_sd" if seen else ""
    lines = [f"run,u_prime,v_prime,rudder_deg,Y_prime,N_prime{sds}"]
    for drift in DRIFTS:
        for rudder in RUDDERS:
            u, v, dr = np.cos(drift), -np.sin(drift), np.radians(rudder)
            forces = [
                c["Yuv"] * u * v + c["Yuu_dr"] * u * u * dr + size * rng.standard_normal(),
                c["Nuv"] * u * v + c["Nuu_dr"] * u * u * dr + 0.3 * size * rng.standard_normal(),
            ]
            cells = [u, v, rudder, *forces, *([size, 0.3 * size] if seen else [])]
            lines.append(",".join(["tow", *(repr(float(cell)) for cell in cells)]))
    return lines


def written(path, lines):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="surrogateescape")
    return path


def test_the_posterior_is_that_of_a_textbook(simple, tmp_path, rng):
    """Bayesian regression of two coefficients at a time, by normal equations; drag, without a force, is left out."""
    path = written(tmp_path / "runs.csv", towed(simple, rng, 1e-3))
    known, before, words = known_by(simple, path)
    assert set(known.names) == set(FREE[:4])
    table = np.genfromtxt(path, delimiter=",", names=True, usecols=range(1, 8))
    a = np.stack([table["u_prime"] * table["v_prime"], table["u_prime"] ** 2 * np.radians(table["rudder_deg"])], axis=1)
    for names, force in ((FREE[:2], "Y_prime"), (FREE[2:4], "N_prime")):
        mean = simple.xi[simple.equations.columns(names)]
        prior = [0.1 if name == "Yuv" else SD for name in names] * np.abs(mean)
        error = table[f"{force}_sd"][0]
        covariance = np.linalg.inv(a.T @ a / error**2 + np.diag(prior**-2))
        found = known.part(names)
        np.testing.assert_allclose(found.covariance, covariance, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(
            found.mean, covariance @ (a.T @ table[force] / error**2 + mean / prior**2), rtol=1e-9
        )
        np.testing.assert_allclose([before[known.names.index(name)] for name in names], prior)
    assert known.part(("Yuv", "Nuv")).correlation[0, 1] == pytest.approx(0.0, abs=1e-12)
    assert words[0][:3] == ("Y", "18 forces", "determine 2 of 2")


@pytest.mark.parametrize("seen", [True, False])
def test_intervals_hold_boats_of_the_prior(simple, tmp_path, seen):
    """Nine in ten, within four standard errors of 200 boats; errors of forces are known, or estimated."""
    rng, inside, n = np.random.default_rng(3), [], 200
    columns = simple.equations.columns(FREE[:4])
    for _ in range(n):
        true = simple.xi.copy()
        true[columns] *= 1.0 + np.array([0.1, SD, SD, SD]) * rng.standard_normal(4)
        path = written(tmp_path / "runs.csv", towed(replace(simple, xi=true), rng, 3e-3, seen=seen))
        known = known_by(simple, path)[0].part(FREE[:4])
        inside.append(np.abs(known.mean - true[columns]) < 1.645 * known.sd)
    assert np.mean(inside) == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / (4 * n)))


def test_the_vehicle_file_is_a_prior(tmp_path, bayesub, monkeypatch, suboff, rng):
    """The command writes what a study reads back; what the runs do not see is as wide as before, and said to be."""
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path / "runs.csv", towed(suboff, rng, 1e-4))
    status, out, err = bayesub("new", "vehicle", "tested", "--from", "suboff", "--captive", "runs.csv")
    assert (status, err) == (0, "")
    assert "determine 3 of" in out  # Yuv, Yvav and the rudder
    tested, (known, before, _) = bs.load_vehicle("tested.toml"), known_by(suboff, path)
    columns = suboff.equations.columns(known.names)
    np.testing.assert_array_equal(tested.xi[columns], known.mean)
    np.testing.assert_array_equal(tested.sd[columns], known.sd)
    np.testing.assert_allclose(tested.correlation[np.ix_(columns, columns)], known.correlation, atol=1e-12)
    ratio = dict(zip(known.names, known.sd / before, strict=True))
    assert ratio["Yuv"] < 0.5
    assert ratio["Yvdot"] == pytest.approx(1.0)
    line = next(line for line in (tmp_path / "tested.toml").read_text().splitlines() if line.startswith("Yvdot "))
    assert "by the prior alone" in line
    again = known_by(tested, path)[0]  # the tests a second time: that prior is the posterior of the first
    assert again.sd[known.names.index("Yuv")] < known.sd[known.names.index("Yuv")]


HEADER = "run,u_prime,v_prime,rudder_deg,Y_prime,N_prime,Y_prime_sd,N_prime_sd"
ROW = "tow,1,0.1,5,0.01,0.002,0.001,0.001"
BAD = {
    "another name": ([HEADER.replace("v_prime", "v_primed"), ROW], "unknown", "v_primed"),
    "no speed": ([HEADER.replace("u_prime", "w_prime"), ROW], "missing", "u_prime"),
    "no force": (["u_prime,v_prime", "1,0"], "missing", "X_prime"),
    "text": ([HEADER, ROW, ROW.replace("tow,", "tow,x")], "value", "u_prime"),
    "no error": ([HEADER, ROW[:-5] + "0"], "value", "N_prime_sd"),
    "an empty motion": ([HEADER, "", ROW.replace("0.1,5", ",5")], "value", "v_prime"),
    "a huge force": ([HEADER, ROW.replace("0.01,", "1e9,")], "value", "Y_prime"),
    "a cell too many": ([HEADER, ROW + ",1"], "format", ""),
    "semicolons": ([line.replace(",", ";") for line in (HEADER, ROW)], "unknown", HEADER.replace(",", ";")),
    "too few": ([HEADER[:-22], *3 * [ROW[:-12]]], "missing", "Y_prime_sd"),
    "an axis without coefficients": ([HEADER.replace("N_prime", "K_prime"), ROW], "data", "K_prime"),
    "no rows": ([HEADER], "data", "Y_prime"),
    "nothing": ([], "format", ""),
    "a byte of another encoding": ([HEADER, ROW.replace("tow", "t\udcf6w")], "format", ""),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_tables_are_refused(simple, tmp_path, what):
    lines, category, key = BAD[what]
    with refused(category, key):
        known_by(simple, written(tmp_path / "runs.csv", lines))


def test_a_table_that_is_not_there(simple, tmp_path):
    with refused("file"):
        known_by(simple, tmp_path / "runs.csv")


def test_it_needs_a_vehicle(tmp_path, bayesub, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, _, err = bayesub("new", "vehicle", "tested", "--captive", "runs.csv")
    assert (status, err.count("\n")) == (2, 1)
    assert "--from" in err

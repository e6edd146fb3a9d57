"""The log of the Iver2 as the study reads it: minutes and seconds, counts, knots, and what is skipped."""

import numpy as np
import pytest

import iver2

NAMES = "Time,Latitude,Longitude,GPS Speed (Kn),C True Heading,Motor Speed CMD,Fin Yaw T"


def test_a_log_is_read_in_our_units(tmp_path):
    """The clock passes the hour, a stamp is given twice, and a cell is empty."""
    rows = ["59:59.5,25.9,-80.1,2,350,178,128", "00:00.5,25.9,-80.1,,350,178,228", "00:00.5,25.9,-80.1,2,1,178,228"]
    (tmp_path / "log.csv").write_text("\n".join([NAMES, *rows, "00:01.5,25.9,-80.1,1,10,128,28"]))
    log = iver2.read(tmp_path / "log.csv")
    assert log["time_s"] == pytest.approx([0.0, 1.0, 2.0])
    assert log["rudder_command_deg"] == pytest.approx([0.0, -16.0, 16.0])
    assert log["rpm"] == pytest.approx([1000.0, 1000.0, 0.0])
    np.testing.assert_allclose(log["speed_over_ground_mps"], [2 * 0.514444, np.nan, 0.514444], rtol=1e-5)


def test_the_study_is_skipped_without_the_logs(monkeypatch, tmp_path):
    monkeypatch.delenv("BAYESUB_IVER2", raising=False)
    assert "BAYESUB_IVER2" in iver2.compute(None)["skipped"]
    monkeypatch.setenv("BAYESUB_IVER2", str(tmp_path))
    assert "BAYESUB_IVER2" in iver2.compute(None)["skipped"]
    assert not list(iver2.claims({"skipped": "so"}))

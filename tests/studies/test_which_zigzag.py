"""Ordered zig-zags of the tanker, and what is said of promises."""

import json
from pathlib import Path

import numpy as np
import pytest

import bayesub as bs
import which_zigzag as study
from bayesub.inference.baselines import Estimate
from kvlcc2.trials import CIRCLES, FOLDER, ZIGZAGS

ROOT = Path(__file__).parents[2]


def test_an_ordered_zigzag_goes_to_starboard_and_back_at_its_heading() -> None:
    """The rudder is put at five degrees of heading, and takes 1.3 s from hard over to amidships."""
    boat = bs.load_vehicle(FOLDER / "vehicle.toml")
    mode = Estimate("", boat.equations.names, boat.xi[None], np.zeros(1), ("",), None, 0, 0.0)
    log = study.Planned(Path(), mode).flown("20_05", 600)
    rudder, yaw, times = log["rudder_deg"], log["yaw_deg"], log["time_s"]
    assert times[-1] == pytest.approx(119.8)
    assert rudder[times < study.START_S].tolist() == pytest.approx([0.0] * 5)
    np.testing.assert_allclose([rudder.min(), rudder.max()], [-20.0, 20.0])
    first, *reversals = np.flatnonzero(np.diff(np.sign(rudder)))
    assert rudder[first + 1] < 0.0
    assert len(reversals) > 4
    executed = np.interp(times[reversals] - 20.0 / 15.8, times, yaw)
    np.testing.assert_allclose(executed, 5.0 * (-1.0) ** np.arange(len(reversals)), atol=0.5)


@pytest.mark.skipif(not (ROOT / "figures").is_dir(), reason="figures are not part of a source distribution")
def test_the_zigzag_that_readme_and_manual_name_is_that_of_the_numbers() -> None:
    best = json.loads((ROOT / "figures" / "which_zigzag" / "numbers.json").read_text())["best"]["words"]
    pages = (ROOT / "README.md", *(ROOT / "bayesub/manual" / name for name in ("design.md", "findings.md")))
    assert all(best in page.read_text(encoding="utf-8") for page in pages)


def circles(width: float, off: float) -> dict:
    one = {"low": 20.0, "high": 20.0 + width, "value": 20.0 * (1.0 + off), "test": 20.0}
    return {side: {"advance_m": one, "diameter_m": one} for side in CIRCLES} | {"status": "converged"}


def test_the_best_promise_and_what_is_kept() -> None:
    """Promises of 0.9, 0.8 .. of the intervals, of which the best is kept and one other by half only."""
    promised = dict(zip(ZIGZAGS, 0.9 - 0.1 * np.arange(9), strict=True))
    after = {name: {way: circles(width, 0.02) for way in study.WAYS} for name, width in promised.items()}
    after[ZIGZAGS[0]]["reached"] = circles(1.8, 0.02)
    numbers = {"before": circles(1.0, -0.05), "after": after, "all": circles(0.05, 0.01)}
    numbers |= study.judged(numbers)
    assert numbers["best"] == pytest.approx(
        {"words": "zig-zag 35/5", "promised": 0.1, "reached": 0.1, "place": 1, "error": 0.02}
    )
    assert numbers["kept"] == {"n": 36, "close": 32, "rank_correlation": pytest.approx(1.0)}
    assert numbers["together"] == pytest.approx({"reached": 0.05, "error": 0.01})
    assert [sentence for holds, sentence in study.claims(numbers) if not holds] == ["32 of 36 intervals are within 20%"]

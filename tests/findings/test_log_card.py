"""The card of a log."""

import tomllib

import numpy as np
import pytest
from support.fins import X_TAIL, fins, with_actuators
from support.refusals import told

import bayesub as bs
from bayesub.findings import log_card
from bayesub.logs import log_files


@pytest.fixture
def finned(suboff_file, vehicle_with):
    """A boat with an X-tail."""
    content = tomllib.loads(suboff_file)
    content.pop("actuators", None)
    return vehicle_with(with_actuators(content, *fins(*X_TAIL)))


def test_fins_are_compared_with_the_turn_that_follows(finned, suboff, tmp_path):
    """Together they are a rudder and stern planes; all of the other sign are named, with the boat and not without."""
    suboff_track = bs.simulate(suboff, bs.load_manoeuvre("coupled", suboff))
    suboff_track.save(tmp_path / "track.csv")
    log = log_files.read_log(tmp_path / "track.csv")
    orders = np.stack([log.pop("delta_r"), np.zeros(len(log["time"])), log.pop("delta_s")], axis=1)
    log.pop("delta_b", None)
    actuators = finned.actuators
    angles = orders @ actuators.allocation[:, :3].T
    columns = dict(zip(actuators.columns, angles.T, strict=True))
    for sign, n_lines in ((1.0, 0), (-1.0, 2)):
        whole = log | {column: sign * values for column, values in columns.items()}
        headers = [log_files.HEADERS.get(name, name) for name in whole]
        card = log_card.check(whole, headers, actuators.log_columns, finned)
        assert len(card.findings) == n_lines
    rudder, planes = card.findings
    for finding in (rudder, planes):
        told(finding, "sign", ", ".join(f"fin_{k}_deg" for k in range(1, 5)))
    assert log_card.check(whole, headers, actuators.log_columns).lines() == ["no column contradicts another"]

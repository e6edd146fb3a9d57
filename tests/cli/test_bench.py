"""What `bayesub bench` measures, not how fast it is."""

import numpy as np

from bayesub.campaign.executors import Serial
from bayesub.cli import bench, bench_cluster, scalar_simulator
from bayesub.cli.bench_tables import tables
from bayesub.cli.scalar_simulator import spiral
from bayesub.model.time_step import STEP_TOLERANCE_M


def test_functions_take_turns():
    """Each is run as often as the others and in turn, and its shortest run is kept."""
    order = []
    durations = bench.shortest(lambda: order.append(1), lambda: order.append(2), seconds=0.0, least=4)
    assert order == [1, 2] * 4
    assert all(t > 0 for t in durations)


def test_log_likelihoods_stand_beside_their_simulations():
    """Every noise model is timed, for each number of threads after the simulations alone."""
    rows = bench.log_likelihoods(0.0)
    n_threads = len(list(bench.each_number_of_threads()))
    models = [None, "normal", "normal, rounded to an sd", "normal, rounded to ten sd", "Student t", "autoregressive"]
    assert [row["noise"] for row in rows] == n_threads * models
    assert all(row["seconds"] > 0 for row in rows)


def test_what_a_user_would_write_flies_the_same_track():
    """One simulation at a time, compiled or not, ends where the simulator does, to the tolerance of its step."""
    simulator = spiral(1.0)
    states = scalar_simulator.simulate(simulator)
    expected = simulator.run(simulator.vehicle.xi)[0][0]
    assert states.shape == expected.shape
    assert np.linalg.norm(states[:, :3] - expected[:, :3], axis=1).max() < STEP_TOLERANCE_M


def test_tables_have_a_row_for_each_measurement():
    numbers = {
        "batch": 4,
        "methods": [
            {"method": "bayesub, 1 thread", "seconds": 2e-5, "error_m": 1e-3},
            {"method": "bayesub, 2 threads", "seconds": 1e-5, "error_m": 1e-3},
            {"method": "other", "seconds": 1e-3, "error_m": 1e-3},
        ],
        "threads": 2,
        "batches": [{"size": 4, "seconds": 1e-4, "bytes": 2_000_000}],
        "non_zero": [{"coefficients": 21, "seconds": 1e-5}],
        "jacobians": [{"coefficients": 21, "threads": threads, "seconds": 1e-3} for threads in (1, 2)],
        "log_likelihoods": [{"noise": noise, "threads": 1, "seconds": 1e-3} for noise in (None, "normal")],
        "arithmetic": {
            "instructions": {"fma": 3}, "vector_bits": 256, "peak_vector_bits": 512, "fma_per_s": 1e9, "limit_s": 1e-5
        },
    }  # fmt: skip
    methods, batches, pruned, jacobians, densities, text = tables(numbers)
    assert [table.row_count for table in (methods, batches, pruned, jacobians, densities)] == [3, 1, 1, 2, 2]
    assert [*methods.columns[3].cells] == ["2.0", "1.0", "100.0"]
    assert [*jacobians.columns[3].cells] == ["50", "100"]
    assert "2.00 times" in text


def test_a_cluster_is_measured_by_the_time_inside_its_pieces(monkeypatch):
    """Pieces share their workers' time with what it takes to hand them out."""
    sizes = {"QUICK_EMPTY": 3, "QUICK_LENGTHS": {0.05: 2}, "RESULT": 10, "FUNCTION": 10}
    for name, value in sizes.items():
        monkeypatch.setattr(bench_cluster, name, value)
    numbers = bench_cluster.run(Serial(), quick=True)
    assert numbers["workers"] == 1
    assert [row["work"] for row in numbers["lengths"]] == ["waiting", "simulating"]
    for row in numbers["lengths"]:
        assert row["pieces"] == 2
        assert row["length_s"] >= 0.05
        assert 0.0 < row["efficiency"] <= 1.0
    text, table = bench_cluster.tables(numbers)
    assert table.row_count == 2
    assert f"{1e3 * numbers['seconds_per_piece']:.2f} ms" in text

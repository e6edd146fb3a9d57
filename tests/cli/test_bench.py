"""What `bayesub bench` measures, not how fast it is."""

from bayesub.campaign.executors import Serial
from bayesub.cli import bench, bench_cluster, stopwatch
from bayesub.cli.bench_tables import tables


def test_functions_take_turns():
    """Each is run as often as the others and in turn, and its shortest run is kept."""
    order = []
    durations = stopwatch.shortest(lambda: order.append(1), lambda: order.append(2), seconds=0.0, least=4)
    assert order == [1, 2] * 4
    assert all(t > 0 for t in durations)


def test_log_likelihoods_stand_beside_their_simulations():
    """Every noise model is timed, for each number of threads after the simulations alone."""
    rows = bench.log_likelihoods(0.0)
    n_threads = len(list(stopwatch.each_number_of_threads()))
    models = [None, "normal", "normal, rounded to an sd", "normal, rounded to ten sd", "Student t", "autoregressive"]
    assert [row["noise"] for row in rows] == n_threads * models
    assert all(row["seconds"] > 0 for row in rows)


def test_tables_have_a_row_for_each_measurement():
    numbers = {
        "batch": 4,
        "methods": [
            {"method": "bayesub", "step_s": 1.0, "seconds": {1: 2e-5, 2: 1e-5}, "error_m": 1e-3, "differs_m": 0.0},
            {"method": "other", "step_s": 1.0, "seconds": {1: 1e-4, 2: 6e-5}, "error_m": 1e-3, "differs_m": 3e-13},
            {"method": "adaptive", "step_s": None, "seconds": {1: 1e-3}, "error_m": 1e-3, "differs_m": None},
        ],
        "left_out": ["left out: a snail"],
        "threads": 2,
        "batches": [{"size": 4, "seconds": 1e-4, "bytes": 2_000_000}],
        "non_zero": [{"coefficients": 21, "seconds": 1e-5}],
        "jacobians": [
            {"method": method, "coefficients": 21, "threads": threads, "seconds": seconds}
            for method, seconds in (("bayesub", 1e-3), ("other", 4e-3)) for threads in (1, 2)
        ],
        "log_likelihoods": [{"noise": noise, "threads": 1, "seconds": 1e-3} for noise in (None, "normal")],
        "arithmetic": {
            "instructions": {"fma": 3}, "vector_bits": 256, "peak_vector_bits": 512, "fma_per_s": 1e9, "limit_s": 1e-5
        },
    }  # fmt: skip
    methods, agreement, batches, pruned, jacobians, densities, text = tables(numbers)
    assert [table.row_count for table in (methods, batches, pruned, jacobians, densities)] == [3, 1, 1, 4, 2]
    one, two = ([*methods.columns[k].cells] for k in (3, 5))
    assert (one, two) == (["1.0", "5.0", "50.0"], ["1.0", "6.0", ""])
    assert agreement == "rows with steps differ from bayesub with these steps by at most 3.0e-13 m\nleft out: a snail"
    assert [*jacobians.columns[4].cells] == ["50", "100", "200", "400"]
    assert [*jacobians.columns[5].cells] == ["1.0", "1.0", "4.0", "4.0"]
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

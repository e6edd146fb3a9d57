"""What `bayesub bench` measures, not how fast it is."""

from bayesub.cli.before import tables
from bayesub.study.before import bench


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


def test_tables_have_a_row_for_each_measurement():
    numbers = {
        "batch": 4,
        "step_s": 0.5,
        "threads": 2,
        "batches": [{"size": 4, "seconds": 1e-4, "bytes": 2_000_000}],
        "jacobians": [{"coefficients": 21, "threads": threads, "seconds": 1e-3} for threads in (1, 2)],
        "log_likelihoods": [
            {"noise": noise, "threads": n, "seconds": 1e-3 / n} for n in (1, 2) for noise in (None, "normal")
        ],
        "cold_s": 9.0,
        "warm_s": 1.0,
        "compilation": {"booth": 3.0},
    }
    *found, (text, none), compiled = tables(numbers).items()
    assert [len(rows) for _, rows in (*found, compiled)] == [2, 3, 5, 2]
    batches, jacobians, _ = (rows for _, rows in found)
    assert batches[1][3] == "40,000"
    assert [row[3] for row in jacobians[1:]] == ["4", "8"]
    assert (text, none) == ("first simulation: 9.0 s with compilation, 1.0 s without", [])

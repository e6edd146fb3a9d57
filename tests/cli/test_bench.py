"""What `bayesub bench` measures, not how fast it is."""

from bayesub.cli import bench


def test_functions_take_turns():
    """Each is run as often as the others and in turn, and its shortest run is kept."""
    order = []
    shortest = bench._alternately([lambda: order.append(1), lambda: order.append(2)], 0.0, least=4)
    assert order == [1, 2] * 4
    assert all(t > 0 for t in shortest)


def test_log_likelihoods_stand_beside_their_simulations():
    """Every noise model is timed, for each number of threads after the simulations alone."""
    rows = bench.log_likelihoods(0.0)
    n_threads = len(bench._threads())
    models = [None, "normal", "normal, rounded to an sd", "normal, rounded to ten sd", "Student t", "autoregressive"]
    assert [row["noise"] for row in rows] == n_threads * models
    assert all(row["seconds"] > 0 for row in rows)

"""What a cluster adds to the work itself: time for each piece, efficiency by length of a piece, results by size."""

import os
import time
from functools import partial

from rich.table import Table

from bayesub.campaign.executors import Executor
from bayesub.study.before.bench import BATCH, perturbed, spiral

LENGTHS = {0.1: 60, 1.0: 20, 5.0: 6}  # of a piece, s -> how many for each worker
QUICK_LENGTHS = {0.1: 20, 1.0: 4}
N_EMPTY, QUICK_EMPTY = 1000, 200
RESULT, N_RESULTS = 1_000_000, 50  # bytes of a result, and number of them
FUNCTION = 50_000_000  # bytes


def run(executor: Executor, *, quick: bool = False) -> dict:
    """All measurements: seconds, bytes, and shares of the time of the workers.

    The efficiency is the time inside the pieces over the time of all workers. Other work on the same processors makes
    pieces longer and hardly changes it; nor does it change the processor time.
    """
    executor.map(_simulating, [0.01] * 8)  # starts workers and loads the kernels
    n_workers = getattr(executor, "n", 1)
    n = QUICK_EMPTY if quick else N_EMPTY
    numbers = {"workers": n_workers, "load": os.getloadavg()[0], "pieces": n}
    processor = time.process_time()
    numbers["seconds_per_piece"] = _seconds(executor, _nothing, range(n))[0] / n
    numbers["processor_seconds_per_piece"] = (time.process_time() - processor) / n
    seconds, _ = _seconds(executor, _large, [RESULT] * N_RESULTS)
    numbers["result_bytes_per_s"] = N_RESULTS * RESULT / seconds
    seconds, _ = _seconds(executor, partial(_with, bytes(FUNCTION)), range(n_workers))
    numbers["function_bytes_per_s"] = FUNCTION / seconds
    numbers["lengths"] = []
    for work in (_waiting, _simulating):
        for length, n_each in (QUICK_LENGTHS if quick else LENGTHS).items():
            seconds, inside = _seconds(executor, work, [length] * n_each * n_workers)
            row = {"work": work.__name__[1:], "length_s": sum(inside) / len(inside), "pieces": len(inside)}
            numbers["lengths"].append(row | {"efficiency": sum(inside) / (n_workers * seconds)})
    return numbers


def _seconds(executor: Executor, work, items) -> tuple[float, list]:
    """Seconds for all items, and the results."""
    began = time.perf_counter()
    results = executor.map(work, items)
    return time.perf_counter() - began, results


def _nothing(k: int) -> int:
    return k


def _large(size: int) -> bytes:
    return bytes(size)


def _with(content: bytes, _) -> int:
    return len(content)


def _waiting(length: float) -> float:
    """Wait some seconds, and say how many they were."""
    began = time.perf_counter()
    time.sleep(length)
    return time.perf_counter() - began


def _simulating(length: float) -> float:
    """Simulate for some seconds, and say how many they were."""
    simulator, began = spiral(), time.perf_counter()
    xi = perturbed(simulator.vehicle, BATCH)
    while time.perf_counter() - began < length:
        simulator.run(xi)
    return time.perf_counter() - began


def tables(numbers: dict) -> list[Table | str]:
    """What :func:`run` returns, for the terminal."""
    table = Table("piece", "length", "pieces", "efficiency", title=f"{numbers['workers']} workers")
    for row in numbers["lengths"]:
        table.add_row(row["work"], f"{row['length_s']:.2f} s", str(row["pieces"]), f"{row['efficiency']:.1%}")
    each, processor = numbers["seconds_per_piece"], numbers["processor_seconds_per_piece"]
    text = (
        f"a piece that does nothing: {1e3 * each:.2f} ms, so {1.0 / each:.0f} pieces a second\n"
        f"processor time of the coordinator for a piece: {1e3 * processor:.2f} ms\n"
        f"results: {numbers['result_bytes_per_s'] / 1e6:.0f} MB/s to the coordinator\n"
        f"a function of {FUNCTION / 1e6:.0f} MB: {FUNCTION / numbers['function_bytes_per_s']:.2f} s to all workers\n"
        f"load of this machine: {numbers['load']:.1f}"
    )
    return [text, table]

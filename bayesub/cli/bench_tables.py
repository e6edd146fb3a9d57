"""What ``bayesub bench`` has measured, as tables for the terminal."""

from rich.table import Table


def tables(numbers: dict) -> list[Table | str]:
    """Tables and text of what :func:`bayesub.cli.bench.run` returns."""
    ours = [method for method in numbers["methods"] if method["method"].startswith("bayesub")]
    return [
        _methods(numbers, ours[-1]["seconds"]),
        _batches(numbers),
        _coefficients(numbers),
        _jacobians(numbers, [method["seconds"] for method in ours]),
        _log_likelihoods(numbers),
        "\n".join(_arithmetic(numbers, ours[0]["seconds"])),
    ]


def _methods(numbers, fastest) -> Table:
    table = Table("method", "per simulation", "position error", "times ours", title="600 s spiral of suboff")
    for m in numbers["methods"]:
        ratio = f"{m['seconds'] / fastest:.1f}"
        table.add_row(m["method"], f"{1e6 * m['seconds']:.1f} us", f"{1e3 * m['error_m']:.3g} mm", ratio)
    return table


def _batches(numbers) -> Table:
    table = Table("batch", "time", "per simulation", "memory", title=f"Batches on {numbers['threads']} threads")
    for b in numbers["batches"]:
        each = f"{1e6 * b['seconds'] / b['size']:.1f} us"
        table.add_row(str(b["size"]), f"{1e3 * b['seconds']:.3g} ms", each, f"{b['bytes'] / 1e6:.2f} MB")
    return table


def _coefficients(numbers) -> Table:
    table = Table("coefficients not zero", "per simulation", title="Number of coefficients, batch of 64")
    for row in numbers["non_zero"]:
        table.add_row(str(row["coefficients"]), f"{1e6 * row['seconds']:.1f} us")
    return table


def _jacobians(numbers, by_threads) -> Table:
    """`by_threads` is the seconds of a simulation for each number of threads, in ascending order."""
    table = Table("coefficients", "threads", "Jacobian", "simulations in a batch", title="Exact sensitivities")
    threads = sorted({row["threads"] for row in numbers["jacobians"]})
    simulation = dict(zip(threads, by_threads, strict=True))
    for row in numbers["jacobians"]:
        worth = f"{row['seconds'] / simulation[row['threads']]:.0f}"
        table.add_row(str(row["coefficients"]), str(row["threads"]), f"{1e3 * row['seconds']:.2f} ms", worth)
    return table


def _log_likelihoods(numbers) -> Table:
    rows = numbers["log_likelihoods"]
    alone = {row["threads"]: row["seconds"] for row in rows if row["noise"] is None}
    title = f"Log likelihoods, batch of {numbers['batch']}"
    table = Table("noise", "threads", "batch", "over the simulations alone", title=title)
    for row in rows:
        ratio = f"{row['seconds'] / alone[row['threads']]:.2f}"
        table.add_row(row["noise"] or "simulations alone", str(row["threads"]), f"{1e3 * row['seconds']:.2f} ms", ratio)
    return table


def _arithmetic(numbers, simulation) -> list[str]:
    limit = numbers["arithmetic"]
    count = ", ".join(f"{n} {kind}" for kind, n in limit["instructions"].items())
    text = [
        f"right-hand side: {count} ({limit['vector_bits']}-bit vectors)",
        f"peak of one core: {limit['fma_per_s'] / 1e9:.1f}e9 multiply-adds/s ({limit['peak_vector_bits']}-bit vectors)",
        f"arithmetic limit: {1e6 * limit['limit_s']:.1f} us a simulation on one core; ours takes "
        f"{simulation / limit['limit_s']:.2f} times that",
    ]
    if "cold_s" in numbers:
        text.append(f"first simulation: {numbers['cold_s']:.1f} s with compilation, {numbers['warm_s']:.1f} s without")
    return text

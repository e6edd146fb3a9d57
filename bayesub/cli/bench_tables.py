"""What ``bayesub bench`` has measured, as tables for the terminal."""

from rich.table import Table


def tables(numbers: dict) -> list[Table | str]:
    """Tables and text of what :func:`bayesub.cli.bench.run` returns."""
    rows = [_batches(numbers), _coefficients(numbers), _jacobians(numbers), _log_likelihoods(numbers)]
    if "cold_s" in numbers:
        rows.append(f"first simulation: {numbers['cold_s']:.1f} s with compilation, {numbers['warm_s']:.1f} s without")
    return [*rows, _compilation(numbers["compilation"])] if "compilation" in numbers else rows


def _alone(numbers) -> dict[int, float]:
    """Seconds of a batch of simulations by number of threads."""
    return {row["threads"]: row["seconds"] for row in numbers["log_likelihoods"] if row["noise"] is None}


def _compilation(seconds) -> Table:
    table = Table("what", "processor time", title="Compilation, from an empty cache")
    for name, taken in seconds.items():
        table.add_row(name, f"{taken:.2f} s")
    return table


def _batches(numbers) -> Table:
    title = f"600 s spiral of suboff, steps of {numbers['step_s']:g} s, threads: {numbers['threads']}"
    table = Table("batch", "time", "per simulation", "simulations/s", "memory", title=title)
    for b in numbers["batches"]:
        each, memory = b["seconds"] / b["size"], f"{b['bytes'] / 1e6:.2f} MB"
        cells = f"{1e3 * b['seconds']:.3g} ms", f"{1e6 * each:.1f} us", f"{1.0 / each:,.0f}", memory
        table.add_row(str(b["size"]), *cells)
    return table


def _coefficients(numbers) -> Table:
    table = Table("coefficients not zero", "per simulation", title="Number of coefficients, batch of 64")
    for row in numbers["non_zero"]:
        table.add_row(str(row["coefficients"]), f"{1e6 * row['seconds']:.1f} us")
    return table


def _jacobians(numbers) -> Table:
    batch = _alone(numbers)
    table = Table("coefficients", "threads", "Jacobian", "simulations", title="Exact sensitivities")
    for row in numbers["jacobians"]:
        threads, seconds = row["threads"], row["seconds"]
        worth = f"{seconds / batch[threads] * numbers['batch']:.0f}"
        table.add_row(str(row["coefficients"]), str(threads), f"{1e3 * seconds:.2f} ms", worth)
    return table


def _log_likelihoods(numbers) -> Table:
    batch = _alone(numbers)
    title = f"Log likelihoods, batch of {numbers['batch']}"
    table = Table("noise", "threads", "batch", "over the simulations alone", title=title)
    for row in numbers["log_likelihoods"]:
        ratio = f"{row['seconds'] / batch[row['threads']]:.2f}"
        table.add_row(row["noise"] or "simulations alone", str(row["threads"]), f"{1e3 * row['seconds']:.2f} ms", ratio)
    return table

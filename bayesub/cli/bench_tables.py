"""What ``bayesub bench`` has measured, as tables for the terminal."""

from rich.table import Table


def tables(numbers: dict) -> list[Table | str]:
    """Tables and text of what :func:`bayesub.cli.bench.run` returns."""
    ours = numbers["methods"][0]["seconds"]
    return [
        _methods(numbers, ours),
        "\n".join([*_agreement(numbers), *numbers["left_out"]]),
        _batches(numbers),
        _coefficients(numbers),
        _jacobians(numbers["jacobians"], ours),
        _log_likelihoods(numbers),
        "\n".join(_arithmetic(numbers, ours[1])),
        *([_compilation(numbers["compilation"])] if "compilation" in numbers else []),
    ]


def _compilation(seconds) -> Table:
    table = Table("what", "processor time", title="Compilation, from an empty cache")
    for name, taken in seconds.items():
        table.add_row(name, f"{taken:.2f} s")
    return table


def _methods(numbers, ours) -> Table:
    """`ours` is the seconds of a simulation by number of threads."""
    columns = [column for n in ours for column in (f"{n} thread{'s' * (n > 1)}", "times ours")]
    title = f"600 s spiral of suboff, us a simulation, batches of {numbers['batch']}"
    table = Table("method", "step", *columns, "error", title=title)
    for m in numbers["methods"]:
        cells = [f"{m['step_s']:g} s" if m["step_s"] else ""]
        for threads, seconds in ours.items():
            here = m["seconds"].get(threads)
            cells += ["", ""] if here is None else [f"{1e6 * here:.0f}", f"{here / seconds:.1f}"]
        table.add_row(m["method"], *cells, f"{1e3 * m['error_m']:.1g} mm")
    return table


def _agreement(numbers) -> list[str]:
    same = [m["differs_m"] for m in numbers["methods"][1:] if m["differs_m"] is not None]
    return [f"rows with steps differ from bayesub with these steps by at most {max(same):.1e} m"]


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


def _jacobians(rows, ours) -> Table:
    """`ours` is the seconds of a simulation by number of threads."""
    columns = ("method", "coefficients", "threads", "Jacobian", "simulations", "times ours")
    table = Table(*columns, title="Exact sensitivities")
    own = {(row["coefficients"], row["threads"]): row["seconds"] for row in rows if row["method"] == "bayesub"}
    for row in rows:
        n, threads, seconds = row["coefficients"], row["threads"], row["seconds"]
        worth, ratio = f"{seconds / ours[threads]:.0f}", f"{seconds / own[n, threads]:.1f}"
        table.add_row(row["method"], str(n), str(threads), f"{1e3 * seconds:.2f} ms", worth, ratio)
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

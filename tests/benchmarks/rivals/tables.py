"""What :mod:`rivals.comparison` has measured, as tables for the terminal."""

from rich.table import Table


def tables(numbers: dict) -> list[Table | str]:
    """Tables and text of what :func:`rivals.comparison.run` returns."""
    ours = numbers["methods"][0]["seconds"]
    return [
        _methods(numbers, ours),
        "\n".join([*_agreement(numbers), *numbers["left_out"]]),
        _jacobians(numbers["jacobians"], ours),
        "\n".join(_arithmetic(numbers, ours[1])),
    ]


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


def _arithmetic(numbers, simulation) -> list[str]:
    limit = numbers["arithmetic"]
    count = ", ".join(f"{n} {kind}" for kind, n in limit["instructions"].items())
    return [
        f"right-hand side: {count} ({limit['vector_bits']}-bit vectors)",
        f"peak of one core: {limit['fma_per_s'] / 1e9:.1f}e9 multiply-adds/s ({limit['peak_vector_bits']}-bit vectors)",
        f"arithmetic limit: {1e6 * limit['limit_s']:.1f} us a simulation on one core; ours takes "
        f"{simulation / limit['limit_s']:.2f} times that",
    ]

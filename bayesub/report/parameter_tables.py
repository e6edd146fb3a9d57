"""Tables of a posterior, a row a parameter: columns for the page of a report, and Markdown and LaTeX for papers.

Digits follow the sd.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from bayesub.findings import run_numbers
from bayesub.inference.sampling import Posterior
from bayesub.io import words
from bayesub.report import page
from bayesub.report.markdown import table
from bayesub.report.plots.style import Equations

HEADS = ("regressor", "prior", "posterior", "90 % interval", "sd / prior sd")
_SMALL = 0.1  # of coefficients that share a power of ten
_PLAIN = range(-2, 4)  # powers of ten of numbers that are written without one
_FACTOR = re.compile(r"(?:(abs|sgn)\((\w+)\)|(\w+?))(?:\^(-?\d+))?")


def rounded(values: Sequence[float] | np.ndarray, sd: float) -> tuple[list[str], int]:
    """Texts of values (n,) to two digits of an sd, and the power of ten by which they are to be multiplied."""
    size = max(float(np.abs(values).max()), sd)
    power = int(np.floor(np.log10(size))) if size > 0.0 else 0
    power = 0 if power in _PLAIN else power
    return [words.rounded(value / 10.0**power, sd / 10.0**power) for value in values], power


@dataclass(frozen=True)
class Column:
    """A column of the table of a report, a cell for each parameter."""

    group: str  # of the columns that are shown together
    head: str
    cells: Sequence[str]
    sort: Sequence[float | str] = ()  # by what the rows are sorted, where cells do not say


def columns(numbers: Mapping[str, Any], word: str) -> list[Column]:
    """All that a report says of each parameter, by the content of ``numbers.json``; `word`: what the reference is.

    Small non-dimensional coefficients have one power of ten for all, which the heads tell.
    """
    own, rows = numbers["parameters"], numbers["parameters"] + numbers["nuisance"]
    small = not any(row["unit"] for row in own) and max((abs(row["mean"]) for row in own), default=1.0) < _SMALL
    factors = [1e3 if small else 1.0] * len(own) + [1.0] * len(numbers["nuisance"])
    times = " × 10³" if small else ""

    def digits(key: str, sd: str = "sd", by: Callable[[float, float], str] = words.rounded) -> list[str]:
        return [by(f * row[key], f * row[sd]) for row, f in zip(rows, factors, strict=True)]

    def each(form: str, key: str) -> list[str]:
        return [form.format(row[key]) for row in rows]

    si = [(row["mean"] * row["si_factor"], row["sd"] * row["si_factor"]) for row in own]
    in_si = [f"{words.uncertain(*pair)} {row['si_unit']}" for pair, row in zip(si, own, strict=True)]
    multiplies = []
    for term, row in zip(numbers["glossary"], own, strict=True):
        factor = "" if row["unit"] else f"{words.powers(term['factor'])} · "
        multiplies.append(Markup("{}{}").format(factor, page.product(term["regressor"])))
    return [
        Column("value", f"mean ± sd{times}", digits("mean", by=words.uncertain)),
        Column("value", "sd / mean (%)", [f"{100.0 * row['relative_sd']:.2g}" for row in own]),
        Column("value", f"5 %{times}", digits("q5")),
        Column("value", f"95 %{times}", digits("q95")),
        Column("si", "in SI units", in_si, [mean for mean, _ in si]),
        Column("si", "multiplies", multiplies),
        Column("prior", f"{word}{times}", digits("reference")),
        Column("prior", f"prior mean ± sd{times}", digits("prior_mean", "prior_sd", words.uncertain)),
        Column("prior", "sensitivity to the prior", each("{:.2f}", "prior_sensitivity")),
        Column("prior", "to the data", each("{:.2f}", "likelihood_sensitivity")),
        Column("others", f"sd{times}", digits("sd")),
        Column("others", f"sd, all others known{times}", digits("conditional_sd", "conditional_sd")),
        Column("others", "gain, times", [words.cell(run_numbers.gain(row), 2) for row in rows]),
        Column("sampling", "R-hat", each("{:.4f}", "rhat")),
        Column("sampling", "bulk ESS", each("{:.0f}", "bulk_ess")),
        Column("sampling", "tail ESS", each("{:.0f}", "tail_ess")),
        Column("sampling", "tau (steps)", each("{:.0f}", "tau_steps")),
        Column("meaning", "meaning", [term["meaning"] for term in numbers["glossary"]]),
    ]


def markdown(posterior: Posterior, equations: Equations) -> str:
    """The table in Markdown; `equations` is the set whose coefficients they are."""
    lines = []
    for term, name, *numbers in _rows(posterior, equations):
        symbol = f"{page.symbol(term.label)} `{name}`".replace("|", "&#124;") if _is_formula(term) else name
        what = "" if term is None else words.markdown(f"{term.scale} · {term.regressor}")
        lines.append((symbol, what, *_cells(numbers, "± ", "e{}")))
    return "\n".join(table(("parameter", *HEADS), lines)) + "\n"


def latex(posterior: Posterior, equations: Equations) -> str:
    """The table in LaTeX, which needs the package booktabs; `equations` as of :func:`markdown`."""
    heads = " & ".join(("", *HEADS)).replace("%", r"\%").replace("regressor", "multiplies")
    lines = [r"% \usepackage{booktabs}", r"\begin{tabular}{llrrrr}", r"\toprule", rf"{heads} \\", r"\midrule"]
    for term, name, *numbers in _rows(posterior, equations):
        symbol = term.label if _is_formula(term) else rf"\texttt{{{words.latex(name)}}}"
        what = "" if term is None else f"${_factor_latex(term)}\\,{regressor_latex(term.regressor)}$"
        lines.append(" & ".join((symbol, what, *_cells(numbers, r"\pm ", r" \times 10^{{{}}}", "$"))) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _is_formula(term) -> bool:
    """Whether there is a term, and its label can stand in a table."""
    return term is not None and words.LABEL.fullmatch(term.label) is not None


def _rows(posterior, equations) -> Iterator[tuple]:
    """Term (None of a nuisance parameter), name, prior mean and sd, mean, sd, q5, q95, contraction."""
    q5, q95 = posterior.quantiles([0.05, 0.95])
    columns = (posterior.prior_mean, posterior.prior_sd, posterior.mean, posterior.sd, q5, q95, posterior.contraction)
    for name, *numbers in zip(posterior.names, *(column.tolist() for column in columns), strict=True):
        yield (equations.term(name) if name in equations.index else None, name, *numbers)


def _cells(numbers, plus_minus, power_text, quote="") -> list[str]:
    """The cells of numbers: prior, posterior and interval, each with its power of ten, and the contraction."""
    prior_mean, prior_sd, mean, sd, q5, q95, contraction = numbers
    cells = []
    joins = f" {plus_minus}", f" {plus_minus}", r" \ldots " if quote else " to "
    pairs = ((prior_mean, prior_sd), prior_sd), ((mean, sd), sd), ((q5, q95), sd)
    for (values, width), join in zip(pairs, joins, strict=True):
        texts, power = rounded(values, width)
        text = join.join(texts)
        cells.append(f"{quote}{f'({text}){power_text.format(power)}' if power else text}{quote}")
    return [*cells, f"{contraction:.2g}"]


def _factor_latex(term) -> str:
    """What makes the coefficient dimensional."""
    if term.unit is not None:
        unit = term.unit if words.UNIT.fullmatch(term.unit) else words.latex(term.unit)
        return r"\mathrm{" + unit.replace(" ", r"\,") + "}"
    return term.scale.replace("(rho/2)", r"\frac{\rho}{2}").replace(" ", r"\,")


def regressor_latex(regressor: str) -> str:
    r"""A regressor such as ``u*abs(r)*dr`` in LaTeX, ``u \left|r\right| \delta_{r}``."""
    parts = []
    for factor in regressor.split("*"):
        function, inner, bare, power = _FACTOR.fullmatch(factor.strip()).groups()  # type: ignore[union-attr]  # a regressor of a set is parsed
        symbol = _symbol_latex(inner or bare)
        shape = {"abs": r"\left|%s\right|", "sgn": r"\mathrm{sgn}(%s)"}.get(function, "%s") % symbol
        parts.append(f"{shape}^{{{power}}}" if power else shape)
    return " ".join(parts)


def _symbol_latex(symbol: str) -> str:
    if symbol == "nu":
        return r"\nu"
    if symbol.endswith("dot"):
        return rf"\dot{{{symbol[:-3]}}}"
    if symbol.startswith("crossflow_"):
        return rf"\mathrm{{crossflow}}_{{{symbol[-1]}}}"
    return rf"\delta_{{{symbol[1:]}}}" if symbol[0] == "d" and len(symbol) == 2 and symbol[1] != "u" else symbol

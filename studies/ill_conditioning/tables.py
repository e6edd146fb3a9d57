"""Tables of ill-conditioning, from the numbers of :mod:`ill_conditioning.one_case`."""

from collections.abc import Iterator
from operator import itemgetter

import numpy as np

from bayesub.report.markdown import columns, named
from ill_conditioning.one_case import KNOWN, names_by_axis
from thesis.cases import published


def column(numbers: dict, key: str) -> np.ndarray:
    """(n_params,) one quantity of all coefficients of a case, infinite where it is null."""
    values = np.array([row[key] for row in numbers["coefficients"].values()], dtype=float)
    return np.where(np.isnan(values), np.inf, values)


def page(numbers: dict) -> Iterator[str]:
    """Every table, in Markdown."""
    cases, thesis = named(numbers), published()["error_cancellation"]
    yield "Directions in prior standard deviations: sharpened (data sharper than the prior), left to the prior, and"
    yield "null by the equations. Coefficients known to 5 %: alone with all others given, and in company with the"
    yield "prior.\n"
    yield from columns(
        cases,
        {
            "case": itemgetter("name"),
            "free": itemgetter("n_params"),
            "sharpened": itemgetter("n_sharpened"),
            "left to the prior": lambda c: c["n_params"] - c["n_sharpened"] - c["n_null"],
            "null": itemgetter("n_null"),
            "sloppiest data sd (prior sd)": lambda c: (
                f"{1 / c['singular_values'][c['n_params'] - c['n_null'] - 1]:.2g}"
            ),
            "known alone": lambda c: np.count_nonzero(column(c, "alone") < KNOWN),
            "known in company": lambda c: np.count_nonzero(column(c, "posterior") < KNOWN),
            "largest condition index": lambda c: f"{max(c['condition_index'].values()):.2g}",
            "cost of SQP set": lambda c: f"{c['sqp_cost']:.2g}",
        },
    )
    yield "\nLargest force errors of a set that SQP stopped at, in N or N m (thesis Table 28:"
    yield f"Xvv {thesis['Xvv']}, Xvr and Xrr {thesis['Xvr_or_Xrr_a']} and {thesis['Xvr_or_Xrr_b']},"
    yield f"sum {thesis['total_X']} N on its submarine 1).\n"
    axes = [{"case": c, "axis": axis} for c in cases for axis in c["condition_index"]]
    case_and_axis = {"case": lambda row: row["case"]["name"], "axis": itemgetter("axis")}
    yield from columns(
        axes,
        case_and_axis
        | {
            "three largest terms": lambda row: ", ".join(f"{n} {x:.3g}" for n, x in list(_errors(row).items())[:3]),
            "largest sum": lambda row: f"{row['case']['largest_sum'][row['axis']]:.3g}",
            "ratio": lambda row: f"{cancellation_ratio(row['case'], row['axis']):.2g}",
        },
    )
    yield "\nCollinearity of the regressors, null directions apart (Belsley): coefficients that get more than half of"
    yield "their variance from the worst dependency.\n"
    yield from columns(
        axes,
        case_and_axis
        | {
            "columns": lambda row: len(names_by_axis(row["case"])[row["axis"]]),
            "null": lambda row: row["case"]["null_by_axis"][row["axis"]],
            "largest condition index": lambda row: f"{row['case']['condition_index'][row['axis']]:.2g}",
            "involved": lambda row: ", ".join(row["case"]["involved"][row["axis"]]),
            "largest finite VIF": _largest_vif,
        },
    )
    for case in cases:
        yield f"\n{case['name']}: relative standard deviations in %, by the posterior's. Alone: all others known. Data:"
        yield "Cramer-Rao bound without a prior. Null held: the same with the null directions held. Sensors: factor by"
        yield f"which all noise must fall for {100 * KNOWN:g} %. At 25 and 99 %: cost in m^2 + deg^2; the simulator has"
        yield f"{case['simulator_cost']:.2g}.\n"
        yield from coefficient_table(case)


def coefficient_table(case: dict) -> list[str]:
    """The coefficients of a case, the best known first."""
    rows = sorted(named(case["coefficients"]), key=lambda row: row["posterior"])

    def percent(key):
        return lambda row: "infinite" if row[key] is None else f"{100 * row[key]:.2g}"

    def cost(key):
        return lambda row: "inf" if row[key] is None else f"{row[key]:.2g}"

    return columns(
        rows,
        {
            "coefficient": itemgetter("name"),
            "alone": percent("alone"),
            "data": percent("cramer_rao"),
            "null held": percent("null_held"),
            "with prior": percent("posterior"),
            "null part": lambda row: f"{row['null_part']:.2g}",
            "sensors": _sensors,
            "at 25 %": cost("cost_at_25_percent"),
            "at 99 %": cost("cost_at_99_percent"),
        },
    )


def cancellation_ratio(case: dict, axis: str) -> float:
    """Largest force error of a term over that of the sum."""
    return max(case["largest_force_errors"][axis].values()) / case["largest_sum"][axis]


def _errors(row) -> dict[str, float]:
    return row["case"]["largest_force_errors"][row["axis"]]


def _largest_vif(row) -> str:
    names = names_by_axis(row["case"])[row["axis"]]
    vif = [row["case"]["vif"][name] for name in names if row["case"]["vif"][name] is not None]
    return f"{max(vif):.2g}" if vif else "none"


def _sensors(row) -> str:
    if row["sharper_sensors"] is None:
        return "never"
    return f"{row['sharper_sensors']:.2g}" + (" and the prior" if row["null_part"] > 0.0 else "")

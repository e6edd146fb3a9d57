"""How exactly do linear programming and linear least squares find each coefficient from velocities without noise?

Question: the thesis's Tables 34-39 and Figures 89-96 have them all to six digits, but Z of two boats on the vertical
manoeuvre worse than the rest, and coefficients that are zero three to eight orders below the smallest that is not.
Claim: both find every coefficient to six digits and every zero three orders below the smallest coefficient.
Cost: half a minute. How long each fit takes is in the study `baselines`.
"""

from bayesub.model.linear_form import linear_systems
from bayesub.report.markdown import columns, named
from linear import plots
from thesis import cases
from thesis.optimisers import linear_fits

METHODS = ("LP", "LLS")
QUICK_CASES = (("suboff", "horizontal"),)
DIGITS, ORDERS = 1e-6, 3.0
FIGURES = {
    "errors": "Relative error of every coefficient without noise, by manoeuvre and boat. Linear programming "
    "(circles) is an order or two above linear least squares (bars); arrows at the edge are exact. The drag is "
    "the best known, added masses in sway and roll and terms that hardly act the worst.",
}
GLOSSARY = "booth"
ANSWER = """
Linear programming is at most {cases/*/LP/errors; max; .0e} off, linear least squares {cases/*/LLS/errors; max; .0e}.
Coefficients that are zero are found to be zero, {cases/*/LP/zeros; min; .0f} orders of magnitude and more below the
smallest that is not. Z on the vertical manoeuvre is no worse than the rest.
"""


def compute(run):
    """Errors by coefficient, and orders of the zeros."""
    pairs = QUICK_CASES if run.quick else cases.CASES
    run.progress.stage("fits")
    numbers = {}
    for n, (vehicle, manoeuvre) in enumerate(pairs, start=1):
        boat = cases.load_vehicle(vehicle)
        systems = linear_systems(cases.simulate(boat, cases.load_manoeuvre(manoeuvre, boat)))
        names = cases.free_coefficients(boat, manoeuvre)
        fits = linear_fits(boat, systems, cases.held(manoeuvre), names)
        numbers[f"{vehicle} {manoeuvre}"] = {
            method: {
                "errors": dict(zip(names, fits["errors"][method], strict=True)),
                "zeros": fits["zeros"][method],
            }
            for method in METHODS
        }
        run.progress.update(n, len(pairs), "cases")
    return {"cases": numbers}


def draw(run, numbers):
    """Errors by coefficient, and the worst of each case."""
    plots.draw_errors(run.figure("errors"), numbers["cases"])
    run.page(tables(numbers["cases"]))


def tables(numbers):
    """Largest error with its coefficient, and orders of the zeros."""
    cells = {"case": lambda c: c["name"]}
    for method in METHODS:
        cells |= {
            f"{method}: largest relative error": lambda c, m=method: worst(c[m]["errors"]),
            f"{method}: largest zero, orders below the smallest": lambda c, m=method: zeros(c[m]["zeros"]),
        }
    yield from columns(named(numbers), cells)


def worst(errors):
    """The largest error and whose it is."""
    name = max(errors, key=lambda n: errors[n] or 0.0)
    return f"{errors[name]:.1e} ({name})"


def zeros(orders):
    """Orders of magnitude; exact if every zero is."""
    return "exact" if orders is None else f"{orders:.1f}"


def claims(numbers):
    """Six digits, and zeros that are zero."""
    for name, case in numbers["cases"].items():
        for method in METHODS:
            largest = max(e for e in case[method]["errors"].values() if e is not None)
            yield largest < DIGITS, f"{name}: {method} is {largest:.1e} off"
            orders = case[method]["zeros"]
            yield orders is None or orders > ORDERS, f"{name}: a zero by {method} is only {orders:.1f} orders below"

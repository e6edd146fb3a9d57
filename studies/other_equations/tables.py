"""The page of :mod:`studies/other_equations`."""

from collections.abc import Iterator
from operator import itemgetter

from bayesub.report.markdown import columns

SENSORS = ("track", "rounded")

# What stands above each table.
RANKS = """\
Rank / columns of each axis. In brackets the axes whose equations of motion are null directions of this one: it has
their terms, those of the rigid body among them. A null direction without an added mass would be counted as one of
terms. The condition number is the largest of the axes, without null directions.
"""
SPECTRA = """
Noise-free readings and a prior of 25 %: free coefficients, null directions of these, directions sharper than the prior,
coefficients with a posterior sd below 10 % and below 90 % of the prior's (linearised), and the decades that the
spectrum spans without null directions. A track has 0.5 m on a boat of 102.26 m, in proportion to the length, and 0.1
degrees; rounded are velocities to 1 cm/s and accelerations to 1 mm/s^2 (thesis section 9.6).
"""
FITS = """
Posteriors of a noisy track of the horizontal spiral. Errors are the largest distances from the true track, of the
posterior mean on unseen manoeuvres, in ship lengths. Coverage is that of posterior bands at ten times of each.
"""


def page(numbers: dict) -> Iterator[str]:
    """Ranks and mechanisms, spectra, and fits: the lines of Markdown tables."""
    cases, fits = numbers["cases"].values(), numbers["fits"].values()
    where = {key: itemgetter(key) for key in ("equations", "vehicle", "manoeuvre")}
    yield RANKS
    cells = {axis: lambda r, axis=axis: axis_cell(r["axes"].get(axis)) for axis in "XYZKMN"}
    cells["condition"] = lambda r: f"{max(one['condition'] for one in r['axes'].values()):.0e}"
    yield from columns(cases, where | cells)
    yield SPECTRA
    cells = {"free": lambda r: r["spectra"]["track"]["n_params"], "null": lambda r: r["spectra"]["track"]["n_null"]}
    for sensors in SENSORS:
        cells[f"{sensors}: sharper"] = lambda r, s=sensors: r["spectra"][s]["n_sharper"]
        cells[f"{sensors}: < 10 %"] = lambda r, s=sensors: r["spectra"][s]["n_known"]
        cells[f"{sensors}: < 90 %"] = lambda r, s=sensors: r["spectra"][s]["n_sharpened"]
        cells[f"{sensors}: decades"] = lambda r, s=sensors: f"{r['spectra'][s]['decades']:.1f}"
    yield from columns(cases, where | cells)
    yield FITS
    cells = {
        "vehicle": itemgetter("vehicle"),
        "fitted with": itemgetter("equations"),
        "sharpened": lambda f: f"{f['posterior']['n_sharpened']} of {f['posterior']['n_params']}",
        "converged": lambda f: "yes" if f["posterior"]["converged"] else "no",
        "error, median": lambda f: f"{f['predictions']['median_lengths']:.2g}",
        "largest": lambda f: f"{f['predictions']['largest_lengths']:.2g}",
        "of the guess, median": lambda f: f"{f['predictions']['guess_median_lengths']:.2g}",
        "50 %": lambda f: f"{f['predictions']['coverage']['0.5']:.0%}",
        "90 %": lambda f: f"{f['predictions']['coverage']['0.9']:.0%}",
        "model check": lambda f: faults(f["check"]),
        "SQP: nearer than the guess": lambda f: shares(f["sqp"]),
    }
    yield from columns(fits, cells)


def axis_cell(one: dict | None) -> str:
    """What is unique of an axis."""
    if one is None:
        return ""
    null = f" ({' '.join(one['equations'])})" if one["motion"] else ""
    return f"{one['rank']}/{one['columns']}{null}" + (f" terms {one['terms']}" if one["terms"] else "")


def faults(check: dict) -> str:
    """The verdict of the model check."""
    return (
        "fits" if check["fits"] else "; ".join(f"{name} {', '.join(words)}" for name, words in check["faults"].items())
    )


def shares(searches: dict | None) -> str:
    """Shares of the coefficients of each search."""
    return "" if searches is None else ", ".join(f"{share:.0%}" for share in searches["nearer_than_guess"])

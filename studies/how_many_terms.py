"""How many of the 101 terms does a trial need, and what does a boat without the others lose in prediction?

Question: equations of motion grow by terms that were measured on other boats. Which of them does a free-swimming trial
ask for, with sensors from ideal to real, which can be set to zero without the record noticing, and does the smaller
boat predict other manoeuvres as well?
Claim: with ideal sensors every term that the boat does not have is found needless, and most that it has are asked for;
with those of a tracking range about half of them. Most terms that go then are seen by the data, and imitated by others.
All terms predict unseen manoeuvres worse than those of highest evidence, at every noise; the fewest that fit as well do
so too unless the sensors are ideal, by up to a factor of two.
Cost: ten minutes on one core. A killed run continues with --resume.

The boat is suboff. It has 83 of the 101 terms of `booth`; of the others 15 could move it, and they are free as well.
The prior is normal about a guess, with half of the size of a term as its standard deviation. Ideal is a thousandth of
the noise of a tracking range (0.5 m, 0.1 degrees, every two seconds). Terms are set to zero one after another, that
which is missed least first, by Savage-Dickey ratios in the normal approximation at the mode. The mode is found again
each time, from the last, and the evidence is that of the Laplace approximation there. Searches start from the truth, so
that no local mode is in the way. A set fits as well as another if its evidence is at most 3 nats less (odds of 20).
Predictions are those of the modes, on random manoeuvres of the thesis (section 8.2).

In the horizontal plane, of four trials, the normal ratios are compared with those of posteriors that are sampled, and
each trial is predicted by the others: by weights of the draws of all where these can be trusted, else by another fit.
"""

from functools import partial
from operator import itemgetter

import numpy as np
from scipy import stats

import bayesub as bs
from bayesub.report import markdown
from how_many_terms import plots, term_sets

NOISES = {"ideal": 0.001, "a hundredth": 0.01, "a tenth": 0.1, "tracking range": 1.0}
ENDS = ("ideal", "tracking range")
TRIALS, SETS = ("zigzag_20_20", "zigzag_10_10", "turning_circle", "horizontal"), ("full", "needed")  # of the plane
RECORDS, MANOEUVRES = 5, 20  # of each noise; that are not seen
SEED = 101
LESS = 3.0  # nats
LEVEL = 0.9  # of intervals
FIGURES = {
    "how_many_terms": "Left, log evidence of smaller and smaller sets of terms, of the first record of each noise, "
    "below the highest: the noisier the sensors, the fewer terms the record asks for. Right, rms position error of the "
    "same sets on unseen manoeuvres, geometric mean: near the circle it is least.",
}
GLOSSARY = "booth"
ANSWER = """
Of 98 terms that could move the boat a trial with ideal sensors asks for {coupled/ideal/needed; median; .0f} and one
with those of a tracking range for {coupled/tracking range/needed; median; .0f} (medians of the records). With the
latter all terms predict unseen manoeuvres {coupled/tracking range/gain/ratio; .1f} times as badly as those of highest
evidence, and the fewest that fit as well {coupled/tracking range/loss/ratio; .1f} times.
"""


def compute(run):
    """Every record of the coupled spiral at each noise; the plane at the ends."""
    noises = {name: NOISES[name] for name in ENDS} if run.quick else NOISES
    n_records, n_manoeuvres, per_fit = (1, 3, 9) if run.quick else (RECORDS, MANOEUVRES, 1)
    given = {"per_fit": per_fit, "less": LESS}
    boat = bs.load_vehicle("suboff")
    makes = {
        f"{name} {k}": partial(term_sets.record, boat, "coupled", noise, SEED + k, n_manoeuvres, **given)
        for name, noise in noises.items()
        for k in range(n_records)
    }
    records = run.parts("records", makes)
    coupled = {name: summary([records[f"{name} {k}"] for k in range(n_records)]) for name in noises}
    planes, trials, sets = (("tracking range",), TRIALS[:2], ("needed",)) if run.quick else (ENDS, TRIALS, SETS)
    makes = {name: partial(term_sets.plane, boat, trials, NOISES[name], SEED, sets, **given) for name in planes}
    return {"coupled": coupled, "plane": run.parts("plane", makes)}


def summary(records):
    """What the records of a noise say together; the curves are those of the first."""
    first = records[0]
    logs = {key: np.array([r["log_error_m"][key] for r in records], float) for key in ("full", "best", "needed")}
    counts = ("best", "needed", "absent", "absent_best", "absent_needed", "unseen", "failed")
    return {
        **{key: first[key] for key in ("sizes", "log_evidence", "errors_m", "gone", "imitated")},
        **{key: [r[key] for r in records] for key in counts},
        "n_imitated": [len(r["imitated"]) for r in records],
        "error_m": {key: float(np.exp(np.nanmean(values))) for key, values in logs.items()},
        "loss": ratio(logs["needed"] - logs["best"]),
        "gain": ratio(logs["full"] - logs["best"]),
    }


def ratio(differences):
    """Geometric mean of a ratio of errors and its interval over manoeuvres, of their logarithms (n_records, n)."""
    means = np.nanmean(differences, axis=0)
    reach = stats.t.ppf(0.5 + LEVEL / 2, len(means) - 1) * means.std(ddof=1) / np.sqrt(len(means))
    return {"ratio": float(np.exp(means.mean())), "interval": np.exp(means.mean() + np.array([-reach, reach])).tolist()}


def draw(run, numbers):
    """Curves of evidence and errors; tables of the sets, of the order, of the ratios and of the trials left out."""
    coupled = numbers["coupled"]
    plots.draw(run.figure("how_many_terms"), coupled, LESS)
    cells = {
        "noise": itemgetter("name"),
        "terms of highest evidence": lambda r: spread(r["best"]),
        "fewest that fit as well": lambda r: spread(r["needed"]),
        "of them the boat has not": lambda r: f"{spread(r['absent_needed'])} of {r['absent'][0]}",
        "seen, and imitated": lambda r: spread(r["n_imitated"]),
        "not seen": lambda r: spread(r["unseen"]),
        "rms error m: all": lambda r: f"{r['error_m']['full']:.3g}",
        "highest evidence": lambda r: f"{r['error_m']['best']:.3g}",
        "fewest": lambda r: f"{r['error_m']['needed']:.3g}",
        "all over highest": lambda r: interval(r["gain"]),
        "fewest over highest": lambda r: interval(r["loss"]),
    }
    caption = (
        f"The coupled spiral; {len(coupled['ideal']['needed'])} records of each noise, medians and extremes. Errors on "
        f"unseen manoeuvres are geometric means; ratios have {LEVEL:.0%} intervals over the manoeuvres. A term is seen "
        f"if the data hold {LESS:g} nats against its absence when all others are held.\n"
    )
    run.page([caption, *markdown.columns(markdown.named(coupled), cells), ""])
    order = {"noise": itemgetter("name"), "terms in the order in which they go": order_of}
    run.page(["The first record of each noise; ● where evidence is highest, ■ where the fewest fit as well.\n"])
    run.page([*markdown.columns(markdown.named(coupled), order), ""])
    cells = {
        "noise": itemgetter("noise"),
        "terms": itemgetter("n_terms"),
        "converged": lambda r: "yes" if r["converged"] else "NO",
        "log ratios, normal / sampled": lambda r: ", ".join(
            f"{name} {a:.1f} / {b:.1f}" for name, (a, b) in r["ratios"].items()
        ),
        "trial left out: CRPS m, within 90 %, k-hat": lambda r: ", ".join(
            f"{name} {t['crps_m']:.2g}, {t['coverage']:.0%}, {t['k_hat']:.1f}" for name, t in r["left_out"].items()
        ),
    }
    plane = numbers["plane"].items()
    rows = [{"noise": name} | result[key] for name, result in plane for key in SETS if key in result]
    run.page(["The horizontal plane, four trials; posteriors are sampled, with all terms and with the fewest.\n"])
    run.page(markdown.columns(rows, cells))


def order_of(result):
    """The terms that go, first to last."""
    n = result["sizes"][0]
    marks = {n - result["needed"][0]: "■"} | {n - result["best"][0]: "●"}
    return " ".join(f"{marks.get(k, '')} {name}".strip() for k, name in enumerate(result["gone"]))


def spread(values):
    """Median and extremes."""
    low, high = min(values), max(values)
    return f"{np.median(values):g}" if low == high else f"{np.median(values):g} ({low} to {high})"


def interval(result):
    """A ratio with its interval."""
    low, high = result["interval"]
    return f"{result['ratio']:.2f} ({low:.2f} to {high:.2f})"


def claims(numbers):
    """Absent terms go, noise asks for fewer, others cost predictions, and normal ratios are those that are sampled."""
    coupled = numbers["coupled"]
    ideal, real = coupled["ideal"], coupled["tracking range"]
    needed = {name: float(np.median(r["needed"])) for name, r in coupled.items()}
    yield needed["ideal"] > 70, f"ideal sensors ask for {needed['ideal']:g} terms"
    yield 35 < needed["tracking range"] < 50, f"a tracking range asks for {needed['tracking range']:g} terms"
    yield max(ideal["absent_needed"]) == 0, f"with ideal sensors {ideal['absent_needed']} absent terms are kept"
    yield min(real["n_imitated"]) > min(real["unseen"]), "most terms that go are not seen by the data"
    for name, one in coupled.items() if len(real["needed"]) == RECORDS else ():
        yield one["gain"]["interval"][0] > 1.0, f"{name}: all terms predict {interval(one['gain'])} times as badly"
        loss = one["loss"]["interval"][0] > 1.0 or name == "ideal"
        yield loss, f"{name}: the fewest terms predict {interval(one['loss'])} times as badly"
    sampled = [(name, result[key]) for name, result in numbers["plane"].items() for key in SETS if key in result]
    for name, one in sampled:
        for term, (normal, drawn) in one["ratios"].items() if one["converged"] else ():
            sentence = f"{name}: the log ratio of {term} is {drawn} by draws, {normal} by the normal approximation"
            yield abs(normal - drawn) < 0.5 + 0.1 * abs(normal), sentence

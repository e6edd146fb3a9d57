"""Several posteriors side by side: intervals, contractions, distances, and what each predicts, in numbers."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from bayesub.findings import derived
from bayesub.findings.predicted_trial import PredictedTrial
from bayesub.inference.checks.normality import halves, hellinger, wasserstein
from bayesub.inference.sampling import Posterior
from bayesub.io import templates
from bayesub.io.words import cell
from bayesub.model.vehicles import Vehicle
from bayesub.problem.nuisance import of_boat

QUANTILES = tuple(derived.QUANTILES.values())
LONGEST = 200  # characters of a setting in a table
CLEAR = 0.95  # an sd over another, above which both are alike


@dataclass(frozen=True)
class ComparedRun:
    """A run among others."""

    label: str  # unlike that of the others
    vehicle: Vehicle
    posterior: Posterior
    about: dict  # what there is to say of the run: study, trial, equations, version
    settings: dict  # the entries of its configuration by which runs may differ
    prediction: PredictedTrial | None = None  # of the common manoeuvre
    why_not: str = ""  # why there is no prediction
    conditional_sd: Mapping[str, float] = field(default_factory=dict)  # parameter -> sd if all others were known

    @cached_property
    def places(self) -> dict[tuple, int]:
        """What a parameter of the boat is -> its position in the posterior.

        Coefficients are the same if their terms are, and what these refer to.
        """
        equations = self.vehicle.equations
        keys: dict[tuple, int] = {}
        for k, name in enumerate(self.posterior.names):
            if name in equations.index:
                term = equations.term(name)
                scale = term.length_power, term.speed_power, term.unit
                keys[(name, term.axis, term.regressor, *scale, equations.speed, equations.rigid_body_terms)] = k
            elif of_boat(name, self.vehicle):
                keys[(name,)] = k
        return keys

    def reference(self, name: str) -> float:
        """The value of a coefficient in the vehicle file; zero of what is none."""
        equations = self.vehicle.equations
        return float(self.vehicle.xi[equations.index[name]]) if name in equations.index else 0.0

    @cached_property
    def quantiles(self) -> np.ndarray:
        """(5, n_params) of the posterior."""
        return self.posterior.quantiles(QUANTILES)

    def numbers(self, k: int) -> dict:
        """Of one parameter, as JSON types."""
        posterior, quantiles = self.posterior, self.quantiles[:, k].tolist()
        moments = ("mean", "sd", "prior_mean", "prior_sd", "contraction")
        numbers: dict[str, float | None] = {name: float(getattr(posterior, name)[k]) for name in moments}
        numbers |= {"conditional_sd": self.conditional_sd.get(posterior.names[k])}
        return numbers | {f"q{100 * p:g}": value for p, value in zip(QUANTILES, quantiles, strict=True)}


@dataclass(frozen=True)
class Comparison:
    """Several posteriors."""

    runs: tuple[ComparedRun, ...]  # two at least
    manoeuvre: str  # that all predict

    @cached_property
    def parameters(self) -> dict[str, dict[str, int]]:
        """Name -> label of a run -> position of the parameter; with the equation set where another has the name too."""
        keys: dict[tuple, dict[str, int]] = {}
        for run in self.runs:
            for key, k in run.places.items():
                keys.setdefault(key, {})[run.label] = k
        named: dict[str, dict[str, int]] = {}
        by_label = {run.label: run for run in self.runs}
        for key, places in keys.items():
            equations = by_label[next(iter(places))].vehicle.equations.name
            named[key[0] if key[0] not in named else f"{key[0]} ({equations})"] = places
        return named

    def shared(self, *labels: str) -> list[str]:
        """The parameters that all of some runs have."""
        return [name for name, places in self.parameters.items() if all(label in places for label in labels)]

    def _of(self, run: ComparedRun, names: Sequence[str], draws: np.ndarray) -> np.ndarray:
        return draws[..., [self.parameters[name][run.label] for name in names]]

    @cached_property
    def numbers(self) -> dict:
        """Everything there is to say, as JSON types."""
        runs = {
            run.label: run.about
            | {"converged": run.posterior.converged, "shortcomings": list(run.posterior.shortcomings)}
            | {"n_parameters": len(run.places)}
            for run in self.runs
        }
        result = {
            "runs": runs,
            "differences": self.differences,
            "parameters": {
                name: {run.label: run.numbers(places[run.label]) for run in self.runs if run.label in places}
                for name, places in self.parameters.items()
            },
            "pairs": [self._pair(*pair) for pair in itertools.combinations(self.runs, 2)],
            "manoeuvre": self.manoeuvre,
            "predictions": {
                run.label: run.prediction.numbers["motion"] if run.prediction else {"why_not": run.why_not}
                for run in self.runs
            },
        }
        result["sentences"] = self._sentences(result)
        return result

    @cached_property
    def differences(self) -> dict[str, dict[str, str]]:
        """Setting -> label of a run -> its value, of those that are not the same in all runs."""
        keys = sorted(set().union(*(run.settings for run in self.runs)))
        values = {key: [run.settings.get(key) for run in self.runs] for key in keys}
        return {
            key: {run.label: _short(value) for run, value in zip(self.runs, some, strict=True)}
            for key, some in values.items()
            if any(value != some[0] for value in some)
        }

    def _pair(self, first: ComparedRun, second: ComparedRun) -> dict:
        names = self.shared(first.label, second.label)
        pair = {"first": first.label, "second": second.label, "n_shared": len(names)}
        if not names:
            return pair | {"hellinger": None, "by_chance": None, "furthest": "", "wasserstein": {}}
        one, other = (self._of(run, names, run.posterior.draws) for run in (first, second))
        distances = dict(zip(names, wasserstein(one, other).tolist(), strict=True))
        floors = (halves(self._of(run, names, run.posterior.chain)) for run in (first, second))
        pair |= {"hellinger": hellinger(one, other), "by_chance": max(filter(np.isfinite, floors), default=None)}
        return pair | {"furthest": max(distances, key=distances.__getitem__), "wasserstein": distances}

    def _sentences(self, numbers: dict) -> dict[str, str]:
        """What is to be said, by topic."""
        labels = [run.label for run in self.runs]
        names, best = self.shared(*labels), []
        for name in names:
            sds = {label: numbers["parameters"][name][label]["sd"] for label in labels}
            best += [min(labels, key=sds.__getitem__)] if min(sds.values()) < CLEAR * max(sds.values()) else []
        pairs = [pair for pair in numbers["pairs"] if pair["n_shared"]]
        apart = max(pairs, key=lambda pair: pair["hellinger"], default=None)
        flown = {label: p for label, p in numbers["predictions"].items() if p.get("is_flown")}
        values = {"labels": labels, "names": names, "best": best, "apart": apart, "flown": flown, "cell": cell}
        values |= {"clear": CLEAR, "manoeuvre": self.manoeuvre}
        topics = {"shared": True, "known": names, "distance": pairs, "prediction": flown}
        fill = partial(templates.fill, "bayesub.findings", "comparison.txt", **values)
        sentences = {topic: fill(topic=topic) for topic, is_said in topics.items() if is_said}
        missing = [f"{run.label}: {run.why_not}" for run in self.runs if run.why_not]
        sentences |= {"not predicted": "; ".join(missing)} if missing else {}
        return {topic: " ".join(text.split()) for topic, text in sentences.items()}

    def coefficient_rows(self) -> list[dict]:
        """A row for each parameter and run, for a CSV."""
        return [
            {"parameter": name, "run": label} | values
            for name, runs in self.numbers["parameters"].items()
            for label, values in runs.items()
        ]

    def distance_rows(self) -> list[dict]:
        """A row for each shared parameter and pair of runs, for a CSV."""
        return [
            {"parameter": name, "first": pair["first"], "second": pair["second"], "wasserstein_pooled_sd": distance}
            for pair in self.numbers["pairs"]
            for name, distance in pair["wasserstein"].items()
        ]


def _in_words(value) -> str:
    """A setting as it is shown: ``kind track, interval_s 1``, sections separated by semicolons."""
    if isinstance(value, dict):
        return ", ".join(f"{key} {_in_words(item)}" for key, item in value.items())
    if isinstance(value, list):
        return ("; " if any(isinstance(item, dict) for item in value) else " ").join(map(_in_words, value))
    return "" if value is None else str(value)


def _short(value) -> str:
    text = _in_words(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]} .."

"""Everything that a report is about, and every number and sentence that it quotes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from bayesub.findings import derived, disturbances, known_sums, remedies, run_numbers, set_up, unseen, verdicts
from bayesub.findings.run_numbers import STRONG, null_count
from bayesub.findings.set_up import AnyProblem
from bayesub.findings.unseen import TrialPrediction
from bayesub.inference.baselines import Estimate
from bayesub.inference.checks import convergence
from bayesub.inference.checks.discrepancy import Discrepancy
from bayesub.inference.checks.fit import Criticism, criticise
from bayesub.inference.identifiability import NullSpace, Spectrum, conditional_sd, kept, null_space
from bayesub.inference.sampling import CrossCheck, Posterior
from bayesub.io import seeds
from bayesub.io.words import listed
from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.equations import AXES
from bayesub.model.quantities import Quantity
from bayesub.problem.distributions import Prior
from bayesub.problem.nuisance import BODY

PREDICTIVE_DRAWS, PRIOR_DRAWS = 100, 2000
BEST = 8  # coefficients that are named as best known


@dataclass(frozen=True)
class Results:
    """Everything that a report is about."""

    problem: AnyProblem  # what was solved
    estimates: Sequence[Estimate]  # by the baselines
    spectrum: Spectrum  # with its null directions last
    posterior: Posterior  # what was sampled
    check: CrossCheck | None  # the comparison with another sampler
    seed: int = 0  # of all that is random in a report, each with a stream of its own (:mod:`bayesub.io.seeds`)
    predictions: Sequence[TrialPrediction] = ()  # of trials that were not fitted
    quantities: Sequence[Quantity] = ()  # that follow from the coefficients, besides the built-in ones
    # What to measure or fly next, as :meth:`bayesub.design.prescription.Prescription.to_json` has it
    prescription: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @cached_property
    def summary(self) -> Posterior:
        """The posterior of the parameters that tables and figures are of, beside what was known before."""
        return self.posterior.given(self.problem.prior).part(self.problem.others)

    @cached_property
    def prior(self) -> Prior:
        """The prior of all parameters, with the scale that was found."""
        return self.posterior.known_before(self.problem.prior)

    @cached_property
    def prior_of_others(self) -> Prior:
        """The prior of the parameters of :attr:`summary`."""
        return self.summary.known_before(self.problem.prior_of_others)

    @cached_property
    def null_sds(self) -> np.ndarray:
        """(n_params,) sd along each direction of the spectrum where the data say nothing of it, in prior sds.

        That is 1, and of null directions what the prior alone makes of them beside what the data say of all others.
        """
        spectrum, result = self.spectrum, np.ones(len(self.spectrum.names))
        steps = spectrum.directions[self._null] * spectrum.prior_sd
        prior, draws = self.problem.prior_of_others, self.summary.draws
        result[self._null] = kept(prior, draws, steps, self._null_coordinates)
        return result

    @property
    def _null(self) -> slice:
        return slice(len(self.spectrum.names) - self.spectrum.n_null, None)

    @property
    def _null_coordinates(self) -> np.ndarray:
        return self.spectrum.coordinates[self._null] / self.spectrum.prior_sd

    @cached_property
    def null_contraction(self) -> np.ndarray:
        """(n_null,) posterior sd along each null direction over what the prior alone makes of it: 1 is right."""
        return (self.summary.draws @ self._null_coordinates.T).std(axis=0, ddof=1) / self.null_sds[self._null]

    @cached_property
    def correlation(self) -> np.ndarray:
        """(n_params, n_params) of what is drawn of :attr:`summary`: ratios of coefficients to the reference."""
        return run_numbers.correlation_of_ratios(self.problem, self.summary)

    @cached_property
    def conditional_sd(self) -> np.ndarray:
        """(n_params,) of the parameters of :attr:`summary`, each if all others were known."""
        return conditional_sd(self.problem, self.posterior.draws)

    def _random(self, member: int) -> np.random.Generator:
        return seeds.generator(self.seed, seeds.REPORT, member)

    @cached_property
    def draws(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the posterior, at which motions and residuals are looked at."""
        places = self._random(seeds.MOTIONS).choice(len(self.posterior.draws), PREDICTIVE_DRAWS)
        return self.posterior.draws[places]

    @cached_property
    def prior_predictive(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the prior, which are drawn beside those of the posterior."""
        return self.prior.sample(self._random(seeds.PRIOR_MOTIONS), PREDICTIVE_DRAWS)

    @cached_property
    def known_sums(self) -> list[dict]:
        """The weighted sums and the quotients of coefficients that are known to one per cent.

        Quotients are of masses too: that of the boat less the added mass of the axis, in the unit of this.
        """
        n, vehicle = self.problem.n_coefficients, self.problem.vehicle
        names, draws = list(self.summary.names[:n]), self.summary.draws[:, :n]
        before = self.prior_of_others.sample(self._random(seeds.PRIOR_SUMS), PRIOR_DRAWS)[:, :n]
        terms = [vehicle.equations.term(name) for name in names]
        axes = [term.axis for term in terms]
        rows = known_sums.known_sums(names, axes, draws, np.atleast_2d(np.cov(before.T)))
        body = {key for name in set(self.problem.names) & BODY.keys() for key in BODY[name]}  # which draws have
        for k, term in enumerate(terms):
            own = "mass" if term.axis in AXES[:3] else f"I{'xyz'[AXES.index(term.axis) - 3] * 2}"
            if term.regressor == ACCELERATIONS[a := AXES.index(term.axis)] and own not in body:
                column = vehicle.equations.index[term.name]
                of_boat = vehicle.mass_matrix[a, a] / vehicle.dimensional_factors[column] + vehicle.xi[column]
                names.append(f"({'m' if a < 3 else 'I'} - {term.name})")
                axes.append(term.axis)
                draws, before = (np.column_stack([one, of_boat - one[:, k]]) for one in (draws, before))
        return rows + known_sums.known_quotients(names, axes, draws, before)

    @cached_property
    def forces(self) -> list[disturbances.InferredForces]:
        """Histories of unmodelled forces, of each trial that has them."""
        return list(disturbances.inferred_forces(self.problem, self.posterior.draws))

    @cached_property
    def derived(self) -> derived.Derived:
        """Quantities that follow from the coefficients, of the prior and of the posterior."""
        rng = self._random(seeds.DERIVED)
        return derived.derive(self.problem, self.posterior.draws, rng, self.quantities, self.prior)

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """Channel -> quantile residuals (PREDICTIVE_DRAWS, n_readings)."""
        return self.problem.quantile_residuals(self.draws, self._random(seeds.RESIDUALS))

    @cached_property
    def times(self) -> dict[str, np.ndarray]:
        """Channel -> times (n_readings,) of its residuals, s."""
        return {name: self.problem.channels[name][0].times for name in self.residuals}

    @cached_property
    def criticism(self) -> Criticism:
        """The tests of the residuals."""
        return criticise(self.residuals, self.times)

    @cached_property
    def explanations(self) -> list[Discrepancy]:
        """Why residuals are correlated, best first; empty if they are not."""
        return remedies.explain(self.problem, self.criticism, self.posterior.best)

    @cached_property
    def null_space(self) -> NullSpace:
        """The directions that leave the motion the same, where the spectrum was taken."""
        at = self.posterior.best.copy()
        at[self.problem.others] = self.spectrum.values
        return null_space(self.problem, at, draws=self.posterior.draws)


def numbers_of(results: Results) -> dict:
    """Every number of a report and its sentences, as JSON types, without those of the study that asked."""
    problem, spectrum, null_space = results.problem, results.spectrum, results.null_space
    numbers = run_numbers.collect(
        problem, results.estimates, spectrum, results.posterior, results.summary, null_space, results.conditional_sd
    )
    numbers["null_contraction"] = results.null_contraction.tolist()
    numbers["set_up"] = set_up.rows(results.problem)
    numbers["criticism"] = results.criticism.to_json()
    reasons = results.explanations
    numbers["criticism"]["explanations"] = [reason.to_json() for reason in reasons]
    numbers["disturbance"] = disturbances.numbers(results.problem, results.posterior.draws, results.forces)
    numbers["predictions"] = unseen.numbers(results.predictions)
    numbers["derived"] = derived.numbers(results.derived)
    trials = [trial for _, trial, _ in results.problem.each_trial(results.posterior.best)]
    n_logs = sum(trial.record.truth is None for trial in trials)
    numbers["verdict"] = unseen.sentence(numbers["predictions"], n_logs, len(trials))
    numbers["verdict"]["fit"] = remedies.advise(results.criticism, results.problem, reasons)
    if not results.criticism.fits and (steps := remedies.on_steps(results.problem, results.residuals)):
        numbers["verdict"]["steps"] = steps
    if reasons:
        numbers["verdict"]["lines_to_add"] = remedies.lines_to_add(reasons[0], problem, results.posterior.best)
    numbers["verdict"] |= disturbances.sentences(numbers["disturbance"]) | run_numbers.sentences(numbers)
    numbers["verdict"]["derived"] = derived.sentence(numbers["derived"])
    numbers["known_sums"] = results.known_sums
    numbers["verdict"]["known_sums"] = known_sums.sentence(results.known_sums)
    numbers["prescription"] = results.prescription
    if results.prescription:
        numbers["verdict"]["next"] = _next_sentence(results.prescription)
    if not results.posterior.converged:
        jump = convergence.largest_jump(results.problem, results.posterior.draws, results._random(seeds.JUMPS))
        numbers["convergence"]["largest_jump"] = jump
        if sentence := convergence.jump_sentence(jump, numbers["step_s"]):
            numbers["verdict"]["jumps"] = sentence
    if results.check is not None:
        numbers["cross_check"] = results.check.to_json()
        numbers["verdict"]["cross_check"] = results.check.sentence
    verdict = verdicts.verdict_on(numbers)
    numbers["outcome"] = {"verdict": verdict, "status": verdicts.STATUS[verdict]}
    numbers["glance"] = glance(numbers)
    return numbers


def _next_sentence(prescription: Mapping[str, Mapping[str, Any]]) -> str:
    """What each way to go on leaves of the sds of what is asked for, of the numbers of a prescription."""
    parts, every = [], list(prescription.values())
    for way in every[0]["after"]:
        left = sorted(round(100.0 * one["after"][way] / one["sd"]) for one in every)
        least = f"{left[0]} to " if left[0] < left[-1] else ""
        parts.append(f"{least}{left[-1]} % after {way}")
    return f"Of the sds of {listed(list(prescription))} there would be left: {'; '.join(parts)}."


def glance(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What a run says of boat, coefficients, what the trial cannot tell, and whether to trust it, as JSON types.

    `numbers`: the content of ``numbers.json`` with its sentences under "verdict".

    Gives "boat": rows ``name, label, unit, posterior, prior`` (5 and 95 % as words) of the headline quantities;
    "stable": rows ``where, posterior, prior`` (probabilities from 0 to 1); "known": rows ``name, percent`` of
    coefficients known to 5 %, best first; "best": the same of the best known; "n_coefficients", "n_sharper",
    "n_untouched": numbers of them; "n_null", "n_faint": the combinations that leave the motion exactly the same, and
    those that change it by less than any instrument sees; "not_unique": both in words; "hold": coefficients which,
    held, make the rest unique; "pairs": rows ``pair, correlation`` above 0.9, strongest first; "n_pairs": how many are
    above 0.7; "marks": rows ``topic, good, word, text``, the verdict taken apart.
    """
    rows = numbers["parameters"]
    known, narrowed = run_numbers.known_rows(rows)
    best = [{"name": row["name"], "percent": 100.0 * row["relative_sd"]} for row in narrowed]
    return {
        "boat": list(derived.headlines(numbers["derived"])),
        "stable": [
            {"where": derived.STABILITIES[name], **shares} for name, shares in numbers["derived"]["stable"].items()
        ],
        "known": best[: len(known)],
        "best": best[:BEST],
        "n_coefficients": len(rows),
        "n_sharper": len(narrowed) - len(known),
        "n_untouched": len(rows) - len(narrowed),
        "n_null": sum(rank["null_dimension"] for rank in numbers["ranks"].values()),
        "n_faint": sum(rank["rank"] - rank["practical_rank"] for rank in numbers["ranks"].values()),
        "not_unique": null_count(numbers["ranks"]),
        "hold": [name for rank in numbers["ranks"].values() for name in rank["pivots"]],
        "pairs": [pair for pair in numbers["trade_offs"] if abs(pair["correlation"]) >= STRONG],
        "n_pairs": numbers["n_trade_offs"],
        "marks": list(_marks(numbers)),
    }


def _marks(numbers: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Whether the sampling, the fit, the prediction, the prior, the log and the cross-check are good, a row each."""
    verdict, sampling = numbers["verdict"], numbers["convergence"]
    ess = min(sampling["min_bulk_ess"], sampling["min_tail_ess"])
    text = "; ".join(sampling["shortcomings"]) or f"R-hat {sampling['max_rhat']:.4f}, ESS {ess:.0f}"
    yield _mark("sampling", sampling["converged"], "converged", "not converged", text)
    yield _mark("fit", numbers["criticism"]["fits"], "fits", "does not fit", verdict["fit"])
    if numbers["predictions"]:
        good = all(trial["predicts"] for trial in numbers["predictions"])
        yield _mark("prediction", good, "predicts", "does not predict", verdict["prediction"])
    if "prediction" in verdict and not numbers["predictions"]:
        yield {"topic": "prediction", "good": None, "word": "not tried", "text": verdict["prediction"]}
    if numbers["conflict"]["found"] or numbers["conflict"]["refuted"]:
        good = not numbers["conflict"]["refuted"]
        yield _mark("prior", good, "disagrees in part", "in conflict with the data", verdict.get("conflict", ""))
    if verdicts.contradicted(numbers["rests_on"]):
        yield _mark("log", False, "", "contradicts itself", verdict["contradiction"])
    if check := numbers.get("cross_check"):
        yield _mark("second sampler", check["verdict"] == "agree", "agrees", "does not confirm", verdict["cross_check"])


def _mark(topic: str, good: bool, word: str, bad_word: str, text: str) -> dict[str, Any]:
    return {"topic": topic, "good": good, "word": word if good else bad_word, "text": text}

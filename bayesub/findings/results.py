"""Everything that a report is about, and every number and sentence that it quotes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.findings import derived, disturbances, remedies, run_numbers, set_up, unseen
from bayesub.findings.set_up import AnyProblem
from bayesub.findings.unseen import TrialPrediction
from bayesub.inference.baselines import Estimate
from bayesub.inference.checks import convergence
from bayesub.inference.checks.discrepancy import Discrepancy
from bayesub.inference.checks.fit import Criticism, criticise
from bayesub.inference.identifiability import NullSpace, Spectrum, null_space
from bayesub.inference.sampling import CrossCheck, Posterior
from bayesub.model.quantities import Quantity

PREDICTIVE_DRAWS = 100


@dataclass(frozen=True)
class Results:
    """Everything that a report is about."""

    problem: AnyProblem  # what was solved
    estimates: Sequence[Estimate]  # by the baselines
    spectrum: Spectrum  # with its null directions last
    posterior: Posterior  # what was sampled
    check: CrossCheck | None  # the comparison with another sampler
    # Chooses the draws at which motions and residuals are looked at, and boats of the prior; nothing else in a report
    # is random
    rng: np.random.Generator
    predictions: Sequence[TrialPrediction] = ()  # of trials that were not fitted
    quantities: Sequence[Quantity] = ()  # that follow from the coefficients, besides the built-in ones

    @cached_property
    def summary(self) -> Posterior:
        """The posterior of the parameters that tables and figures are of."""
        return self.posterior.part(self.problem.others)

    @cached_property
    def draws(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the posterior, at which motions and residuals are looked at."""
        return self.posterior.draws[self.rng.choice(len(self.posterior.draws), PREDICTIVE_DRAWS)]

    @cached_property
    def prior_predictive(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the prior, which are drawn beside those of the posterior."""
        return self.problem.prior.sample(self.rng.spawn(1)[0], PREDICTIVE_DRAWS)

    @cached_property
    def forces(self) -> list[disturbances.InferredForces]:
        """Histories of unmodelled forces, of each trial that has them."""
        return list(disturbances.inferred_forces(self.problem, self.posterior.draws))

    @cached_property
    def derived(self) -> derived.Derived:
        """What follows from the coefficients, of the prior and of the posterior."""
        (rng,) = self.rng.spawn(1)
        return derived.derive(self.problem, self.posterior.draws, rng, self.quantities)

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """Channel -> quantile residuals (PREDICTIVE_DRAWS, n_readings)."""
        return self.problem.quantile_residuals(self.draws, self.rng)

    @cached_property
    def times(self) -> dict[str, np.ndarray]:
        """Channel -> times (n_readings,) of its residuals, s."""
        return {name: self.problem.channels[name][0].times for name in self.residuals}

    @cached_property
    def criticism(self) -> Criticism:
        """What the residuals say of the model."""
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
        return null_space(self.problem, at)


def numbers_of(results: Results) -> dict:
    """Every number of a report and its sentences, as JSON types, without those of the study that asked."""
    numbers = run_numbers.collect(
        results.problem, results.estimates, results.spectrum, results.posterior, results.null_space
    )
    numbers["set_up"] = set_up.rows(results.problem)
    numbers["criticism"] = results.criticism.to_json()
    reasons = results.explanations
    numbers["criticism"]["explanations"] = [reason.to_json() for reason in reasons]
    numbers["disturbance"] = disturbances.numbers(results.problem, results.posterior.draws, results.forces)
    numbers["predictions"] = unseen.numbers(results.predictions)
    numbers["derived"] = derived.numbers(results.derived)
    trials = [trial for _, trial, _ in results.problem.each_trial(results.posterior.best)]
    n_logs = sum(trial.record.truth is None for trial in trials)
    numbers["verdict"] = unseen.sentence(numbers["predictions"], n_logs, len(trials)) | {
        "fit": remedies.advise(results.criticism, results.problem, reasons)
    }
    if not results.criticism.fits and (steps := remedies.on_steps(results.problem, results.residuals)):
        numbers["verdict"]["steps"] = steps
    if reasons:
        numbers["verdict"]["lines_to_add"] = remedies.lines_to_add(reasons[0], results.problem)
    numbers["verdict"] |= disturbances.sentences(numbers["disturbance"]) | run_numbers.sentences(numbers)
    numbers["verdict"]["derived"] = derived.sentence(numbers["derived"])
    if not results.posterior.converged:
        jump = convergence.largest_jump(results.problem, results.posterior.draws, results.rng.spawn(1)[0])
        numbers["convergence"]["largest_jump"] = jump
        if sentence := convergence.jump_sentence(jump, numbers["step_s"]):
            numbers["verdict"]["jumps"] = sentence
    if results.check is not None:
        numbers["cross_check"] = results.check.to_json()
        numbers["verdict"]["cross_check"] = results.check.sentence
    return numbers

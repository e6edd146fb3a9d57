"""What is said of a run before anything is sampled: whether the mode of the posterior fits the readings."""

from dataclasses import dataclass, field

import numpy as np

from bayesub.findings import proposals, remedies
from bayesub.inference.checks.fit import criticise


@dataclass(frozen=True)
class ModeFit:
    """How the posterior mode fits.

    Attributes
    ----------
    misfit : float
        Median size of the residuals over that of their noise, of the worst channel; one if the mode fits. A few
        outliers leave it alone.
    channel : str
        The worst channel; empty if no channel has residuals.
    sentences : dict of str to str
        What is wrong and what to try, by topic as in a report; empty if nothing is.
    """

    misfit: float = 1.0
    channel: str = ""
    sentences: dict[str, str] = field(default_factory=dict)

    def to_json(self) -> dict:
        """Everything as JSON types."""
        return {"misfit": self.misfit, "channel": self.channel, "sentences": self.sentences}


def fit_of_mode(problem, mode: np.ndarray, rng: np.random.Generator) -> ModeFit:
    """The tests of the residuals at the posterior mode (n_params,), and why they are correlated if they are.

    Parameters
    ----------
    problem : Problem or JointProblem
    mode : (n_params,) array
    rng : numpy.random.Generator
        Of what is random in quantile residuals: where in its rounding interval a reading was.
    """
    residuals = problem.quantile_residuals(mode[None], rng)
    channels = problem.channels
    criticism = criticise(residuals, {name: channels[name][0].times for name in residuals})
    if not criticism.checks:
        return ModeFit()
    channel, worst = max(criticism.checks.items(), key=lambda item: item[1].spread)
    if criticism.fits:
        return ModeFit(worst.spread, channel)
    reasons = remedies.reasons(problem, criticism, mode)
    sentences = {"fit_of_the_mode": remedies.sentence(criticism, problem, reasons)}
    if reasons:
        sentences["lines_to_add"] = proposals.lines(reasons[0], problem)
    return ModeFit(worst.spread, channel, sentences)

"""What the posterior of a finished run knows before the next trial."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesub.design.judge import Judge
from bayesub.io.errors import InputError
from bayesub.model.vehicles import Vehicle
from bayesub.study.after.finished_run import finished_run
from bayesub.study.run.result import NOT_CONVERGED


@dataclass(frozen=True)
class KnownBefore:
    """The posterior of the coefficients of a run.

    Attributes
    ----------
    folder : Path
        Of the run.
    names : tuple of str
        The coefficients, n of them.
    draws : (n_draws, n) array
    """

    folder: Path
    names: tuple[str, ...]
    draws: np.ndarray

    def vehicle(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle of the posterior means."""
        xi = vehicle.xi.copy()
        xi[vehicle.equations.columns(self.names)] = self.draws.mean(axis=0)
        return replace(vehicle, xi=xi)

    def judge(self, judge: Judge) -> Judge:
        """The judge whose prior is the posterior; coefficients of the judge are among those of the posterior."""
        places = [self.names.index(name) for name in judge.names]
        prior_sd = judge.empty().prior_sd
        covariance = np.atleast_2d(np.cov(self.draws[:, places].T)) / np.outer(prior_sd, prior_sd)
        return replace(judge, precision=np.linalg.inv(covariance))

    def sets(self, vehicle: Vehicle, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n, n_terms) coefficient sets of draws."""
        sets = np.tile(vehicle.xi, (n, 1))
        sets[:, vehicle.equations.columns(self.names)] = self.draws[rng.choice(len(self.draws), n)]
        return sets


def known_before(folder: Path, vehicle: Vehicle) -> KnownBefore:
    """Read the posterior of a run of a study in TOML.

    Raises
    ------
    InputError
        For a folder that is no run, a run that has not finished or not converged, and one of another vehicle.
    """
    try:
        run = finished_run(folder)
    except InputError as error:
        raise InputError(f"--after {error}", error.kind, error.key) from None
    if run.verdict == NOT_CONVERGED:
        raise InputError(
            f"--after {folder}: the run has not converged, and its posterior may be wrong; raise max_steps of "
            "[sampler] in its study and continue it with --resume",
            "state",
            "--after",
        )
    flown, posterior = run.vehicle, run.posterior
    if flown.name != vehicle.name or flown.equations != vehicle.equations:
        raise InputError(
            f"--after {folder}: is a run of '{flown.name}', not of '{vehicle.name}'; design for that boat",
            "conflict",
            "--after",
        )
    names = tuple(name for name in posterior.names if name in vehicle.equations.index)
    return KnownBefore(folder, names, posterior.draws[:, [posterior.names.index(name) for name in names]])

"""What the posterior of a finished run knows before the next trial."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesub.design.judge import Judge
from bayesub.io.errors import InputError
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.study.redraw import saved_study
from bayesub.study.result import NOT_CONVERGED, load_result
from bayesub.study.run_folder import CONFIG, saved_config


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
    config = saved_config(folder)
    if config is None:
        raise InputError(f"--after {folder}: is not a run folder, {CONFIG} is missing")
    if "script_sha256" in config:
        raise InputError(f"--after {folder}: is the run of a script; give that of a study in TOML")
    if "design" in config:
        raise InputError(f"--after {folder}: is a design, which nobody has flown; give the run of a study of its log")
    result = load_result(folder)
    if result is None:
        raise InputError(f"--after {folder}: the run has not finished; continue it with bayesub run .. --resume")
    if result.verdict == NOT_CONVERGED:
        raise InputError(
            f"--after {folder}: the run has not converged, and its posterior may be wrong; raise max_steps of "
            "[sampler] in its study and continue it with --resume"
        )
    if not (folder / "posterior.nc").exists():
        raise InputError(f"--after {folder}: posterior.nc is missing; run the study again")
    study = saved_study(folder, config)
    flown = load_vehicle(study.vehicle, study.path)
    if flown.name != vehicle.name or flown.equations != vehicle.equations:
        raise InputError(f"--after {folder}: is a run of '{flown.name}', not of '{vehicle.name}'; design for that boat")
    from bayesub.sampling import posterior_file

    posterior = posterior_file.load(folder / "posterior.nc")
    names = tuple(name for name in posterior.names if name in vehicle.equations.index)
    return KnownBefore(folder, names, posterior.draws[:, [posterior.names.index(name) for name in names]])

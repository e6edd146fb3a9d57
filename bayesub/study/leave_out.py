"""Fits of all trials of a study but one, for each of them, kept in the run folder trial by trial."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError
from bayesub.problem.joint import JointProblem
from bayesub.problem.unseen import UnseenTrial
from bayesub.sampling import Criteria, Posterior, posterior_file, sample
from bayesub.study.check_section import warm_up
from bayesub.study.prepare import Setup
from bayesub.study.run_folder import TimedProgress

LEFT_OUT = "left_out"
_STREAM = 6  # of the study's seed, with one for each trial


def check(setup: Setup) -> None:
    """Raise InputError for a study of which no trial can be left out."""
    if len(setup.trials) < 2:
        raise InputError(
            "--leave-out is for studies of several trials; of one log, name a second one to predict in [[check]]"
        )
    unseen_trials(setup)


def unseen_trials(setup: Setup) -> dict[str, UnseenTrial]:
    """Each trial of a study, to be predicted by the others; InputError for one that is too short."""
    trials = {}
    for name, problem in setup.problem.problems.items():
        trial = UnseenTrial(name, problem, 0.0, is_left_out=True)
        if len(trial.own(setup.problem.without(name))):
            try:
                trial = UnseenTrial(name, problem, warm_up(problem), is_left_out=True)
            except InputError as error:
                raise error.within(f"trial '{name}'") from None
        trials[name] = trial
    return trials


def fit(setup: Setup, folder: Path, progress: TimedProgress) -> None:
    """Sample the posterior of the others for each trial that has no converged one in the folder.

    A fit that was stopped continues from its checkpoint. Of one that finds no mode, or accepts nothing, progress tells
    why, and the others go on.
    """
    (folder / LEFT_OUT).mkdir(exist_ok=True)
    sampler = setup.study.sampler
    criteria = Criteria(sampler.rhat, sampler.ess, sampler.taus)
    for k, name in enumerate(setup.trials):
        place = _place(folder, name)
        if place.exists() and (before := posterior_file.load(place)).converged and before.criteria == criteria:
            continue
        progress.stage(f"sample without {name}")
        try:
            posterior = sample(
                setup.problem.without(name),
                rng=np.random.default_rng(np.random.SeedSequence(setup.study.seed, spawn_key=(_STREAM, k))),
                n_ensembles=sampler.n_ensembles,
                n_walkers=sampler.n_walkers,
                max_steps=sampler.max_steps,
                criteria=criteria,
                checkpoint=folder / LEFT_OUT / f"chain_{name}",
                progress=progress,
            )
        except InputError as error:
            progress.remark(f"without '{name}': {error}")
        else:
            posterior_file.save(posterior, place)


def posteriors(setup: Setup, folder: Path) -> dict[str, tuple[JointProblem, Posterior]]:
    """Trial -> problem and posterior of the others, of those trials that have been left out so far."""
    names = [name for name in setup.trials if name and _place(folder, name).exists()]
    return {name: (setup.problem.without(name), posterior_file.load(_place(folder, name))) for name in names}


def is_done(names: Iterable[str], folder: Path) -> bool:
    """Whether each of the trials has been left out."""
    return all(_place(folder, name).exists() for name in names)


def _place(folder: Path, name: str) -> Path:
    return folder / LEFT_OUT / f"{name}.nc"

"""Fits of all trials of a study but one, for each of them, kept in the run folder trial by trial."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path

from bayesub.campaign import executors
from bayesub.campaign.campaign import complete
from bayesub.campaign.executors import is_remote
from bayesub.inference.sampling import Posterior, posterior_file
from bayesub.io import seeds
from bayesub.io.errors import InputError
from bayesub.io.terminal import Progress
from bayesub.problem.joint import JointProblem
from bayesub.problem.unseen import left_out
from bayesub.study.run.infer import criteria, sample_posterior
from bayesub.study.run.prepare import Setup
from bayesub.study.run.run_folder import LEFT_OUT, RunContext


def check(setup: Setup) -> None:
    """Raise InputError for a study of which no trial can be left out."""
    if len(setup.trials) < 2:
        text = "--leave-out is for studies of several trials; of one log, name a second one to predict in [[check]]"
        raise InputError(text, "conflict", "--leave-out")
    left_out(setup.problem)


def fit(setup: Setup, context: RunContext) -> None:
    """Sample the posterior of the others for each trial that has no converged one in the folder.

    A fit that was stopped continues from its checkpoint. Of one without a mode progress tells why; others go on.
    """
    folder, progress = context.folder, context.progress
    (folder / LEFT_OUT).mkdir(exist_ok=True)
    store = _Fits(setup, folder, progress)
    names = {name: (k, name) for k, name in enumerate(setup.trials) if name not in store.results}
    progress.stage("leave out")
    executor = context.executor or executors.local()
    failures = folder / LEFT_OUT / "failures.txt"
    complete(
        executor, partial(_without, setup, folder), names, store, failures=failures, progress=progress, unit="trials"
    )


def _without(setup: Setup, folder: Path, trial: tuple[int, str]) -> Posterior | str:
    """The posterior of all trials but one, whose number and name are given, or why there is none."""
    k, name = trial
    place = None if is_remote() else folder / LEFT_OUT / f"chain_{name}"
    try:
        problem, rng = setup.problem.without(name), setup.generator(seeds.LEFT_OUT, k)
        return sample_posterior(setup, problem, rng, checkpoint=place)
    except InputError as error:
        return str(error)


class _Fits:
    """The fits in a run folder; those that have converged by the criteria of the study are done."""

    def __init__(self, setup: Setup, folder: Path, progress: Progress):
        self.folder, self.progress, self.results = folder, progress, {}
        for name in filter(lambda name: _place(folder, name).exists(), setup.trials):
            before = posterior_file.load(_place(folder, name))
            if before.converged and before.criteria == criteria(setup):
                self.results[name] = True

    def add(self, name: str, result: Posterior | str) -> None:
        """Save a posterior, or tell why there is none."""
        if isinstance(result, str):
            self.progress.remark(f"without '{name}': {result}")
        else:
            posterior_file.save(result, _place(self.folder, name))
        self.results[name] = True


def posteriors(setup: Setup, folder: Path) -> dict[str, tuple[JointProblem, Posterior]]:
    """Trial -> problem and posterior of the others, of those trials that have been left out so far."""
    names = [name for name in setup.trials if name and _place(folder, name).exists()]
    return {name: (setup.problem.without(name), posterior_file.load(_place(folder, name))) for name in names}


def is_done(names: Iterable[str], folder: Path) -> bool:
    """Whether each of the trials has been left out."""
    return all(_place(folder, name).exists() for name in names)


def _place(folder: Path, name: str) -> Path:
    return folder / LEFT_OUT / f"{name}.nc"

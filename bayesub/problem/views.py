"""Views of a problem: the same trials with other noise, fewer parameters or a shorter record.

A view changes parts of each trial and keeps all others (:meth:`bayesub.problem.trial_problem.TrialProblem.view`), so
that views of views have the changes of both.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import numpy as np

from bayesub.io.errors import InputError
from bayesub.problem.disturbances import of_history, of_process
from bayesub.problem.likelihoods import Normal

if TYPE_CHECKING:
    from bayesub.problem.trial_problem import TrialProblem


class Viewed:
    """A problem of one trial or several, of which there are views."""

    def of_trials(self, change: "Callable[[TrialProblem], TrialProblem]") -> Self:
        """The problem of the trials that `change` makes of its own; itself if it changes none."""
        raise NotImplementedError

    def naive(self) -> Self:
        """The same problem for methods that know neither rounding nor nuisance parameters.

        Noise is normal with the total sd on every channel, and nuisance parameters are held at their prior means.
        """
        return self.of_trials(lambda trial: _plain(trial, {}))

    def searchable(self) -> Self:
        """The same problem for searches that know no other noise than normal, and no histories of forces.

        As :meth:`naive`, but the nuisance parameters that move the readings remain: all but those of the noise and of a
        disturbance.
        """
        return self.of_trials(lambda trial: _plain(trial, _moving(trial)))

    def smoothed(self, share: float) -> Self:
        """The same problem for searches: channels without noise get some, with `share` of their resolution as sd."""

        def change(trial):
            if all(noise.has_density for noise in trial.noises):
                return trial
            return trial.view(noises=tuple(noise.smoothed(share) for noise in trial.noises))

        return self.of_trials(change)

    def widened(self, scale: float) -> Self:
        """The same problem with noise that is `scale` times as large, for searches from afar."""

        def change(trial):
            noises = tuple(noise.widened(scale) for noise in trial.noises)
            return trial.view(noises=noises, widening=scale * trial.widening)

        return self.of_trials(change)

    def with_wide_process(self) -> Self:
        """The same problem with a known and wide process of the disturbance, if it has one that is not known."""

        def change(trial):
            if not trial.histories or not trial.forward.disturbances.processes:
                return trial
            priors = {name: prior for name, prior in trial.nuisance_priors.items() if not of_process(name)}
            return trial.view(forward=trial.forward.with_wide_process(), nuisance_priors=priors)

        return self.of_trials(change)

    def truncated(self, duration: float) -> Self:
        """The same problem with the readings of the first `duration` seconds, for searches that lengthen the record.

        A channel without readings by then keeps its first. Nothing later is simulated.
        """

        def change(trial):
            channels = trial.record.channels
            counts = [max(1, int(np.searchsorted(c.times, duration, side="right"))) for c in channels]
            if all(n == len(channel.times) for n, channel in zip(counts, channels, strict=True)):
                return trial
            return _of_readings(trial, trial.record, [slice(n) for n in counts])

        return self.of_trials(change)


def read_earlier(trial: "TrialProblem", seconds: float) -> "TrialProblem":
    """The same problem with readings that were taken so much earlier than the record says.

    Those that would be from before the start or after the end of the trial are left out; InputError if that leaves
    nothing of a channel.
    """
    record, duration = trial.record.earlier(seconds), trial.manoeuvre.duration
    inside = [(channel.times >= 0.0) & (channel.times <= duration) for channel in record.channels]
    for channel, kept in zip(record.channels, inside, strict=True):
        if not kept.any():
            raise InputError(
                f"no reading of '{channel.name}' is of the trial if it was taken {seconds:g} s earlier",
                "data",
                channel.name,
            )
    return _of_readings(trial, record, inside)


def _of_readings(trial, record, chosen):
    """The trial with some readings of the channels of a record with these channels."""
    parts = zip(trial.forward.measurement.slices, chosen, strict=True)
    readings = np.concatenate([trial.readings[part][kept] for part, kept in parts])
    return trial.view(forward=trial.forward.with_record(record.of_readings(chosen)), readings=readings)


def _moving(trial):
    """The priors of the nuisance parameters that move the readings, forces with a history not among them."""
    still = {p.name for p in trial.forward.nuisances.parameters if p.channel and p.attribute != "bias"}
    priors = trial.nuisance_priors.items()
    return {name: prior for name, prior in priors if not (name in still or of_history(name) or of_process(name))}


def _plain(trial, nuisance_priors):
    """The trial with normal noise, and these nuisance parameters; all others are at their prior means."""
    noises = tuple(Normal(trial.widening * channel.total_sd) for channel in trial.record.channels)
    values = trial.nuisance_values(trial.prior.mean[None])[0]
    return trial.view(noises=noises, nuisance_priors=nuisance_priors, fixed_nuisances=values)

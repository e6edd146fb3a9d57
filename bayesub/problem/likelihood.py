"""The likelihood of the readings of one trial: the noise of each channel, and which numbers of it are inferred."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.problem.noise import Noise, scale_rows
from bayesub.sensors.record import Channel


@dataclass(frozen=True)
class ChannelNoise:
    """The noise of one channel at nuisance parameters of a batch."""

    name: str
    model: Noise
    unknown: dict[str, np.ndarray]  # attribute of the model that is inferred -> (n_batch,) values
    members: Noise  # the model with these
    times: np.ndarray  # (n,) of the readings, s
    part: slice  # where they stand among all readings


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The likelihood of readings given predictions (n_batch, n_readings) and nuisance parameters (n_batch, n)."""

    channels: Sequence[Channel]
    slices: Sequence[slice]  # where the readings of each stand among all
    readings: np.ndarray  # (n_readings,) measured values, SI units
    noises: tuple[Noise, ...]  # the noise model of each channel
    # attribute, position among the nuisance parameters and factor to SI of what is inferred of each noise
    inferred: Sequence[Sequence[tuple[str, int, float]]]
    widening: float = 1.0  # how many times as large as inferred an sd is taken that is inferred

    @property
    def n_rows(self) -> int:
        """Number of residuals: one a reading, and one for each parameter of the noise that is inferred."""
        return len(self.readings) + sum(map(len, self.inferred))

    @property
    def weighs_alike(self) -> bool:
        """Whether derivatives are weighed the same wherever the prediction is: known normal noise."""
        return all(noise.is_normal and not of for noise, of in zip(self.noises, self.inferred, strict=True))

    def each(self, values: np.ndarray) -> Iterator[ChannelNoise]:
        """The noise of each channel at nuisance parameters."""
        for channel, part, noise, inferred in zip(self.channels, self.slices, self.noises, self.inferred, strict=True):
            unknown = {
                attribute: factor * values[:, k] * (self.widening if attribute == "sd" else 1.0)
                for attribute, k, factor in inferred
            }
            yield ChannelNoise(channel.name, noise, unknown, noise.of_members(**unknown), channel.times, part)

    def residuals(self, predicted: np.ndarray, values: np.ndarray, centres: np.ndarray | None = None) -> np.ndarray:
        """(n_batch, n_rows) residuals: those of the readings, and after them those of the parameters of the noise.

        The noise is as at `centres`, by default the values; rows of its parameters say how far these are from there.
        """
        parts, rows = [], []
        pairs = zip(self.each(values if centres is None else centres), self.each(values), strict=True)
        for centre, one in pairs:
            arguments = predicted[:, one.part], self.readings[one.part], one.times
            parts.append(centre.members.residuals(*arguments))
            if one.unknown:
                row, by_logarithms = scale_rows(one.model, *arguments, centre.unknown)
                offset = np.log(np.stack([one.unknown[key] / at for key, at in centre.unknown.items()], axis=1))
                rows.append(row + np.einsum("nij,nj->ni", by_logarithms, offset))
        return np.concatenate(parts + rows, axis=1)

    def log_densities(self, predicted: np.ndarray, values: np.ndarray) -> dict[str, np.ndarray]:
        """Channel -> (n_batch,) log densities of its readings."""
        return {
            one.name: one.members.log_density(predicted[:, one.part], self.readings[one.part], one.times)
            for one in self.each(values)
        }

    def deviances(self, residuals: np.ndarray, predicted: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(n_batch,) sums over the channels of :meth:`bayesub.problem.noise.Noise.deviance`; infinite where failed."""
        deviances = np.zeros(len(predicted))
        for one in self.each(values):
            arguments = residuals[:, one.part], predicted[:, one.part], self.readings[one.part], one.times
            deviances += one.model.deviance(*arguments, one.members)
        return np.where(np.isnan(deviances), np.inf, deviances)

    def weighed(self, predicted: np.ndarray, values: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """(n_rows, k) derivatives of the residuals of one member, of those (n_readings, k) of its predictions.

        They are zero in the rows of parameters of the noise.
        """
        rows = np.zeros((self.n_rows, slopes.shape[1]))
        for one in self.each(values):
            member = one.model.of_members(**{attribute: numbers[0] for attribute, numbers in one.unknown.items()})
            rows[one.part] = member.weigh(slopes[one.part], predicted[0, one.part], self.readings[one.part], one.times)
        return rows

    def scale_slopes(self, predicted: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(n_unknown, n) derivatives by the nuisance parameters of one member, of the rows of those of the noise."""
        blocks = []
        for one, inferred in zip(self.each(values), self.inferred, strict=True):
            if inferred:
                arguments = predicted[:, one.part], self.readings[one.part], one.times
                _, (by_logarithms,) = scale_rows(one.model, *arguments, one.unknown)
                places = [k for _, k, _ in inferred]
                blocks.append(np.zeros((len(places), values.shape[1])))
                blocks[-1][:, places] = by_logarithms / values[0, places]
        return np.concatenate([np.empty((0, values.shape[1])), *blocks])

    def quantile_residuals(
        self, predicted: np.ndarray, values: np.ndarray, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Channel -> (n_batch, n) quantile residuals of those channels whose noise has a density."""
        return {
            one.name: one.members.quantile_residuals(predicted[:, one.part], self.readings[one.part], one.times, rng)
            for one in self.each(values)
            if one.model.has_density
        }

    def replicated(self, predicted: np.ndarray, values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member could have made of its predictions."""
        readings = predicted.copy()
        for one in self.each(values):
            for k, truth in enumerate(predicted[:, one.part]):
                member = one.model.of_members(**{key: float(numbers[k]) for key, numbers in one.unknown.items()})
                readings[k, one.part] = member.sample(truth, one.times, rng)
        return readings

"""Streams of a study's seed: which numbers they are, and that no two are the same."""

import itertools

import numpy as np

from bayesub.io import seeds

SEED = 12
STREAMS = [
    *((stream,) for stream in (seeds.DATA, seeds.GUESS, seeds.SQP, seeds.SAMPLER, seeds.CROSS_CHECK)),
    *((stream,) for stream in (seeds.MODE, seeds.PREDICTIONS)),
    *((seeds.LEFT_OUT, k) for k in range(3)),
    *((seeds.REPORT, k) for k in (seeds.MOTIONS, seeds.PRIOR_MOTIONS, seeds.DERIVED, seeds.RESIDUALS, seeds.JUMPS)),
]


def test_no_two_streams_are_the_same():
    numbers = [seeds.generator(SEED, *stream).random() for stream in STREAMS]
    assert all(one != other for one, other in itertools.combinations(numbers, 2))
    assert seeds.generator(SEED, seeds.DATA).random() != seeds.generator(SEED + 1, seeds.DATA).random()


def test_the_first_are_what_the_seed_spawns():
    """Runs of earlier versions took them so, and are resumed bit for bit."""
    for k, stream in enumerate(np.random.SeedSequence(SEED).spawn(5)):
        assert seeds.generator(SEED, k).random() == np.random.default_rng(stream).random()

"""The streams of random numbers of a study's seed, each with its own number: the one place where these are given.

Two of the same number and members are the same: a new stream takes the next number, and none is given again.
"""

import numpy as np

DATA = 0  # noise of simulated readings, and true disturbances, trial after trial
GUESS = 1  # the centre of a prior that is a perturbed truth
SQP = 2  # starts of the searches
SAMPLER = 3
CROSS_CHECK = 4  # with NUTS
REPORT = 5  # with one of the members below, so that nothing in a report depends on what was drawn before it
MODE = 6  # where in its rounding interval a reading was, before anything is sampled
LEFT_OUT = 6  # with the number of the trial as its member, which makes it another stream than that of the mode
PREDICTIONS = 7  # of trials that are not fitted

MOTIONS = 0  # of a report: draws at which motions and residuals are looked at
PRIOR_MOTIONS = 1  # draws of the prior beside them
DERIVED = 2  # boats of prior and posterior whose quantities are taken
RESIDUALS = 3  # where a rounded reading was
JUMPS = 4  # draws at which a larger step is tried
PRIOR_SUMS = 5  # draws of the prior by which it is judged what it knew of sums of coefficients


def generator(seed: int, stream: int, *members: int) -> np.random.Generator:
    """The random numbers of a stream (a number of this module) of a study's seed; of several, of these `members`."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream, *members)))

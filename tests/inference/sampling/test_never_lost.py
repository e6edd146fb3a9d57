"""kill -9 at random moments. BAYESUB_KILLS=50 pytest tests/test_never_lost.py kills fifty times."""

import multiprocessing
import os
import time
from pathlib import Path

import numpy as np
import pytest
from support.toys import Banana

import bayesub as bs
from bayesub.inference.sampling import checkpoint, sampler
from bayesub.inference.sampling.posterior import Criteria

KILLS = int(os.environ.get("BAYESUB_KILLS", "6"))
MAX_STEPS = 60 * KILLS
WITHIN = 0.4  # s after the start, time for some 40 steps, so that the last life finds work too


class Slow(Banana):
    """Three milliseconds a call, so that a kill finds it at work."""

    def log_likelihood(self, parameters):
        time.sleep(0.003)
        return super().log_likelihood(parameters)


def live(folder, begun, reported, max_steps=MAX_STEPS):
    """Sample into the checkpoint in blocks of a step or so, and report the length of the chain at each save."""
    sampler.BLOCK_SECONDS = 0.01
    append = checkpoint.Checkpoint.append

    def reporting(self, block):
        append(self, block)
        reported.value = self.n_steps

    checkpoint.Checkpoint.append = reporting
    begun.set()
    rng = np.random.default_rng(3)
    bs.sample(Slow(), rng=rng, n_walkers=16, max_steps=max_steps, criteria=Criteria(ess=1e12), checkpoint=folder)


def readable(folder: Path):
    """Length of the chain in a checkpoint, every block of which must be whole: a damaged one is a warning, an error."""
    if not (folder / "start.block").exists():
        return 0
    saved = checkpoint.Checkpoint(folder)
    blocks = list(saved._blocks())
    assert saved._read("start.block") is not None
    return sum(len(block.chain) for block in blocks)


@pytest.mark.slow
def test_kill_9_costs_at_most_a_block_and_leaves_no_unreadable_file(tmp_path):
    """After each kill there is what was saved; the next life continues, and the end is that of a life without kills."""
    folder, rng = tmp_path / "chain", np.random.default_rng(KILLS)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["bayesub.inference.sampling.sampler"])
    lengths = [0]
    for life in range(KILLS):
        begun, reported = context.Event(), context.Value("i", 0)
        process = context.Process(target=live, args=(folder, begun, reported))
        process.start()
        assert begun.wait(60)
        while life % 2 and not reported.value and process.is_alive():  # every other life gets as far as sampling
            time.sleep(0.01)
        time.sleep(rng.uniform(0, WITHIN))
        process.kill()
        process.join()
        length = readable(folder)
        assert length >= max(reported.value, lengths[-1])  # nothing that was saved is lost
        lengths.append(length)
    print(f"{KILLS} kills, lengths of the chain: {lengths}")
    assert len(set(lengths)) > 2, "no kill found the sampler at work"
    options = {"n_walkers": 16, "max_steps": MAX_STEPS, "criteria": Criteria(ess=1e12)}
    resumed = bs.sample(Banana(), rng=np.random.default_rng(3), checkpoint=folder, **options)
    straight = bs.sample(Banana(), rng=np.random.default_rng(3), **options)
    np.testing.assert_array_equal(resumed.chain, straight.chain)
    np.testing.assert_array_equal(resumed.log_prob, straight.log_prob)

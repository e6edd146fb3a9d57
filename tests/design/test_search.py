"""The search of a family: an optimum that is known, seeds, and searches that go on from a file."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.design import information as goals
from bayesub.design.families import Family, controls
from bayesub.design.judge import Judge
from bayesub.design.limits import Limits, Range
from bayesub.design.search import BEYOND, OUTSIDE, Cost, search
from bayesub.sensors import DVL, Track


@dataclass(frozen=True)
class Numbers:
    """A family of nothing but numbers."""

    n_dims: int

    def start(self, rng):
        return rng.uniform(-1.0, 1.0, self.n_dims)


class Quadratic:
    """A bowl with its least at known numbers, and a count of how often it was asked."""

    def __init__(self, optimum, offset=0.0):
        self.optimum, self.offset, self.n_calls = np.asarray(optimum), offset, 0
        self.families = (Numbers(2), Numbers(len(optimum) - 2))

    @property
    def n_dims(self):
        return len(self.optimum)

    def __call__(self, numbers):
        self.n_calls += 1
        scales = 10.0 ** np.linspace(0.0, 2.0, self.n_dims)
        return float(scales @ (numbers - self.optimum) ** 2) + self.offset


OPTIMUM = np.array([0.3, -0.7, 0.0, 0.9, -0.2, 0.55])


def solved(cost, seed=3, n=3000, **options):
    return search(cost, np.random.default_rng(seed), n_judgements=n, **options)


def test_the_optimum_of_a_quadratic_is_found():
    best = solved(Quadratic(OPTIMUM))
    assert best.numbers == pytest.approx(OPTIMUM, abs=1e-3)
    assert best.cost < 1e-4
    assert np.all(np.diff(best.best) <= 0.0)
    assert best.best[-1] == best.cost
    assert best.cost == Quadratic(OPTIMUM)(best.numbers)


def test_an_optimum_out_of_bounds_is_met_at_the_bound():
    best = solved(Quadratic(np.where(OPTIMUM == 0.9, 1.7, OPTIMUM)))
    assert best.numbers == pytest.approx(np.where(OPTIMUM == 0.9, 1.0, OPTIMUM), abs=0.02)


def test_a_seed_decides_everything():
    first, second, other = (solved(Quadratic(OPTIMUM), seed, 300) for seed in (1, 1, 2))
    assert np.array_equal(first.numbers, second.numbers)
    assert np.array_equal(first.best, second.best)
    assert not np.array_equal(first.numbers, other.numbers)


def test_a_start_is_where_the_first_generation_spreads():
    best = solved(Quadratic(OPTIMUM), n=20, start=OPTIMUM, sigma=0.01)
    assert best.numbers == pytest.approx(OPTIMUM, abs=0.05)


@pytest.mark.parametrize("cut", [0.0, 0.1, 0.5, 0.95, 1.0])
def test_a_search_that_was_cut_off_goes_on_to_the_same_numbers(tmp_path, cut):
    path, whole = tmp_path / "costs.txt", Quadratic(OPTIMUM)
    expected = solved(whole, n=400, saved=path)
    text = path.read_text()
    path.write_text(text[: int(cut * len(text))])
    resumed = Quadratic(OPTIMUM)
    best = solved(resumed, n=400, saved=path)
    assert np.array_equal(best.numbers, expected.numbers)
    assert np.array_equal(best.best, expected.best)
    assert best.n_judgements == expected.n_judgements
    assert path.read_text() == text
    n_on_file = text[: int(cut * len(text))].count("\n")
    assert resumed.n_calls == whole.n_calls - n_on_file


def test_a_shorter_search_goes_on_as_a_longer_one(tmp_path):
    path = tmp_path / "costs.txt"
    solved(Quadratic(OPTIMUM), n=200, saved=path)
    longer = solved(Quadratic(OPTIMUM), n=600, saved=path)
    assert np.array_equal(longer.numbers, solved(Quadratic(OPTIMUM), n=600).numbers)


def test_a_parallel_map_gives_the_same_numbers():
    with ThreadPoolExecutor(3) as pool:
        parallel = solved(Quadratic(OPTIMUM), n=300, mapped=pool.map)
    serial = solved(Quadratic(OPTIMUM), n=300)
    assert np.array_equal(parallel.numbers, serial.numbers)
    assert np.array_equal(parallel.best, serial.best)


def test_progress_comes_to_its_end():
    class Progress:
        done = ()

        def update(self, done, total, unit="", note=""):
            del unit, note
            self.done = (*self.done, done / total)

    progress = Progress()
    solved(Quadratic(OPTIMUM), n=200, progress=progress)
    assert list(progress.done) == sorted(progress.done)
    assert progress.done[-1] == 1.0


def test_nothing_within_the_limits_is_an_error_in_words():
    with refused("conflict", "limits"):
        solved(Quadratic(OPTIMUM, offset=OUTSIDE), n=60)


class Narrow(Quadratic):
    """A bowl that only numbers near zero may enter."""

    def __call__(self, numbers):
        return super().__call__(numbers) + (OUTSIDE if np.abs(numbers).max() > 0.1 else 0.0)


def test_a_start_that_no_later_manoeuvre_betters_is_the_answer():
    """The generations of a short search spread further than the limits allow; its first manoeuvres did not."""
    best = solved(Narrow(OPTIMUM), n=60)
    assert best.cost < OUTSIDE
    assert np.abs(best.numbers).max() <= 0.1
    given = solved(Narrow(OPTIMUM), n=60, start=np.full(6, 0.05))
    assert given.cost <= Narrow(OPTIMUM)(np.full(6, 0.05))


@pytest.fixture(scope="module")
def cost():
    boat = bs.load_vehicle("suboff")
    limits = Limits(depth_change_m=60.0, pitch_deg=30.0, roll_deg=45.0, duration_s=200.0)
    sensors = (*Track(0.5, 0.1, interval_s=5.0), *DVL(sd_mps=0.005, interval_s=5.0))
    judge = Judge(boat, sensors, free=("Xuu", "Yuv", "Nuv", "Nur", "Muw", "Muq"), step_s=2.0)
    family = Family("steps", boat, limits, controls(boat, limits), n_knots=4)
    return Cost(judge, Range(boat, limits, boat.xi[None], None, 2.0), (family, family), goals.Known(0.1))


def test_the_robust_cost_is_the_mean_over_everything_and_each_loss(cost, rng):
    """As judges without the track and without the Doppler log say, and of either manoeuvre alone."""
    numbers = 0.2 * np.concatenate([family.start(rng) for family in cost.families])
    manoeuvres, robust = cost.manoeuvres(numbers), replace(cost, robust=True)
    penalty = sum(cost.range.penalty(cost.range.margins(each)) for each in manoeuvres)
    goals_of = []
    for lost in (None, "track", "dvl"):
        judge = replace(cost.judge, sensors=tuple(s for s in cost.judge.sensors if s.instrument != lost))
        (one,), (other,) = map(judge.information, manoeuvres)
        goals_of += [cost.goal(part) for part in ([one + other] if lost else [one + other, one, other])]
    assert robust(numbers) == pytest.approx(
        np.mean(goals_of) + (BEYOND * (1.0 + penalty) if penalty else 0.0), rel=1e-9
    )
    assert robust(numbers) > cost(numbers)


def test_the_cost_of_a_set_is_the_goal_of_all_its_trials_together(cost, rng):
    numbers = 0.2 * np.concatenate([family.start(rng) for family in cost.families])
    first, second = cost.manoeuvres(numbers)
    (one,), (other,) = cost.judge.information(first), cost.judge.information(second)
    penalties = [cost.range.penalty(cost.range.margins(each)) for each in (first, second)]
    beyond = BEYOND * (1.0 + sum(penalties)) if any(penalties) else 0.0
    assert cost(numbers) == pytest.approx(cost.goal(one + other) + beyond, rel=1e-12)
    assert penalties == [0.0, 0.0]


def test_what_is_far_beyond_the_limits_is_not_judged(cost):
    numbers = np.zeros((len(cost.families), cost.families[0].n_dims))
    numbers[0] = 1.0
    assert cost(numbers.ravel()) > OUTSIDE
    assert cost(np.zeros(cost.n_dims)) < 0.0


def test_a_cost_goes_to_other_processes_and_gives_the_same(cost, rng):
    numbers = 0.2 * rng.uniform(-1.0, 1.0, cost.n_dims)
    assert pickle.loads(pickle.dumps(cost))(numbers) == cost(numbers)


def test_a_search_of_manoeuvres_improves_on_its_start(cost):
    best = search(cost, np.random.default_rng(1), n_judgements=60)
    assert best.cost <= best.best[0]
    assert cost(best.numbers) == best.cost
    again = search(cost, np.random.default_rng(1), n_judgements=60)
    assert np.array_equal(best.numbers, again.numbers)

"""Arguments of the Python interface of another class than they should be: one line that says what makes one."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs

PRIOR = bs.priors.relative_normal(0.25)
TRACK = bs.sensors.Track(0.5, 0.1)


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("auv690")


@pytest.fixture(scope="module")
def spiral(boat):
    return bs.load_manoeuvre("horizontal", boat)


@pytest.fixture(scope="module")
def record(boat, spiral):
    return bs.observe(bs.simulate(boat, spiral), TRACK, np.random.default_rng(1))


@pytest.fixture(scope="module")
def problem(boat, spiral, record):
    return bs.Problem(boat, spiral, record, free=["Xuu", "Nuv"], prior=PRIOR)


OF_PROBLEMS = {
    "the name of a boat": ({"vehicle": "auv690"}, "vehicle"),
    "the name of a manoeuvre": ({"manoeuvre": "horizontal"}, "manoeuvre"),
    "the path of a record": ({"record": "record.csv"}, "record"),
    "a number as prior": ({"prior": 0.25}, "prior"),
    "the prior of one as that of all": ({"prior": bs.priors.normal(0.0, 1.0)}, "prior"),
    "none": ({"prior": None}, "prior"),
    "nuisances without priors": ({"nuisance": ["u0_mps"]}, "nuisance"),
    "a number as prior of a nuisance": ({"nuisance": {"u0_mps": 1.5}}, "u0_mps"),
    "a class as noise": ({"noise": {"x": bs.likelihoods.Normal}}, "x"),
    "a list of noises": ({"noise": [bs.likelihoods.Normal(0.1)]}, "noise"),
    "a number as disturbance": ({"disturbance": 0.1}, "disturbance"),
    "a step in words": ({"dt": "0.4"}, "dt"),
    "no coefficients": ({"free": None}, "free"),
}


@pytest.mark.parametrize(("changes", "key"), OF_PROBLEMS.values(), ids=OF_PROBLEMS)
def test_of_a_problem(changes, key, boat, spiral, record):
    given = {"vehicle": boat, "manoeuvre": spiral, "record": record, "free": ["Xuu"], "prior": PRIOR} | changes
    first = [given.pop(name) for name in ("vehicle", "manoeuvre", "record")]
    with refused("value", key):
        bs.Problem(*first, **given)


METHODS = ("log_prob", "log_prior", "predicted", "residuals", "jacobian", "motion", "trajectory")
OF_FUNCTIONS = {
    "a boat to simulate": (lambda p: bs.simulate("auv690", p.manoeuvre), "vehicle"),
    "a manoeuvre to simulate": (lambda p: bs.simulate(p.vehicle, "horizontal"), "manoeuvre"),
    "a step": (lambda p: bs.simulate(p.vehicle, p.manoeuvre, dt="0.1"), "dt"),
    "a boat to steer": (lambda _: bs.load_manoeuvre("horizontal", "auv690"), "vehicle"),
    "a seed of readings": (lambda p: bs.observe(bs.simulate(p.vehicle, p.manoeuvre), TRACK, 1), "rng"),
    "a seed of draws": (lambda p: bs.sample(p, rng=1), "rng"),
    "a seed of starts": (lambda p: bs.baselines.sqp(p, rng=1), "rng"),
    "criteria as a dictionary": (lambda p: bs.sample(p, rng=np.random.default_rng(1), criteria={"ess": 9}), "criteria"),
    "criteria that cannot be": (lambda _: bs.Criteria(rhat=0.5), "criteria"),
    "a boat to sample": (lambda p: bs.sample(p.vehicle, rng=np.random.default_rng(1)), "problem"),
    "a list of trials": (lambda p: bs.JointProblem([p, p]), "problems"),
    "a boat as trial": (lambda p: bs.JointProblem({"north": p.vehicle}), "north"),
    "one trial to leave out": (lambda p: bs.leave_one_out(p, np.random.default_rng(1)), "joint"),
    "no posterior to report": (lambda p: bs.write_report("report", p, [], None, None), "posterior"),
    "an sd in words": (lambda _: bs.sensors.Track("0.5", 0.1), "position_sd_m"),
    "a width in words": (lambda _: bs.priors.relative_normal("wide"), "sd"),
    "a number as prior": (lambda _: bs.priors.Given(PRIOR, {"Xuu": -0.001}), "Xuu"),
    "no parameters": (lambda p: bs.identifiability.fisher(p, None), "at"),
    "a batch of parameters": (lambda p: p.jacobian(np.ones((2, 2))), "parameters"),
    "an empty batch": (lambda p: p.residuals(np.ones((0, 2))), "parameters"),
    "a member that there is not": (lambda p: bs.observe(p.trajectory(np.ones(2)), TRACK, None, member=1), "member"),
    "a member in words": (lambda p: bs.observe(p.trajectory(np.ones(2)), TRACK, None, member="one"), "member"),
    "the name of a move": (lambda p: bs.sample(p, rng=np.random.default_rng(1), moves="stretch"), "moves"),
    "walkers in words": (lambda p: bs.sample(p, rng=np.random.default_rng(1), n_walkers="many"), "n_walkers"),
    "a criterion in words": (lambda _: bs.Criteria(ess="many"), "ess"),
    "no study": (lambda _: bs.load_study(None), "path"),
    "a number as study to run": (lambda _: bs.run("study.toml", 3), "folder"),
    "a number as run to export": (lambda _: bs.export(3, "boat.toml"), "folder"),
    "a number as residuals": (lambda _: bs.LeastSquaresModel(3, {"a": bs.priors.normal(0.0, 1.0)}), "residuals"),
    "a list of priors": (lambda _: bs.DensityModel(len, ["a"]), "priors"),
}


@pytest.mark.parametrize(("call", "key"), OF_FUNCTIONS.values(), ids=OF_FUNCTIONS)
def test_of_a_function(call, key, problem):
    with refused("value", key):
        call(problem)


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("method", METHODS)
def test_vectors_of_another_length(method, n, problem):
    """They are not broadcast, nor cut."""
    assert np.isfinite(problem.log_prob(list(problem.prior.mean))).all()
    with refused("value", "parameters"):
        getattr(problem, method)(np.ones(n))
    with refused("value", "parameters"):
        getattr(problem, method)(np.ones((2, n)))


def test_what_holds_the_same_numbers_is_equal(boat, spiral, record):
    """And can be looked for in a list, or be a key."""
    again = bs.load_manoeuvre("horizontal", boat)
    flown = bs.simulate(boat, spiral)
    assert spiral == again
    assert spiral in {again: None}
    assert flown == bs.simulate(boat, again)
    assert record == bs.observe(flown, TRACK, np.random.default_rng(1))
    assert record != bs.observe(flown, TRACK, np.random.default_rng(2))
    assert spiral not in [bs.load_manoeuvre("vertical", boat), "horizontal", None]


def test_vectors_of_another_length_of_several_trials(problem):
    joint = bs.JointProblem({"north": problem, "south": problem})
    for n in (1, 3):
        with refused("value", "parameters"):
            joint.log_prob(np.ones(n))
        with refused("value", "parameters"):
            joint.residuals(np.ones(n))


def test_a_sub_problem_in_place_of_names(boat, spiral, record):
    """As in a study file."""
    names = [bs.Problem(boat, spiral, record, free=free, prior=PRIOR, dt=0.4).names for free in ("horizontal", "all")]
    assert names[0] == names[1] == bs.Problem(
        boat, spiral, record, free=boat.equations.active(subproblem="horizontal"), prior=PRIOR, dt=0.4
    ).names  # fmt: skip
    with refused("unknown", "subproblem"):
        bs.Problem(boat, spiral, record, free="Xuu", prior=PRIOR)


def test_what_is_right_is_taken_as_it_is(boat, spiral):
    """Numbers of NumPy are numbers; a generator may come by position; names and help of a function stay."""
    again = bs.load_manoeuvre(name="horizontal", vehicle=boat)
    assert again.duration == spiral.duration
    assert bs.simulate(boat, spiral, dt=np.float32(0.5)).status[0] == "ok"
    assert bs.random_manoeuvre(boat, np.random.default_rng(1)).duration > 0.0
    assert bs.simulate.__name__ == "simulate"
    assert "rng" in bs.sample.__annotations__

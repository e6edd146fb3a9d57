"""Unmodelled forces in study files: of a fit and of a truth."""

import numpy as np
import pytest
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.model.disturbance import hull_force_rms
from bayesub.problem.disturbances import force_scales
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.disturbance_section import DisturbanceSection, TrueDisturbanceSection, central, in_words
from bayesub.study.schema.study_file import Study, load_study

ONCE = [small_study.track(position_sd_m=0.1, interval_s=None)]
STUDY = {"name": "disturbed", "seed": 1, "sensors": ONCE}
PROCESS = {"axes": ["X", "Y", "N"], "sd": 1e-5, "correlation_time_s": 4.0}
PRIOR = {"median": 2e-5, "log_sd": 1.0}


@pytest.fixture
def posed(tmp_path):
    """posed(sections): the setup of a study with further sections."""

    def pose(**sections):
        return prepare(load_study(small_study.write(tmp_path / "study.toml", **STUDY | sections)))

    return pose


@pytest.fixture(scope="module")
def simulator():
    boat = bs.load_vehicle("auv690")
    return bs.simulate(boat, bs.load_manoeuvre("horizontal", boat), dt=0.4).simulator


def section(**changes):
    content = PROCESS | changes
    return DisturbanceSection.model_validate({key: value for key, value in content.items() if value is not None})


def test_a_number_is_that_of_every_axis_and_a_table_has_them_one_by_one(simulator):
    """Forces over (rho/2) l^2 U^2 and moments over (rho/2) l^3 U^2."""
    boat = simulator.vehicle
    unit = 0.5 * boat.water_density_kgm3 * boat.length_m**2 * boat.speed_mps**2
    scales = np.array([unit, unit, unit * boat.length_m])
    np.testing.assert_allclose(force_scales(boat, ("X", "Y", "N")), scales)
    expected = {"X": 1e-5, "Y": 1e-5, "N": 1e-5}
    for sd in (1e-5, expected):
        assert section(sd=sd).build([simulator]).sds == pytest.approx(expected)
    known = TrueDisturbanceSection.model_validate(PROCESS).known(simulator)
    np.testing.assert_allclose(known.sds, 1e-5 * scales)
    newton = section(sd=None, sd_n=2.0, sd_nm={"N": 0.5}).build([simulator])
    assert newton.sds == pytest.approx({"X": 2.0 / scales[0], "Y": 2.0 / scales[1], "N": 0.5 / scales[2]})
    rms = hull_force_rms([simulator])[[0, 1, 5]]
    share = section(sd=None, share=0.015).build([simulator])
    assert share.sds == pytest.approx(dict(zip("XYN", 0.015 * rms / scales, strict=True)))
    mixed = section(sd={"X": 3e-5}, sd_n={"Y": 1.0}, share={"N": 0.01}).build([simulator])
    assert mixed.sds == pytest.approx({"X": 3e-5, "Y": 1.0 / scales[1], "N": 0.01 * rms[2] / scales[2]})


def test_a_prior_keeps_its_spread_in_every_unit(simulator):
    """Its median is scaled, and each axis has a prior by itself."""
    for key, changes in (("sd", {}), ("share", {"sd": None}), ("sd_n", {"sd": None, "axes": ["X", "Y"]})):
        prior = {"median": 0.5, "log_sd": 0.7}
        number = section(**{"sd": None} | changes | {key: 0.5}).build([simulator]).sds
        for axis, built in section(**changes | {key: prior}).build([simulator]).sds.items():
            low, middle = (built.quantiles(p)[0] for p in (0.15865525393145707, 0.5))
            assert middle == pytest.approx(number[axis])
            assert np.log(middle / low) == pytest.approx(0.7)
    unknown = section(correlation_time_s={"median": 4.0, "log_sd": 0.5}, kind="matern_3_2", knot_interval_s=3.0)
    built = unknown.build([simulator])
    assert (built.time_s, built.kind, built.interval_s) == (pytest.approx(4.0), "matern_3_2", 3.0)


def test_what_it_is_in_words(simulator):
    built = section(sd={"X": 1e-5, "Y": PRIOR, "N": 1e-5}).build([simulator])
    process, inferred = central(built, simulator.vehicle)
    x, y, n = process.sds
    rms = hull_force_rms([simulator])
    assert in_words(process, rms, inferred) == (
        f"sd X {x:.3g} N ({100 * x / rms[0]:.2g} % of the hull's), Y about {y:.3g} N ({100 * y / rms[1]:.2g} % of the "
        f"hull's), N {n:.3g} N m ({100 * n / rms[5]:.2g} % of the hull's), correlation time 4 s"
    )


REFUSED = [
    ({"axes": ["X", "Q"]}, "unknown", "disturbance"),
    ({"axes": ["X", "X"]}, "conflict", "disturbance"),
    ({"axes": []}, "missing", "disturbance"),
    ({"axes": "XYN"}, "value", "disturbance.axes"),
    ({"sd": 0}, "value", "disturbance.sd.X"),
    ({"sd": {"X": 1e-5, "Y": -1e-5, "N": 1e-5}}, "value", "disturbance.sd.Y"),
    ({"sd": {"X": 1e-5, "N": 1e-5}}, "conflict", "disturbance"),
    ({"sd": {"X": 1e-5, "Y": 1e-5, "N": 1e-5, "Z": 1e-5}}, "conflict", "disturbance"),
    ({"sd": 2.0}, "value", "disturbance"),
    ({"sd": "small"}, "value", "disturbance.sd.X"),
    ({"sd": {"median": 1e-5}}, "missing", "disturbance.sd.X.log_sd"),
    ({"sd": {"X": PRIOR, "Y": PRIOR, "N": {"median": 0, "log_sd": 1}}}, "value", "disturbance.sd.N.median"),
    ({"sd": {"X": PRIOR, "Y": PRIOR, "N": {"mean": 1.0}}}, "unknown", "disturbance.sd.N.mean"),
    ({"share": 0.01}, "conflict", "disturbance"),
    ({"sd": {"X": 1e-5, "Y": 1e-5}, "sd_n": {"N": 1.0}}, "conflict", "disturbance"),
    ({"sd": {"X": 1e-5, "N": 1e-5}, "sd_nm": {"Y": 1}}, "conflict", "disturbance"),
    ({"axes": ["N"], "sd": 1e-5, "sd_n": 2.0}, "conflict", "disturbance"),
    ({"sd": None, "sd_n": 2.0}, "conflict", "disturbance"),
    ({"kind": "white"}, "value", "disturbance.kind"),
    ({"correlation_time_s": 0.0}, "value", "disturbance.correlation_time_s"),
    ({"correlation_time_s": None}, "missing", "disturbance.correlation_time_s"),
    ({"correlation_times_s": 3.0}, "unknown", "disturbance.correlation_times_s"),
    ({"axes": ["X", "north"], "sd": {"X": 1e-5}}, "conflict", "disturbance"),
    ({"axes": ["X", "north"], "sd": {"X": 1e-5, "north": 0.1}}, "conflict", "disturbance"),
    ({"sd_mps": {"Y": 0.1}}, "conflict", "disturbance"),
    ({"correlation_time_current_s": 9.0}, "conflict", "disturbance"),
    ({"knot_interval_s": -1.0}, "value", "disturbance.knot_interval_s"),
    ({"axes": ["X", "Z"], "sd": 1e-5}, "conflict", "Z"),
    ({"correlation_time_s": 0.1, "knot_interval_s": 5.0}, "conflict", "correlation_time_s"),
    ({"knot_interval_s": 1e-9}, "limit", "knot_interval_s"),
    ({"sd": 1e-300}, "value", "disturbance"),
    ({"sd": {"X": PRIOR, "Y": PRIOR, "N": {"median": 1e-200, "log_sd": 1.0}}}, "value", "disturbance"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "kind", "key"), REFUSED)
def test_what_a_fit_cannot_be_given(posed, changes, kind, key):
    """Is refused in one line that begins with the file."""
    content = {key: value for key, value in (PROCESS | changes).items() if value is not None}
    with refused(kind, key) as error:
        posed(disturbance=content)
    assert str(error.value).split(": ")[0].endswith("study.toml")


@pytest.mark.parametrize(
    ("truth", "kind", "key"),
    [
        (PROCESS | {"sd": PRIOR}, "conflict", "truth.disturbance"),
        (PROCESS | {"correlation_time_s": {"median": 4.0, "log_sd": 1.0}}, "conflict", "truth.disturbance"),
        (PROCESS | {"knot_interval_s": 2.0}, "conflict", "truth.disturbance"),
        (PROCESS | {"correlation_time_s": 1e-4}, "conflict", "correlation_time_s"),
        ({**PROCESS, "axes": ["K"]}, "conflict", "K"),
        ({**PROCESS, "sd": -1.0}, "value", "truth.disturbance.sd.X"),
        ({**PROCESS, "axes": ["W"]}, "unknown", "truth.disturbance"),
    ],
)
def test_what_a_truth_cannot_feel(posed, truth, kind, key):
    with refused(kind, key) as error:
        posed(truth={"disturbance": truth})
    assert "study.toml: " in str(error.value)


def test_a_log_has_no_disturbance_of_its_own():
    content = small_study.content(**STUDY, manoeuvre=None, data="log.csv")
    with pytest.raises(ValueError, match="truth is what a simulated trial knows, and contradicts 'data'"):
        Study.model_validate(content | {"truth": {"disturbance": PROCESS}})


def test_a_truth_is_disturbed_and_its_noise_is_that_of_the_calm(posed):
    """The forces are with the truth, their parameters with the record; the readings differ by the motion alone."""
    calm, disturbed = (posed(**sections).trials[""] for sections in ({}, {"truth": {"disturbance": PROCESS}}))
    forces = disturbed.truth.simulator.forces
    assert calm.truth.simulator.forces is None
    assert forces.axes == ("X", "Y", "N")
    assert {key: value for key, value in disturbed.record.nuisances.items() if "disturbance" in key} == pytest.approx(
        {"sd_disturbance_X": 1e-5, "sd_disturbance_Y": 1e-5, "sd_disturbance_N": 1e-5}
        | {"correlation_time_disturbance_s": 4.0}
    )
    assert not any("disturbance" in key for key in calm.record.nuisances)
    for name, channel, other in zip(("x", "y", "psi"), disturbed.record.channels, calm.record.channels, strict=True):
        noise = [
            one.values - trial.truth.resampled(one.times).outputs([name])[0, :, 0]
            for one, trial in ((channel, disturbed), (other, calm))
        ]
        np.testing.assert_allclose(*noise, rtol=0, atol=1e-11)
        assert np.abs(channel.values - other.values).max() > 2.0 * channel.sd
    again = posed(truth={"disturbance": PROCESS}).trials[""]
    np.testing.assert_array_equal(again.record.values, disturbed.record.values)


def test_a_fit_has_the_histories_and_the_process_among_its_parameters(posed):
    """Where the truth has the process too, that is their reference."""
    setup = posed(disturbance=PROCESS | {"sd": PRIOR, "knot_interval_s": 20.0}, truth={"disturbance": PROCESS})
    problem = setup.problem
    n_knots = len(problem.simulator.knots.times)
    assert problem.names[4:8] == ("sd_disturbance_X", "sd_disturbance_Y", "sd_disturbance_N", "disturbance_X_0")
    assert problem.n_params == 4 + 3 + 3 * n_knots
    np.testing.assert_allclose(problem.reference[4:7], 1e-5)
    assert np.isfinite(problem.log_prob(problem.prior.mean[None])).all()
    config = setup.study.config()
    assert config["disturbance"]["sd"]["Y"] == PRIOR
    assert config["truth"]["disturbance"]["kind"] == "ornstein_uhlenbeck"


@pytest.mark.parametrize("kind", ["ornstein_uhlenbeck", "matern_3_2"])
def test_a_force_that_hardly_changes_can_be_posed(posed, kind):
    """With a correlation time far beyond the trial the covariance of the knots is singular but for round-off."""
    time = {"median": 1e8, "log_sd": 3.0}
    problem = posed(disturbance=PROCESS | {"kind": kind, "correlation_time_s": time, "knot_interval_s": 20.0}).problem
    assert np.isfinite(problem.log_prob(problem.prior.mean[None])).all()


def test_a_study_without_disturbance_says_nothing_of_it(posed):
    """So that earlier runs resume."""
    config = posed().study.config()
    assert "disturbance" not in config
    assert "disturbance" not in config["truth"]


def test_shares_are_of_forces_that_are_there(posed):
    """Of a boat that fails there are none, and of a hull without sway force neither."""
    share = {"axes": ["Y"], "share": 0.01, "correlation_time_s": 4.0}
    with refused("conflict", "disturbance.share.Y"):
        posed(disturbance=share, manoeuvre="straight.toml")


@pytest.fixture(autouse=True)
def straight(tmp_path):
    """A manoeuvre without rudder."""
    text = 'name = "straight"\nkind = "steps"\nsubproblem = "horizontal"\nduration_s = 60.0\n'
    (tmp_path / "straight.toml").write_text(text + "[demands]\ntime_s = [0.0]\nrudder_deg = [0.0]\n")


def test_trials_share_the_process_and_have_histories_of_their_own(posed):
    """One truth is disturbed, the other calm; sds and time are one parameter each."""
    trials = [
        {"name": "calm", "manoeuvre": "horizontal"},
        {"name": "gusty", "manoeuvre": "turning_circle", "truth": {"disturbance": PROCESS}},
    ]
    time = {"median": 4.0, "log_sd": 0.5}
    unknown = PROCESS | {"sd": PRIOR, "correlation_time_s": time, "knot_interval_s": 20.0}
    setup = posed(manoeuvre=None, trials=trials, disturbance=unknown)
    assert [trial.truth.simulator.forces is not None for trial in setup.trials.values()] == [False, True]
    names = setup.problem.names
    process = [name for name in names if name.startswith(("sd_disturbance", "correlation_time_disturbance"))]
    assert process == [*(f"sd_disturbance_{axis}" for axis in "XYN"), "correlation_time_disturbance_s"]
    knots = {name: len(problem.simulator.knots.times) for name, problem in setup.problem.problems.items()}
    for trial, n in knots.items():
        assert sum(name.endswith(f"[{trial}]") for name in names) == 3 * n
    assert np.isfinite(setup.problem.log_prob(setup.problem.prior.mean[None])).all()

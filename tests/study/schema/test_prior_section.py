"""Priors and noise models in study files."""

import re

import numpy as np
import pytest
from scipy import stats
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.model import coefficients
from bayesub.problem.likelihoods import AR1, Normal, Rounded, StudentT, UnknownSd
from bayesub.study.run import prepare as preparation
from bayesub.study.schema.study_file import load_study

SENSORS = [
    small_study.track(interval_s=20.0),
    {"kind": "dvl", "sd_mps": 0.01, "resolution_mps": 0.01, "channels": ["u_ground"], "interval_s": 20.0},
]
FREE = ["Xuu", "Yuv", "Nuv", "Nur"]
HEAD = small_study.SUBOFF | {"sensors": SENSORS, "free": {"coefficients": FREE}, "prior": None}
NORMAL = '[prior]\nkind = "relative_normal"\nsd = 0.25\n'


@pytest.fixture
def prepared(tmp_path):
    """prepared(text, changes): the problem of a study with this text, which has its prior, after HEAD."""

    def prepare(text, **changes):
        path = tmp_path / "study.toml"
        path.write_text(small_study.text(**HEAD | changes) + text)
        return preparation.prepare(load_study(path))

    return prepare


def test_priors_of_single_coefficients(prepared, tmp_path):
    """A towing-tank value, a correlated pair, bounds and a fixed value beside a spread for the rest."""
    table = tmp_path / "tank.csv"
    table.write_text("coefficient,mean,sd\nYuv,-0.03,0.002\nNuv,-0.012,0.001\nNur,-0.006,0\n")
    text = f'table = "{table}"\ncorrelations = [["Yuv", "Nuv", 0.6]]\n'
    text += "[prior.given]\nXuu = { lower = -0.002, upper = -0.0005 }\n"
    setup = prepared(NORMAL + text)
    prior, names = setup.problem.prior, setup.problem.names
    assert names == ("Xuu", "Yuv", "Nuv")  # Nur is fixed
    assert setup.problem.xi[coefficients.INDEX["Nur"]] == -0.006
    covariance = [[4e-6, 1.2e-6], [1.2e-6, 1e-6]]
    points = np.array([[-0.001, -0.031, -0.0115], [-0.0018, -0.027, -0.014], [-0.003, -0.03, -0.012]])
    expected = stats.uniform.logpdf(points[:, 0], -0.002, 0.0015)
    expected += stats.multivariate_normal([-0.03, -0.012], covariance).logpdf(points[:, 1:])
    np.testing.assert_allclose(prior.log_density(points), expected, rtol=1e-12)


@pytest.mark.parametrize(("kind", "key"), [("relative_uniform", "half_width"), ("relative_log_normal", "log_sd")])
def test_other_spreads(prepared, kind, key):
    problem = prepared(f'[prior]\nkind = "{kind}"\n{key} = 0.75\n').problem
    low, middle, high = (problem.prior.quantiles(p) / problem.reference for p in (1e-12, 0.5, 1 - 1e-12))
    np.testing.assert_allclose(middle, 1.0, rtol=1e-12)
    if kind == "relative_uniform":
        np.testing.assert_allclose(np.sort([low, high], axis=0), [[0.25] * 4, [1.75] * 4], rtol=1e-9)
    else:
        assert np.all(low > 0)


def test_noise_models(prepared):
    """Each channel has the model of its section, in SI units; without one it is what the sensor says."""
    text = '[noise.x_m]\nkind = "student_t"\ndof = 4.0\n[noise.yaw_deg]\nkind = "ar1"\nsd = 0.3\n'
    text += 'correlation_time_s = 20.0\n[noise.y_m]\nkind = "unknown_sd"\n'
    problem = prepared(NORMAL + text).problem
    assert problem.noises == (StudentT(0.2, 4.0), UnknownSd(0.2), AR1(np.radians(0.3), 20.0), Rounded(0.01, 0.01))
    naive = prepared(NORMAL + '[noise.u_ground_mps]\nkind = "normal"\n').problem
    assert naive.noises[-1] == Normal(np.hypot(0.01, 0.01 / np.sqrt(12)))


def test_nuisance_and_current(prepared):
    """The trial has a current, which the problem infers."""
    text = "[truth]\ncurrent_mps = [0.3, -0.1]\n[nuisance]\ncurrent_north_mps = { mean = 0.0, sd = 0.5 }\n"
    text += "sd_x_m = { median = 0.3, log_sd = 0.5 }\nyaw0_deg = { lower = -2.0, upper = 2.0 }\n"
    problem = prepared(NORMAL + text).problem
    assert problem.names[-3:] == ("current_north_mps", "sd_x_m", "yaw0_deg")
    np.testing.assert_allclose(problem.reference[-3:], [0.3, 0.2, 0.0], atol=1e-15)


@pytest.fixture
def own_boat(tmp_path, suboff_file):
    """The path of a suboff whose file gives three standard deviations, one of them of a coefficient that is zero."""
    text = suboff_file
    for name, value, sd in (("Yuv", -0.03238, 0.003), ("Nuv", -0.012107, 0.002), ("Nuu", 0.0, 1e-5)):
        text = re.sub(rf"(?m)^{name} .*$", f"{name} = {{ value = {value}, sd = {sd} }}", text)
    path = tmp_path / "own.toml"
    path.write_text(text)
    return path


@pytest.fixture
def of_own_boat(prepared, own_boat):
    """of_own_boat(text, free): the problem of its study with a prior of the vehicle file."""

    def problem(text, free=(*FREE, "Nuu")):
        changes = {"vehicle": str(own_boat), "free": {"coefficients": free}}
        return prepared('[prior]\nkind = "vehicle"\n' + text, **changes).problem

    return problem


def test_prior_of_the_vehicle_file(of_own_boat):
    """kind "vehicle": its own sds; a relative one for the rest, or the rest fixed; single priors go first."""
    problem = of_own_boat("")
    assert problem.names == ("Yuv", "Nuv", "Nuu")
    np.testing.assert_array_equal(problem.prior.sd, [0.003, 0.002, 1e-5])
    np.testing.assert_array_equal(problem.prior.mean, [-0.03238, -0.012107, 0.0])
    problem = of_own_boat(
        'sd = 0.1\ncorrelations = [["Yuv", "Nuv", 0.5]]\n[prior.given]\nYuv = { mean = -0.03, sd = 0.001 }\n'
    )
    assert problem.names == ("Xuu", "Yuv", "Nuv", "Nur", "Nuu")
    np.testing.assert_allclose(problem.prior.sd, [1e-4, 0.001, 0.002, 0.0005911, 1e-5])
    assert problem.prior.mean[1] == -0.03
    problem = of_own_boat('centre = "perturbed"\n')
    assert problem.prior.mean[0] != -0.03238
    np.testing.assert_array_equal(problem.prior.sd, [0.003, 0.002, 1e-5])


def test_an_unknown_scale_beside_given_priors(prepared):
    """All coefficients that nothing is given of share a scale, or those of an axis do."""
    text = '[prior]\nkind = "relative_hierarchical"\nlog_sd = 0.25\n{}'
    text += "[prior.given]\nXuu = {{ mean = -0.001, sd = 1e-4 }}\n"
    problem = prepared(text.format("")).problem
    shared, given = problem.prior.parts
    assert ([len(part.median) for part in shared.parts], len(given.mean)) == ([3], 1)
    np.testing.assert_allclose(problem.prior.quantiles(0.5)[1:], problem.reference[1:], rtol=1e-9)
    by_axis = prepared(text.format("by_axis = true\n")).problem.prior.parts[0]
    assert [len(part.median) for part in by_axis.parts] == [1, 2]  # Yuv; Nuv and Nur


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        ('[prior]\nkind = "vehicle"\n', "missing", "prior.sd"),
        ('[prior]\nkind = "vehicle"\nlog_sd = 0.3\n', "conflict", "prior"),
        ('[prior]\nkind = "relative_uniform"\nsd = 0.25\n', "conflict", "prior"),
        ('[prior]\nkind = "relative_normal"\n', "missing", "prior"),
        (
            '[prior]\nkind = "relative_hierarchical"\nsd = 0.2\n',
            "conflict",
            "prior",
        ),
        (NORMAL + "by_axis = true\n", "conflict", "prior"),
        (NORMAL + "[prior.given]\nXu = { mean = 1.0, sd = 1.0 }\n", "unknown", "Xu"),
        (NORMAL + "[prior.given]\nXu = { value = 1.0 }\n", "unknown", "Xu"),
        (NORMAL + "[prior.given]\nXuu = { mean = 1.0, upper = 1.0 }\n", "conflict", "prior.given.Xuu"),
        (NORMAL + "[prior.given]\nXuu = { lower = 1.0, upper = 1.0 }\n", "value", "prior.given.Xuu"),
        (NORMAL + "[prior.given]\nXuu = { mean = 1.0, sd = -1.0 }\n", "value", "prior.given.Xuu.sd"),
        (NORMAL + 'correlations = [["Yuv", "Nuv", 0.5]]\n', "missing", "Yuv"),
        (NORMAL + 'table = "no.csv"\n', "file", ""),
        (NORMAL + "[nuisance]\nyaw0_deg = { value = 1.0 }\n", "conflict", "nuisance.yaw0_deg"),
        (NORMAL + "[nuisance]\nyaw0 = { mean = 1.0, sd = 1.0 }\n", "unknown", "yaw0"),
        (NORMAL + '[noise.z_m]\nkind = "normal"\n', "unknown", "noise.z_m"),
        (NORMAL + '[noise.x_m]\nkind = "student_t"\n', "missing", "noise.x_m.dof"),
        (NORMAL + '[noise.x_m]\nkind = "cauchy"\n', "unknown", "noise.x_m.kind"),
        (NORMAL + '[noise.x_m]\nkind = "normal"\nsd = -0.1\n', "value", "noise.x_m.sd"),
        (NORMAL + "[truth]\ncurrent_mps = [1.0]\n", "missing", "truth.current_mps.1"),
    ],
)
def test_refused(prepared, text, kind, key):
    with refused(kind, key):
        prepared(text)


@pytest.mark.parametrize(
    ("rows", "kind", "key"),
    [
        ("Yuv,-0.03,0.002\nYuv,-0.03,0.002\n", "conflict", "Yuv"),
        ("Yu,-0.03,0.002\n", "unknown", "Yu"),
        ("Yuv,-0.03,-0.002\n", "value", "prior.table"),
        ("Yuv,1e300,0.002\n", "value", "prior.table"),
        ("Yuv,-0.03,\n", "value", "prior.table"),
        ("Yuv,1,1\nNuv,1,1\nNur,1,1\n", "conflict", "correlations"),
    ],
)
def test_refused_tables(prepared, tmp_path, rows, kind, key):
    table = tmp_path / "tank.csv"
    table.write_text("coefficient,mean,sd\n" + rows)
    correlations = ""
    if rows.startswith("Yuv,1,1"):
        correlations = 'correlations = [["Yuv", "Nuv", 0.9], ["Nuv", "Nur", 0.9], ["Yuv", "Nur", -0.9]]\n'
    with refused(kind, key):
        prepared(NORMAL + f'table = "{table}"\n' + correlations)


def test_correlations_of_the_vehicle_file(own_boat, of_own_boat):
    """A joint normal prior of the free coefficients; what is given of one coefficient goes before it."""
    text = own_boat.read_text() + '[correlations]\ncoefficients = ["Nuv", "Nuu", "Yuv"]\n'
    own_boat.write_text(text + "matrix = [[1.0, 0.5, -0.8], [0.5, 1.0, 0.0], [-0.8, 0.0, 1.0]]\n")

    def prior(text, *free):
        return of_own_boat(text, *free).prior

    sd = np.array([0.003, 0.002, 1e-5])
    correlation = np.array([[1.0, -0.8, 0.0], [-0.8, 1.0, 0.5], [0.0, 0.5, 1.0]])  # of Yuv, Nuv, Nuu
    joint = stats.multivariate_normal([-0.03238, -0.012107, 0.0], correlation * np.outer(sd, sd))
    points = joint.rvs(5, random_state=1)
    np.testing.assert_allclose(prior("").log_density(points), joint.logpdf(points), rtol=1e-10)
    # With a spread for the rest, which is independent of these.
    whole = prior("sd = 0.2\n")
    assert whole.sd[3] == pytest.approx(0.2 * 0.005911)
    placed = np.tile(whole.mean, (5, 1))
    placed[:, [1, 2, 4]] = points
    at_mean = -np.log(2.0 * np.pi * whole.sd[0] * whole.sd[3])
    np.testing.assert_allclose(whole.log_density(placed), joint.logpdf(points) + at_mean, rtol=1e-10)
    # Of fewer free coefficients the others are integrated out.
    pair = stats.multivariate_normal(joint.mean[:2], joint.cov[:2, :2])
    few = prior("", ("Xuu", "Yuv", "Nuv"))
    np.testing.assert_allclose(few.log_density(points[:, :2]), pair.logpdf(points[:, :2]), rtol=1e-10)
    alone = prior("[prior.given]\nNuv = { lower = -0.02, upper = -0.01 }\n")
    np.testing.assert_allclose(alone.sd, [0.003, 0.01 / np.sqrt(12.0), 1e-5])
    with refused("conflict", "prior.centre"):
        prior('centre = "perturbed"\n')
    with refused("conflict", "correlations"):
        prior('correlations = [["Yuv", "Nuu", 0.99]]\n')


@pytest.mark.parametrize(
    ("place", "text"),
    {
        "prior": '[prior]\nkind = "relative_hierarchical"\nlog_sd = 1e-300\n',
        "prior.sd": '[prior]\nkind = "relative_normal"\nsd = 1e300\n',
        "prior.given.Xuu": NORMAL + "[prior.given]\nXuu = { lower = 1.0, upper = 1.0000000000000002 }\n",
        "nuisance.bias_yaw_deg": NORMAL + "[nuisance]\nbias_yaw_deg = { mean = 3.0, sd = 1e-300 }\n",
    }.items(),
)
def test_a_width_that_is_none_names_its_key(prepared, place, text):
    with pytest.raises(bs.InputError, match=re.escape(f"key '{place}': ")):
        prepared(text)

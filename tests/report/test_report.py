"""What the report says of the fit, and its page: pictures, tables, nothing from outside, nothing unescaped."""

import dataclasses
import json
import re

import numpy as np
import pytest
from support.laplace import posterior_of
from support.pages import Page

import bayesub as bs
from bayesub.findings import conflicts, remedies, run_numbers
from bayesub.findings.results import PREDICTIVE_DRAWS, Results, numbers_of
from bayesub.findings.verdicts import STATUS
from bayesub.inference import identifiability
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks import convergence
from bayesub.inference.checks import fit as criticism
from bayesub.io.words import cell, powers
from bayesub.problem import likelihoods
from bayesub.problem.joint import JointProblem
from bayesub.report import parameter_tables, report
from bayesub.report.figures import figures
from bayesub.report.page import product
from bayesub.report.plots import checks

FREE = ("Xuu", "Yuv", "Nuv", "Nur", "Nuu_dr")
SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
FIRST_WORDS = ("<nav", "Is it?", "sampling: converged", "fit: fits", "<dt>Boat", "<dt>Coefficients", "<dt>Not known")
PARTS = ("boat", "coefficients", "why", "can-i-trust-it", "details")
HOSTILE = "<script src='x'>alert(\"1\")</script>{{ 7 * 7 }}"
FIGURES = ("orders", "coefficients", "fan", "criticism", "ladder", "pairs", "directions")
FIGURES += ("corner_N", "correlation", "ranks", "derived")
FIGURES += ("fan_small", "forest_small", "pair_small")


def posed(track, seed=0, sensors=SENSOR, current_mps=(0.0, 0.0), **given):
    record = bs.observe(track, sensors, np.random.default_rng(seed), current_mps=current_mps)
    given = {"free": FREE, "prior": bs.priors.relative_normal(0.25), "dt": 1.0} | given
    return bs.Problem(track.simulator.vehicle, track.simulator.manoeuvre, record, **given)


def sentence(problem, at=None):
    """What is said of the residuals at the posterior mode."""
    at = gauss_newton(problem).values if at is None else at
    residuals = problem.quantile_residuals(at, np.random.default_rng(2))
    times = {name: problem.channels[name][0].times for name in residuals}
    return remedies.advise(criticism.criticise(residuals, times), problem)


@pytest.fixture(scope="module")
def problem(spiral_track):
    return posed(spiral_track, nuisance={"yaw0_deg": bs.priors.normal(0.0, 1.0)})


@pytest.fixture(scope="module")
def results(problem):
    posterior = posterior_of(problem, np.random.default_rng(1))
    estimates = [bs.baselines.sqp(problem.naive(), rng=np.random.default_rng(3), n_starts=1)]
    spectrum = identifiability.fisher(problem, posterior.best)
    return Results(problem, estimates, spectrum, posterior, None, 1)


@pytest.fixture(scope="module")
def numbers(results):
    return numbers_of(results) | {"name": "spiral", "question": "Is it?", "seconds": {"sampling": 1.0}}


def page_of(numbers, words=""):
    pictures = {name: (f"What {name} & others are. More.{words}", b"picture") for name in FIGURES}
    return report.page(numbers, pictures, commit="0123abc")


@pytest.fixture(scope="module")
def page(numbers):
    return page_of(numbers)


def test_a_right_model_is_not_doubted_and_agrees_with_the_chi_square_of_all(problem, numbers):
    found = numbers["criticism"]
    assert found["fits"]
    assert found["n_tests"] == 18
    assert "look like" in numbers["verdict"]["fit"]
    pooled = np.average(
        [c["chi_square_per_reading"] for c in found["channels"].values()],
        weights=[c["n_readings"] for c in found["channels"].values()],
    )
    # One is at the best draw, the other the mean over draws: apart by about the parameters over the readings.
    assert pooled == pytest.approx(numbers["chi_square_per_reading"], abs=2 * problem.n_params / 900)
    at_one = problem.quantile_residuals(problem.reference, np.random.default_rng(0))
    expected = np.mean(((problem.predicted(problem.reference)[0] - problem.readings) / problem.sds) ** 2)
    assert np.mean(np.concatenate([part[0] for part in at_one.values()]) ** 2) == pytest.approx(expected, rel=1e-12)


def test_a_forgotten_current_is_said_with_its_remedy(spiral_track):
    said = sentence(posed(spiral_track, current_mps=(0.1, 0.05)))
    assert "intervals are too narrow" in said
    assert "current_north_mps, current_east_mps in [nuisance]" in said
    known = {f"current_{way}_mps": bs.priors.normal(0.0, 0.2) for way in ("north", "east")}
    assert "look like" in sentence(posed(spiral_track, current_mps=(0.1, 0.05), nuisance=known))


def test_outliers_and_a_wrong_sd_are_said_with_their_remedies(spiral_track):
    outliers = bs.sensors.modified(SENSOR, ["yaw"], outlier_probability=0.04)
    said = sentence(posed(spiral_track, sensors=outliers))
    assert 'kind = "student_t" in [noise.yaw_deg]' in said
    assert "x_m" not in said
    for factor, word in ((1 / 1.5, "raise the sd"), (1.6, "lower the sd")):
        noise = {"yaw": likelihoods.Normal(factor * np.radians(0.1))}
        said = sentence(posed(spiral_track, noise=noise))
        assert word in said
        assert ("too wide" in said) == (factor > 1)
        assert 'kind = "unknown_sd" in [noise.yaw_deg]' in said


def test_slow_noise_is_said_and_quiet_once_told(spiral_track):
    slow = likelihoods.AR1(np.radians(0.1), 6.0)
    quiet = posed(spiral_track, noise={"yaw": slow})
    rng = np.random.default_rng(4)
    channels = [
        dataclasses.replace(c, values=slow.sample(quiet.predicted(quiet.reference)[0][600:], c.times, rng))
        if c.name == "yaw"
        else c
        for c in quiet.record.channels
    ]
    record = dataclasses.replace(quiet.record, channels=tuple(channels))
    given = {"free": FREE, "prior": bs.priors.relative_normal(0.25), "dt": 1.0}
    vehicle, manoeuvre = quiet.vehicle, quiet.manoeuvre
    assert 'kind = "ar1" in [noise.yaw_deg]' in sentence(bs.Problem(vehicle, manoeuvre, record, **given))
    assert "look like" in sentence(bs.Problem(vehicle, manoeuvre, record, noise={"yaw": slow}, **given))


def test_a_guess_with_the_wrong_sign_is_named_and_a_right_one_is_not(spiral_track, problem, numbers, page):
    """Without a conflict there are no words on it; with Nuu_dr of the wrong sign it is named, and nothing else."""
    assert not numbers["conflict"]["found"]
    assert "disagree" not in Page(page).text
    guess = problem.vehicle.xi.copy()
    guess[problem.equations.columns(["Nuu_dr"])] *= -1.0
    wrong = posed(spiral_track, prior=bs.priors.relative_normal(0.25, guess))
    found = conflicts.numbers(wrong, posterior_of(wrong, np.random.default_rng(1)))
    assert [row["name"] for row in found["named"]] == ["Nuu_dr"]
    said = conflicts.sentences({"conflict": found})
    assert said["conflict"].startswith("Prior and data disagree on Nuu_dr (posterior -0.0022")
    assert list(said) == ["conflict"]


def test_how_far_off_the_guesses_are_is_said_if_it_is_unknown(spiral_track, problem):
    """Guesses that are half of the truth: the interval of the scale holds log 2, and the prior's own is quoted."""
    prior = bs.priors.relative_hierarchical(0.25, 0.5 * problem.vehicle.xi)
    halved = posed(spiral_track, prior=prior)
    found = conflicts.numbers(halved, posterior_of(halved, np.random.default_rng(1)))
    assert not found["found"]
    (scale,) = found["scales"]
    assert scale["interval"][0] < np.log(2.0) < scale["interval"][1]
    assert "possible were 6 to 100 %" in conflicts.sentences({"conflict": found})["guess"]


def test_trials_of_a_joint_problem_and_channels_without_noise(spiral_track):
    joint = JointProblem({"first": posed(spiral_track, 1), "second": posed(spiral_track, 2, current_mps=(0.1, 0.0))})
    said = sentence(joint, joint.reference)
    assert "x[second]" in said
    assert "x[first]" not in said
    rounded = posed(spiral_track, sensors=bs.sensors.Sensor("yaw_deg", resolution=1.0, interval_s=2.0))
    assert "no residuals" in sentence(rounded, rounded.reference)


@pytest.mark.parametrize("n_channels", [1, 10])
@pytest.mark.rendered
def test_the_figure_is_drawn_for_one_channel_and_for_ten(n_channels, tmp_path, rng):
    times = {f"channel {k}": np.arange(40.0) for k in range(n_channels)} | {"short": np.arange(3.0)}
    residuals = {name: 3.0 * rng.standard_normal((2, len(own))) for name, own in times.items()}
    checks.draw_criticism(tmp_path / "figure.png", criticism.criticise(residuals, times), residuals, times)
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_the_page_begins_with_its_answer_and_has_five_parts(page):
    words = (*FIRST_WORDS, *(f'<h2 id="{part}">' for part in PARTS))
    places = [page.index(word) for word in words]
    assert places == sorted(places)
    assert page.count("<h2") == len(PARTS)
    assert [link["href"] for link in Page(page).all("a")[: len(PARTS)]] == [f"#{part}" for part in PARTS]


def test_every_picture_has_words_and_is_in_the_page(page):
    pictures = Page(page).all("img")
    assert len(pictures) == page.count("<figcaption>") == len(FIGURES)
    for picture in pictures:
        assert len(picture["alt"]) > 20
        assert picture["src"].startswith("data:image/png;base64,")


def test_captions_say_what_the_data_say(results, numbers):
    """No null direction is spoken of where there is none."""
    captions = captions_of(results)
    n_null = results.spectrum.n_null
    assert n_null == 0
    assert f"and {n_null} null" in captions["directions"]
    assert "would be orange" in captions["criticism"]
    pair = " with ".join(numbers["trade_offs"][0]["pair"])
    assert f"Most of all {pair}, correlation" in captions["pairs"]
    gains = {row["name"]: run_numbers.gain(row) for row in numbers["parameters"]}
    most = max(gains, key=gains.get)
    assert f"{cell(gains[most], 2)} times" in captions["ladder"]
    assert f"{most} {cell(gains[most], 2)}" in numbers["verdict"]["others_known"]


def test_a_solution_at_a_bound_of_the_search_is_named(results):
    """Three quarters of the guess off, on either side; what is nearer is inside."""
    problem, guess = results.problem, results.problem.prior.guess[: len(FREE)]
    solutions = guess * np.array([[1.0, 1.75, 1.0, 0.25, 1.7], [1.0] * len(FREE)])
    (search,) = results.estimates
    search = dataclasses.replace(search, names=FREE, solutions=solutions, costs=np.zeros(2))
    assert run_numbers._baseline(problem, search)["at_bounds"] == [["Yuv", "Nur"], []]


def test_the_caption_of_ranks_counts_bars_and_names_the_worst(results):
    """By draws of a Laplace approximation, which are independent, about 1 %; with one ensemble moved, many more."""
    sample = results.summary
    worst = max(sample.names, key=lambda name: sample.rhat[sample.names.index(name)])
    caption = captions_of(results)["ranks"]
    assert f"mix worst, {worst} (R-hat {sample.rhat.max():.4f})" in caption
    assert 100 * checks.outside(sample) < 2.0
    assert f"{100 * checks.outside(sample):.2g} % of the bars" in caption
    moved = sample.chain + sample.sd * np.array([2.0, 0.0, 0.0, 0.0])[:, None, None, None]
    assert checks.outside(dataclasses.replace(sample, chain=moved)) > 0.3


def test_the_caption_of_the_fan_says_how_much_narrower_the_posterior_is(results):
    """By hand from the draws of both; prior draws that fail would be counted."""
    problem = results.problem
    assert len(results.prior_predictive) == PREDICTIVE_DRAWS
    caption = captions_of(results)["fan"]
    assert "left out" not in caption
    found = re.search(r"half of the 90 % band: north ([\d.]+) before and ([\d.]+) m after", caption)
    last = len(problem.record.channels[0].times) - 1
    for draws, width in zip((results.prior_predictive, results.draws), found.groups(), strict=True):
        low, high = np.quantile(problem.predicted(draws)[:, last], [0.05, 0.95])
        assert float(width) == pytest.approx(0.5 * (high - low), rel=0.05)


def test_a_report_again_has_the_same_random_numbers_in_any_order(results):
    """Each has a stream of its own, so that what is asked for first changes nothing."""
    again, other = dataclasses.replace(results), dataclasses.replace(results)
    names = ("draws", "prior_predictive", "residuals", "derived")
    first = {name: getattr(again, name) for name in names}
    last = {name: getattr(other, name) for name in reversed(names)}
    assert again.prior_predictive.shape == (PREDICTIVE_DRAWS, results.problem.n_params)
    for name in ("draws", "prior_predictive"):
        np.testing.assert_array_equal(first[name], last[name])
    for channel, values in first["residuals"].items():
        np.testing.assert_array_equal(values, last["residuals"][channel])
    np.testing.assert_array_equal(first["derived"].prior.xi, last["derived"].prior.xi)
    assert numbers_of(again) == numbers_of(other)


def captions_of(results):
    reference = results.problem.reference
    baselines = [run_numbers._baseline(results.problem, estimate) for estimate in results.estimates]
    return {figure.name: figure.caption for figure in figures(results, reference, "truth", baselines)}


def test_nothing_is_loaded(page):
    for _, attributes in Page(page).elements:
        assert attributes.get("src", "data:").startswith("data:")
        assert attributes.get("href", "#").startswith(("#", "data:"))
    assert "http" not in page.replace("http-equiv", "")
    assert "@import" not in page
    assert "url(" not in page


def test_every_table_sorts_and_scrolls_by_itself(page):
    elements = Page(page).elements
    tables = [k for k, (tag, _) in enumerate(elements) if tag == "table"]
    for k in tables:
        assert elements[k][1]["class"] == "sortable"
        tag, box = elements[k - 1]
        assert (tag, box["class"], box["tabindex"]) == ("div", "scroll", "0")
        assert box["aria-label"]
        assert elements[k + 1][0] == "thead"
    for head in Page(page).all("th"):
        assert head["aria-sort"] == "none"
        assert head["scope"] == "col"
    assert page.count("<tbody>") == page.count("</tbody>") == len(tables)
    for part in page.split("<thead>")[1:]:
        heads, rows = part.split("</thead>")
        rows = re.split(r"<tr\b", rows.split("</tbody>")[0])[1:]
        assert rows
        assert {row.count("<td") for row in rows} == {heads.count("<th ")}


def test_one_table_has_a_row_for_each_parameter_and_all_that_is_said_of_it(numbers, page):
    """What the trial narrows most comes first, parameters that are no coefficients come last."""
    rows = sorted(numbers["parameters"], key=lambda row: row["contraction"]) + numbers["nuisance"]
    assert re.findall(r'<tr id="row-([^"]+)"', page) == [row["name"] for row in rows]
    (table,) = re.findall(r'id="coefficients-table">(.*?)</table>', page, re.DOTALL)
    for row, line in zip(rows, re.split(r"<tr\b", table)[2:], strict=True):
        first = words_of(line)
        assert first[1] == f"{row['contraction']:.3f}"
        assert f"{row['rhat']:.4f}" in first
    assert "mean ± sd × 10³" in table


def words_of(line):
    """The texts of the cells of a row."""
    return [Page(cell.partition(">")[2]).text.strip() for cell in line.split("<td")[1:]]


def test_small_coefficients_share_a_power_of_ten_and_others_have_their_unit():
    row = {"name": "Xuu", "mean": -0.00099986, "sd": 9e-7, "q5": -0.0010013, "q95": -0.00099837, "unit": None}
    row |= {"reference": -0.001, "prior_mean": -0.00099, "prior_sd": 0.00025, "relative_sd": 0.0009, "rhat": 1.0}
    row |= dict.fromkeys(("bulk_ess", "tail_ess", "tau_steps", "prior_sensitivity", "likelihood_sensitivity"), 1.0)
    row |= {"si_factor": 1e6, "si_unit": "kg/m", "conditional_sd": 9e-9}
    entry = {"name": "Xuu", "factor": "(rho/2) l^2", "regressor": "u*u*dr*dr", "meaning": "drag"}

    def cells(changes):
        numbers = {"parameters": [row | changes], "nuisance": [], "glossary": [entry]}
        return {column.head: column.cells[0] for column in parameter_tables.columns(numbers, "truth")}

    small, large = cells({}), cells({"unit": "kg/m"})
    assert small["mean ± sd × 10³"] == "-0.99986 ± 0.00090"
    assert small["95 % × 10³"] == "-0.99837"
    assert small["multiplies"] == "(ρ/2) l² · <i>u</i><sup>2</sup> <i>δ</i><sub>r</sub><sup>2</sup>"
    assert (small["sd, all others known × 10³"], small["gain, times"]) == ("0.0000090", "100")
    assert large["mean ± sd"] == "-0.00099986 ± 0.00000090"
    assert large["multiplies"] == "<i>u</i><sup>2</sup> <i>δ</i><sub>r</sub><sup>2</sup>"


def test_a_misfit_leads_the_page_and_takes_the_answer_away(numbers):
    """What speaks against the model stands before the answer, which is folded and marked as not to be used."""
    marks = [{"topic": "fit", "good": False, "word": "does not fit", "text": "The residuals of x are correlated."}]
    misfit = numbers | {"criticism": numbers["criticism"] | {"fits": False}}
    misfit |= {"outcome": {"verdict": "does not fit", "status": STATUS["does not fit"]}}
    misfit |= {"glance": numbers["glance"] | {"marks": marks}}
    doubted = page_of(misfit)
    words = ("DOES NOT FIT", "The residuals of x are correlated.", "Answer, not to be used", "<dt>Boat")
    places = [doubted.index(word) for word in (*words, 'id="figure-criticism"', '<h2 id="boat"')]
    assert places == sorted(places)
    assert doubted.count("The residuals of x are correlated.") == doubted.count('id="figure-criticism"') == 1
    text = report.markdown_page(misfit, {}, ())
    assert "**DOES NOT FIT: " in text
    assert "**Answer.** Not to be used. Of " in text


def test_every_text_is_escaped(numbers, page):
    """Whatever names, questions, sentences and captions hold, the page has the elements of an ordinary one."""
    hostile = page_of(with_texts(numbers, lambda text: text + HOSTILE), HOSTILE)
    elements = [[(tag, list(given)) for tag, given in Page(one).elements] for one in (page, hostile)]
    assert elements[0] == elements[1]
    assert HOSTILE not in hostile
    shown = Page(hostile).text.count(HOSTILE)
    assert shown >= len(FIGURES) + len(numbers["parameters"] + numbers["nuisance"])  # captions and rows, as they are
    assert "{{ 7 * 7 }}" in hostile


def with_texts(value, change):
    """A JSON value with every text changed but regressors, which are formulae."""
    if isinstance(value, dict):
        return {key: one if key == "regressor" else with_texts(one, change) for key, one in value.items()}
    if isinstance(value, list):
        return [with_texts(one, change) for one in value]
    return change(value) if isinstance(value, str) else value


def test_light_dark_paper_and_phone(page):
    for rule in ("prefers-color-scheme: dark", "@media print", "max-width: 40rem", 'name="viewport"', 'lang="en-GB"'):
        assert rule in page
    assert "th button { display: contents; }" in page  # Chromium repeats no head on paper that holds a box


def test_the_foot_names_version_and_commit(page):
    assert f"bayesub {bs.__version__}, commit 0123abc" in page


def test_the_glossary_says_what_each_coefficient_is(problem, numbers, page):
    """In the words of the equation set, of the coefficients that are free."""
    assert [entry["name"] for entry in numbers["glossary"]] == list(FREE)
    for entry in numbers["glossary"]:
        term = problem.equations.term(entry["name"])
        assert (entry["factor"], entry["regressor"], entry["meaning"]) == (term.scale, term.regressor, term.meaning)
        shown = page[page.index(f'<tr id="row-{term.name}"') :].partition("</tr>")[0]
        assert f"{powers(term.scale)} · {product(term.regressor)}" in shown
        assert shown.count(term.meaning) == 3  # in its column, on hovering, and for the search


def test_null_directions_are_those_of_the_equations(spiral_track):
    """A direction that is sloppier than the error of the Jacobian is not null for that: three are, by the equations."""
    problem = posed(spiral_track, free=bs.coefficients.HORIZONTAL)
    posterior = posterior_of(problem, np.random.default_rng(1))
    spectrum = identifiability.fisher(problem, posterior.best)
    results = Results(problem, [], spectrum, posterior, None, 0)
    numbers = numbers_of(results)
    vectors = [vector for rank in numbers["ranks"].values() for vector in rank["null_vectors"]]
    assert numbers["spectrum"]["n_null"] == len(vectors) == len(numbers["null_contraction"]) > 0
    assert numbers["null_contraction"] == pytest.approx(np.ones(len(vectors)), abs=0.15)
    assert numbers["spectrum"]["n_sharpened"] == spectrum.n_informed


def test_trade_offs_are_of_coefficients_and_nuisance_parameters_are_named_as_such(numbers):
    """Two of five coefficients and a nuisance parameter with planted correlations."""
    assert all(not {"yaw0_deg"} & set(t["pair"]) for t in numbers["trade_offs"])
    assert all("yaw0_deg" in t["pair"] for t in numbers["nuisance_trade_offs"])
    assert len(numbers["trade_offs"]) == 10
    assert len(numbers["nuisance_trade_offs"]) == 5
    planted = {"trade_offs": [], "nuisance_trade_offs": [{"pair": ["Xuu", "yaw0_deg"], "correlation": -0.97}]}
    assert run_numbers.sentences(numbers | planted)["trade_offs"] == (
        "No two coefficients are correlated by more than 0.9 in the posterior. "
        "With nuisance parameters: Xuu with yaw0_deg (-0.97)."
    )


def test_a_normal_posterior_is_said_to_be_normal_and_a_bent_one_not(results, numbers, page):
    """Draws of a Laplace approximation, and the same with Nuv moved by the square of another coefficient."""
    assert numbers["normality"]["close"]
    assert [row["name"] for row in numbers["normality"]["parameters"]] == list(FREE)  # and no nuisance parameter
    assert "The posterior is close to normal" in Page(page).text
    posterior, (by, moved) = results.posterior, map(FREE.index, ("Yuv", "Nuv"))
    chain = posterior.chain.copy()
    chain[..., moved] += posterior.sd[moved] * ((chain[..., by] - posterior.mean[by]) / posterior.sd[by]) ** 2
    bent = numbers_of(dataclasses.replace(results, posterior=dataclasses.replace(posterior, chain=chain)))
    assert not bent["normality"]["close"]
    assert " The posterior is not normal in Nuv: " in bent["verdict"]["normality"]
    assert "fit the next trial together with this one" in Page(page_of(numbers | bent)).text


def test_numbers_of_an_older_run_make_a_page(numbers, page):
    """Without what was not said then; all else stays."""
    verdict = {key: text for key, text in numbers["verdict"].items() if key != "normality"}
    older = {key: value for key, value in numbers.items() if key != "normality"} | {"verdict": verdict}
    left_out = f"<dt>Normality</dt><dd>{numbers['verdict']['normality']}</dd>"
    assert page_of(older) == page.replace(left_out, "")


def test_an_effective_sample_costs_its_jacobians_too(problem):
    posterior = posterior_of(problem, np.random.default_rng(1))
    counted = dataclasses.replace(posterior, jacobians=3, jacobian_price=20.0)
    costs = [
        run_numbers.collect(problem, [], spectrum, p, p, identifiability.null_space(problem, p.best), p.sd)["cost"]
        for p in (posterior, counted)
        for spectrum in [identifiability.fisher(problem, p.best)]
    ]
    assert costs[1]["evaluations_per_effective_sample"] == pytest.approx(
        1.6 * costs[0]["evaluations_per_effective_sample"]
    )
    assert costs[0]["jacobian_price_simulations"] is None
    assert costs[1]["jacobian_price_simulations"] == 20.0


@pytest.mark.slow
def test_a_report_is_written_twice_alike_and_as_pdf_on_demand(problem, tmp_path):
    posterior = posterior_of(problem, np.random.default_rng(1))
    spectrum = identifiability.fisher(problem, posterior.best)
    first = bs.write_report(tmp_path / "one", problem, [], spectrum, posterior)
    second = bs.write_report(tmp_path / "two", problem, [], spectrum, posterior, pdf=True)
    assert json.loads((tmp_path / "one" / "numbers.json").read_text()) == json.loads(json.dumps(first))
    assert first == second
    pages = [(tmp_path / name / "report.html").read_bytes() for name in ("one", "two")]
    assert pages[0] == pages[1]
    assert {file.stem for file in (tmp_path / "one").glob("*.png")} == set(FIGURES)
    assert not list((tmp_path / "one").glob("*.pdf"))
    assert {file.stem for file in (tmp_path / "two").glob("*.pdf")} == set(FIGURES)


def test_units_are_where_values_are(problem, numbers, page):
    """Coefficients without one are called non-dimensional, those of another set have theirs in the table."""
    assert numbers["coefficients"] == "non-dimensional coefficients"
    assert all(row["unit"] is None for row in numbers["parameters"])
    assert all("unit" not in row for row in numbers["nuisance"])
    assert "changes of the non-dimensional coefficients along which" in page
    boat = bs.load_vehicle("remus100")
    turn = bs.load_manoeuvre("turning_circle", boat)
    given = {"free": ("Xuu", "Yuv", "Nuv"), "dt": 0.05}
    problem = posed(bs.simulate(boat, turn, dt=0.05), **given)
    posterior = posterior_of(problem, np.random.default_rng(1))
    spectrum = identifiability.fisher(problem, posterior.best)
    results = Results(problem, [], spectrum, posterior, None, 1)
    dimensional = numbers_of(results) | {"name": "turn", "question": "", "seconds": {}}
    assert [row["unit"] for row in dimensional["parameters"]] == ["kg/m", "kg/m", "kg"]
    words = page_of(dimensional)
    assert ">Nuv (kg) <" in words
    assert "changes of the coefficients in their units along which" in words


@pytest.mark.parametrize(("jump", "said"), [(4.0, True), (0.0, False)])
def test_a_posterior_that_has_not_converged_says_why_if_its_density_jumps(results, jump, said, monkeypatch):
    """With steps to try; of one that converges nothing is asked."""
    monkeypatch.setattr(convergence, "largest_jump", lambda *_: jump)
    short = dataclasses.replace(results.posterior, criteria=bs.Criteria(ess=1e9))
    unfinished = dataclasses.replace(results, posterior=short)
    numbers = numbers_of(unfinished) | {"name": "spiral", "question": "Is it?", "seconds": {"sampling": 1.0}}
    assert numbers["convergence"]["largest_jump"] == jump
    assert ("Try dt_s = 0.2 in place of 1." in page_of(numbers)) == said
    assert "largest_jump" not in numbers_of(results)["convergence"]

"""Products of motion variables and controls: what they mean, what is refused, and their derivatives."""

from math import prod, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayesub.io.errors import InputError
from bayesub.logs.log_files import ACCELERATIONS, VELOCITIES
from bayesub.model.equations.regressors import CROSSFLOW, SYMBOLS, Regressor, parse

CONTROLS = ("dr", "ds", "thrust")
STATIONS = ((-0.8, 0.3, 0.2), (0.1, 0.5, 0.4), (0.7, 0.2, 0.6))  # position, height and breadth times the weight
FUNCTIONS = {"abs": abs, "sgn": lambda x: float(np.sign(x)), "sqrt": sqrt}

symbols = st.sampled_from([*VELOCITIES, *(s for s in SYMBOLS if s not in ACCELERATIONS), *CONTROLS])
powers = st.integers(1, 4)
factors = st.one_of(
    st.tuples(st.just("{}^{}"), symbols, powers),
    st.tuples(st.just("abs({})^{}"), symbols, powers),
    st.tuples(st.just("sgn({})^{}"), symbols, powers),
    st.tuples(st.just("{}^{}"), st.just("V"), st.integers(-4, -1)),
)


def values(u, v, w, q, r, uc, dr, trial_speed=1.3):
    """Each symbol -> its value, from the definitions; p, the other controls and a speed U are fixed numbers."""
    value = {"u": u, "v": v, "w": w, "p": -0.21, "q": q, "r": r, "U": trial_speed, "uc": uc, "dr": dr}
    value |= {"ds": -0.34, "thrust": 12.5, "nu": sqrt(v**2 + w**2), "V": sqrt(u**2 + v**2 + w**2)}
    value |= {"du": u - trial_speed, "duc": uc - u, **dict.fromkeys(CROSSFLOW, 0.0)}
    for x, height, breadth in STATIONS:
        across, down = v + x * r, w - x * q
        speed = sqrt(across**2 + down**2)
        value["crossflow_y"] -= height * across * speed
        value["crossflow_z"] -= breadth * down * speed
        value["crossflow_m"] += x * breadth * down * speed
        value["crossflow_n"] -= x * height * across * speed
    return value


MOTION = {"u": 1.4, "v": -0.3, "w": 0.17, "q": 0.4, "r": -0.6, "uc": 1.7, "dr": 0.23}


def kernel_values(motion):
    """What a kernel has at hand: the values, and the slopes and inverses that derivatives are written with."""
    value = values(**motion)
    step = 1e-3
    for symbol in ("nu", "V", *CROSSFLOW):
        for variable in "uvwqr":
            # Fourth-order differences of smooth functions of numbers near one: 1e-12.
            at = [values(**motion | {variable: motion[variable] + d * step})[symbol] for d in (-2, -1, 1, 2)]
            value[f"{symbol}_{variable}"] = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
    return value | {"inverse_V": 1 / value["V"]}


def calculated(code, value):
    """A product as Python calculates it; only the tests do this, with texts that the parser has made."""
    return eval(code, {"__builtins__": {}}, FUNCTIONS | value)


@settings(deadline=None, max_examples=300)
@given(st.lists(factors, min_size=1, max_size=5), st.integers(0, 3))
def test_a_product_is_the_product_of_its_factors(parts, spaces):
    """Whatever the factors, their powers and the spaces between them."""
    text = (" " * spaces + "*").join(form.format(symbol, power) for form, symbol, power in parts)
    value = values(**MOTION)
    functions = {"{}^{}": lambda x: x, "abs({})^{}": abs, "sgn({})^{}": np.sign}
    expected = prod(functions[form](value[symbol]) ** float(power) for form, symbol, power in parts)
    parsed = parse(text, CONTROLS)
    assert calculated(parsed.code, value | {"inverse_V": 1 / value["V"]}) == pytest.approx(expected, rel=1e-13)
    assert parsed.symbols == {symbol for _, symbol, _ in parts}


def test_the_largest_powers():
    """Nine of a factor and twenty altogether."""
    assert parse("u^9*v^9*r^2", ()).canonical == (("r", 2, 0), ("u", 9, 0), ("v", 9, 0))
    assert parse("V^-9", ()).canonical == (("V", -9, 0),)


def test_a_constant_is_an_empty_product():
    assert parse("1", CONTROLS) == Regressor(())
    assert parse("1", ()).code == "1.0"
    assert parse("1*u*1", ()) == parse("u", ())


@pytest.mark.parametrize("acceleration", ACCELERATIONS)
def test_an_acceleration_stands_alone(acceleration):
    assert parse(acceleration, ()).symbols == {acceleration}
    for text in (f"u*{acceleration}", f"{acceleration}^2", f"abs({acceleration})", f"{acceleration}*{acceleration}"):
        with pytest.raises(ValueError, match="an acceleration stands alone"):
            parse(text, ())


REFUSED = [
    ("u*x", "unknown symbol 'x'"),
    ("u*thrst", "unknown symbol 'thrst': did you mean 'thrust'"),
    ("nv", "unknown symbol 'nv'"),
    ("u^0", "powers are 1 to 9"),
    ("u^10", "powers are 1 to 9"),
    ("u^" + "9" * 400, "powers are 1 to 9"),
    ("u^" + "9" * 5000, "may be negative"),
    ("u^-1", "V, which is never zero, may be negative"),
    ("abs(V)^-1", "V, which is never zero, may be negative"),
    ("V^-10", "powers are 1 to 9"),
    ("u**2", "a factor is missing"),
    ("u*", "a factor is missing"),
    ("*u", "a factor is missing"),
    ("", "a factor is missing"),
    ("   ", "a factor is missing"),
    ("u^2.5", "'u^2.5' is no factor"),
    ("u^v", "'u^v' is no factor"),
    ("u^", "'u^' is no factor"),
    ("u+v", "'u+v' is no factor"),
    ("u/V", "'u/V' is no factor"),
    ("-u", "'-u' is no factor"),
    ("2*u", "'2' is no factor"),
    ("1.0", "'1.0' is no factor"),
    ("u v", "'u v' is no factor"),
    ("(u)", "'(u)' is no factor"),
    ("abs(u*v)", "'abs(u' is no factor"),
    ("abs(abs(u))", "'abs(abs(u))' is no factor"),
    ("abs(2)", "'abs(2)' is no factor"),
    ("abs()", "'abs()' is no factor"),
    ("abs", "unknown symbol 'abs'"),
    ("sin(u)", "'sin(u)' is no factor"),
    ("sqrt(u)", "'sqrt(u)' is no factor"),
    ("u.real", "'u.real' is no factor"),
    ("u[0]", "'u[0]' is no factor"),
    ("lambda:u", "'lambda:u' is no factor"),
    ("__import__('os').abort()", "'__import__('os').abort()' is no factor"),
    ("abs(__import__)", "'abs(__import__)' is no factor"),
    ("inverse_V", "unknown symbol 'inverse_V'"),
    ("work", "unknown symbol 'work'"),
    ("u\n*v\nw", r"'v\nw' is no factor"),
    ("\u0661", "is no factor"),
    ("u^\u0662", "is no factor"),
    ("\u03bd", "is no factor"),
    ("d\u0155", "is no factor"),
]


@pytest.mark.parametrize(("text", "words"), REFUSED, ids=[repr(text[:20]) for text, _ in REFUSED])
def test_refused(text, words):
    """With what is wrong, in one line that prints."""
    with pytest.raises(ValueError, match=r"^'") as error:
        parse(text, CONTROLS)
    assert words in str(InputError(str(error.value)))  # which makes it one line of limited length


@settings(deadline=None, max_examples=300)
@given(st.text(max_size=40))
def test_any_text_is_a_product_or_one_line(text):
    message, parsed = "", Regressor(())
    try:
        parsed = parse(text, CONTROLS)
    except ValueError as error:
        message = str(error)
    assert not message or message.startswith(f"'{text}': ")
    assert parsed.symbols <= {*VELOCITIES, *SYMBOLS, *CONTROLS}


def test_nothing_is_evaluated(tmp_path):
    """Not even what looks like a factor with a call in it."""
    path = tmp_path / "written"
    for text in (f"open({str(path)!r}, 'w')", f"u^open({str(path)!r}, 'w')", f"abs(open({str(path)!r}, 'w'))"):
        with pytest.raises(ValueError, match="is no factor"):
            parse(text, CONTROLS)
    assert not path.exists()


SAME = [
    ("u*u*dr", "dr*u^2"),
    ("u*u*dr", "abs(u)^2*dr"),
    ("abs(u)*u", "u*abs(u)"),
    ("abs(u)*abs(u)*u", "u^3"),
    ("sgn(v)*v", "abs(v)"),
    ("sgn(v)*abs(v)", "v"),
    ("sgn(v)^2*v", "v"),
    ("V*V^-1*u", "u"),
    ("V^2*V^-3", "V^-1"),
    ("abs(nu)*v", "nu*v"),
    ("abs(V)*u", "V*u"),
    ("abs(V)*V^-1*u", "u"),
    ("abs(U)*u", "U*u"),
    ("1*v", "v"),
]
DIFFERENT = [
    ("u*abs(u)", "u^2"),
    ("sgn(v)*nu*abs(r)", "nu*r"),
    ("sgn(v)", "1"),
    ("abs(v)", "v"),
    ("v^3", "v*abs(v)"),
    ("u*v", "u*w"),
    ("du", "duc"),
    ("V", "nu"),
]


@pytest.mark.parametrize(("first", "second"), SAME)
def test_the_same_product_otherwise_written(first, second):
    assert parse(first, CONTROLS).canonical == parse(second, CONTROLS).canonical


@pytest.mark.parametrize(("first", "second"), DIFFERENT)
def test_different_products(first, second):
    assert parse(first, CONTROLS).canonical != parse(second, CONTROLS).canonical


@settings(deadline=None, max_examples=100)
@given(st.lists(factors, min_size=1, max_size=4), st.randoms(use_true_random=False))
def test_the_canonical_form_does_not_know_the_order(parts, random):
    texts = [form.format(symbol, power) for form, symbol, power in parts]
    shuffled = random.sample(texts, len(texts))
    assert parse("*".join(texts), CONTROLS).canonical == parse("*".join(shuffled), CONTROLS).canonical


TO_DIFFERENTIATE = [
    *("u^3", "v*abs(v)", "sgn(v)*nu*abs(r)", "u*abs(q)*dr", "nu", "nu^2*w", "v*nu", "abs(w)*nu", "abs(nu)*v"),
    *("V", "V^2", "V^-1", "V^-3*v^2*u", "abs(V)*u", "sgn(V)*v", "U", "U*v", "U^2*dr"),
    *("du", "du^3", "abs(du)*du", "u*du*dr", "uc", "uc^2*dr", "duc", "duc*abs(duc)", "uc*duc*du", "sgn(duc)*u"),
    *("dr^2*u^2", "abs(dr)*dr*u^2", "sgn(dr)*u", "thrust", "thrust*dr", "1", "crossflow_y", "crossflow_z*u"),
    *("crossflow_m", "crossflow_n*dr", "crossflow_y*V^-1", "abs(crossflow_n)", "p*abs(p)", "r^3"),
]


@pytest.mark.parametrize("variable", ["u", "v", "w", "p", "q", "r", "uc", "dr"])
@pytest.mark.parametrize("text", TO_DIFFERENTIATE)
def test_derivatives(text, variable):
    """By velocities and controls, against differences of the definition."""
    regressor = parse(text, CONTROLS)
    value = kernel_values(MOTION)
    if variable == "p":  # which none of the composed symbols contains
        at = {d: calculated(regressor.code, value | {"p": value["p"] + d * 1e-3}) for d in (-2, -1, 1, 2)}
    else:
        moved = {d: values(**MOTION | {variable: MOTION[variable] + d * 1e-3}) for d in (-2, -1, 1, 2)}
        at = {d: calculated(regressor.code, v | {"inverse_V": 1 / v["V"]}) for d, v in moved.items()}
    expected = (at[-2] - 8 * at[-1] + 8 * at[1] - at[2]) / 12e-3
    code = regressor.derivative(variable)
    derivative = calculated(code, value) if code else 0.0
    # The truncation error is step^4 times a fifth derivative: of u^3 V^-3 about a thousand.
    assert derivative == pytest.approx(expected, rel=1e-9, abs=1e-9)
    if not code:
        assert expected == pytest.approx(0.0, abs=1e-12 * (1 + abs(at[1])))


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("u*v", (2, -2)),
        ("v^3", (3, -3)),
        ("V^-1*u*v*r", (1, -2)),
        ("nu*r", (1, -2)),
        ("rdot", (0, -2)),
        ("udot", (1, -2)),
        ("sgn(v)*nu*abs(r)", (1, -2)),
        ("u^2*dr", (2, -2)),
        ("duc*U", (2, -2)),
        ("crossflow_y", (4, -2)),
        ("1", (0, 0)),
        ("crossflow_n", (5, -2)),
        ("thrust", (4, -2)),
    ],
)
def test_dimensions(text, dimension):
    """Powers of metres and seconds; an angle has none, a sign neither; those of controls are given."""
    assert parse(text, CONTROLS).dimension({"dr": (0, 0), "ds": (0, 0), "thrust": (4, -2)}) == dimension

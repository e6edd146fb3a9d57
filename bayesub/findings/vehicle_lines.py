"""The card of a vehicle as text."""

from collections.abc import Sequence

from bayesub.findings import actuator_examination
from bayesub.findings.examination import CardWarning
from bayesub.findings.vehicle_examinations import GROWTH


def lines(numbers: dict, warnings: Sequence[CardWarning]) -> list[str]:
    """The card as text: a line a subject, then the warnings, each with its remedy."""
    sections = {
        "thrust": ("thrust_over_drag", _thrust_line),
        "straight flight": ("straight_flight", _straight_line),
        "stability": ("stability", _stability_line),
        "turning circle": ("turning_circle", _turn_line),
        "stern planes": ("stern_plane", _dive_line),
        "mass matrix": ("mass_matrix", _mass_line),
        "hydrostatics": ("hydrostatics", _hydrostatics_line),
    }
    skipped = numbers.get("skipped", {})
    texts = {
        subject: f"not examined: {skipped[section]}" if section in skipped else line(numbers)
        for subject, (section, line) in sections.items()
    }
    texts |= actuator_examination.lines(numbers)
    texts |= {f"zero in {axis}": " ".join(names) or "none" for axis, names in numbers["zero_coefficients"].items()}
    remedies = [f"  warning: {warning.text}; {warning.remedy}" for warning in warnings]
    return [*(f"  {subject:<17} {text}" for subject, text in texts.items()), *(remedies or ["  no warnings"])]


def _formatted(value: float | None, form: str = "z.3g") -> str:
    return "undefined" if value is None else format(value, form)


def _thrust_line(numbers):
    if None in numbers["thrust_over_drag"].values():
        return "no drag to balance it"
    above, below = (_formatted(ratio, ".4g") for ratio in numbers["thrust_over_drag"].values())
    return f"{above} times the drag at self-propulsion" + ("" if above == below else f", {below} just below it")


def _straight_line(numbers):
    flight = numbers["straight_flight"]
    if flight is None:
        return "not flown to the end"
    deeper = "depth_change_lengths"  # absent, as roll and pitch, with three degrees of freedom
    angles = ", ".join(
        f"{name} {_formatted(flight[f'{name}_deg'], 'z.1f')} deg"
        for name in ("roll", "pitch", "heading")
        if f"{name}_deg" in flight
    )
    percent = None if flight["speed_ratio"] is None else 100.0 * flight["speed_ratio"]
    return f"after {flight['lengths']:g} ship lengths {_formatted(percent, '.4g')} % of the speed, {angles}" + (
        f", {_formatted(flight[deeper], 'z.2f')} ship lengths deeper" if deeper in flight else ""
    )


def _stability_line(numbers):
    indices = numbers["stability"]
    rate = indices["growth_per_length"]
    fate = "undefined" if rate is None else f"{'grows' if rate > GROWTH else 'decays'} by {abs(rate):.2g} a ship length"
    values = ", ".join(
        f"{key.partition('_')[2]} = {_formatted(index, 'z.2f')}"
        for key, index in indices.items()
        if key != "growth_per_length"
    )
    return f"{values} (above 0: stable without righting moment); the slowest disturbance {fate}"


def _turn_line(numbers):
    turn = numbers["turning_circle"]
    if turn is None:
        return "not flown to the end"
    if turn["diameter_lengths"] is None:
        return f"{turn['rudder_deg']:g} deg of rudder do not turn it"
    percent = None if turn["speed_ratio"] is None else 100.0 * turn["speed_ratio"]
    return (
        f"{turn['rudder_deg']:g} deg of rudder: diameter {_formatted(turn['diameter_lengths'])} ship lengths "
        f"(tactical {_formatted(turn['tactical_diameter_lengths'])}), {_formatted(percent)} % of the speed, drift "
        f"{_formatted(turn['drift_angle_deg'])} deg; positive rudder turns {turn['positive_rudder_turns']}"
    )


def _dive_line(numbers):
    dive = numbers["stern_plane"]
    if dive is None:
        return "not flown to the end"
    return (
        f"{dive['angle_deg']:+g} deg: {dive['positive_angle_pitches'] or 'no answer in pitch'}, pitch "
        f"{_formatted(dive['pitch_after_two_lengths_deg'], '+z.2g')} deg after two ship lengths"
    )


def _mass_line(numbers):
    mass = numbers["mass_matrix"]
    pairs = {pair: difference for pair, difference in mass["added_mass_differences"].items() if difference > 0.01}
    differ = ", ".join(
        f"{pair.replace('-', ' and ')} by {100 * difference:.0f} %" for pair, difference in pairs.items()
    )
    definite = "positive definite" if mass["positive_definite"] else "NOT positive definite"
    return f"{definite}; added mass {f'not symmetric: {differ}' if differ else 'symmetric'}"


def _hydrostatics_line(numbers):
    balance = numbers["hydrostatics"]
    ratio = balance["buoyancy_over_weight"]
    percent = _formatted(None if ratio is None else 100.0 * ratio, ".5g")
    return (
        f"buoyancy {percent} % of the weight, centre of gravity {_formatted(balance['BG_m'])} m below that of buoyancy"
    )

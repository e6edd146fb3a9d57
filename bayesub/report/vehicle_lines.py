"""The card of a vehicle as text."""

from bayesub.report.vehicle_card import GROWTH, Card


def lines(card: Card) -> list[str]:
    """The card as text: a line a subject, then the warnings, each with its remedy."""
    told = {
        "thrust": _thrust_line,
        "straight flight": _straight_line,
        "stability": _stability_line,
        "turning circle": _turn_line,
        "stern planes": _dive_line,
        "mass matrix": _mass_line,
        "hydrostatics": _hydrostatics_line,
    }
    found = [f"  {subject:<17} {tell(card.numbers)}" for subject, tell in told.items()]
    zeros = card.numbers["zero_coefficients"]
    found += [f"  {f'zero in {axis}':<17} {' '.join(names) or 'none'}" for axis, names in zeros.items()]
    if not card.warnings:
        return [*found, "  no warnings"]
    return [*found, *(f"  warning: {w.text}; {w.remedy}" for w in card.warnings)]


def _shown(value: float | None, form: str = "z.3g") -> str:
    return "undefined" if value is None else format(value, form)


def _thrust_line(numbers):
    if None in numbers["thrust_over_drag"].values():
        return "no drag to balance it"
    above, below = (_shown(ratio, ".4g") for ratio in numbers["thrust_over_drag"].values())
    return f"{above} times the drag at self-propulsion" + ("" if above == below else f", {below} just below it")


def _straight_line(numbers):
    found = numbers["straight_flight"]
    if found is None:
        return "not flown to the end"
    angles = ", ".join(f"{name} {_shown(found[f'{name}_deg'], 'z.1f')} deg" for name in ("roll", "pitch", "heading"))
    percent = None if found["speed_ratio"] is None else 100.0 * found["speed_ratio"]
    return (
        f"after {found['lengths']:g} ship lengths {_shown(percent, '.4g')} % of the speed, {angles}, "
        f"{_shown(found['depth_change_lengths'], 'z.2f')} ship lengths deeper"
    )


def _stability_line(numbers):
    indices = numbers["stability"]
    rate = indices["growth_per_length"]
    fate = "undefined" if rate is None else f"{'grows' if rate > GROWTH else 'decays'} by {abs(rate):.2g} a ship length"
    return (
        f"G_h = {_shown(indices['horizontal_G_h'], 'z.2f')}, G_v = {_shown(indices['vertical_G_v'], 'z.2f')} (above 0: "
        f"stable without righting moment); the slowest disturbance {fate}"
    )


def _turn_line(numbers):
    turn = numbers["turning_circle"]
    if turn is None:
        return "not flown to the end"
    if turn["diameter_lengths"] is None:
        return f"{turn['rudder_deg']:g} deg of rudder do not turn it"
    percent = None if turn["speed_ratio"] is None else 100.0 * turn["speed_ratio"]
    return (
        f"{turn['rudder_deg']:g} deg of rudder: diameter {_shown(turn['diameter_lengths'])} ship lengths "
        f"(tactical {_shown(turn['tactical_diameter_lengths'])}), {_shown(percent)} % of the speed, drift "
        f"{_shown(turn['drift_angle_deg'])} deg; positive rudder turns {turn['positive_rudder_turns']}"
    )


def _dive_line(numbers):
    dive = numbers["stern_plane"]
    if dive is None:
        return "not flown to the end"
    return (
        f"{dive['angle_deg']:+g} deg: {dive['positive_angle_pitches'] or 'no answer in pitch'}, pitch "
        f"{_shown(dive['pitch_after_two_lengths_deg'], '+z.2g')} deg after two ship lengths"
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
    found = numbers["hydrostatics"]
    ratio = found["buoyancy_over_weight"]
    percent = _shown(None if ratio is None else 100.0 * ratio, ".5g")
    return f"buoyancy {percent} % of the weight, centre of gravity {_shown(found['BG_m'])} m below that of buoyancy"

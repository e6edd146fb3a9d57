"""Sets of coefficients and the true boat under the same forces, push and current."""

import numpy as np

from bayesub.model.disturbance import Disturbance, ForceHistory, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle

SEED, SHARES = 103, (0.005, 0.015, 0.05)  # of random forces, of which shares are of the hull's
PUSH, SHEAR = 0.05, 0.05  # of the hull's side force; of the trial speed, a ship length down
STILL, PUSHED, SHEARED = "still water", f"a push of {100 * PUSH:g} %", "a sheared current"


def disturbed(boat: Vehicle, simulators: list[Simulator], sets: np.ndarray) -> dict[str, list[float]]:
    """Disturbance -> (n_sets,) largest position errors (m) when sets and true boat move under the same disturbance.

    Random forces on all axes have shares of those of the hull; a push is a steady side force of a thruster at the bow
    from a third of the manoeuvre on; the current is sheared, so that a boat at another depth drifts otherwise.

    Parameters
    ----------
    boat : vehicle
    simulators : of the manoeuvres
    sets : (n_sets, 101) non-dimensional coefficients
    """
    everyone, found = np.vstack([boat.xi, sets]), {}
    second = boat.speed_mps / boat.length_m
    for number, simulator in enumerate(simulators):
        hull = hull_force_rms([simulator])
        axes = tuple(axis for axis, rms in zip(AXES, hull, strict=True) if rms > 0.0)
        sizes = hull[hull > 0.0]
        cases = {STILL: simulator}
        for share in SHARES:
            process, rng = Disturbance(axes, share * sizes, 2.0 / second), np.random.default_rng([SEED, number])
            cases[f"random forces of {100 * share:g} %"] = simulator.disturbed(process, rng)
        cases[PUSHED] = simulator.disturbed(pushed(simulator, PUSH * hull[AXES.index("Y")], boat))
        for name, flown in cases.items():
            states, status = flown.run(everyone)
            found.setdefault(name, []).append(distances(states, status))
            if flown is simulator:
                deeper = np.cumsum((states[..., 2] - boat.depth_m) * np.gradient(simulator.times), axis=1)
                states[..., 0] += SHEAR * second * deeper
                found.setdefault(SHEARED, []).append(distances(states, status))
    return {name: np.max(off, axis=0).tolist() for name, off in found.items()}


def pushed(simulator: Simulator, force: float, boat: Vehicle) -> ForceHistory:
    """A side force (N) at the bow, from a third of a manoeuvre on."""
    end, lever = simulator.manoeuvre.duration, 0.4 * boat.length_m
    values = np.array([[0.0, 0.0], [0.0, 0.0], [force, force * lever], [force, force * lever]])
    return ForceHistory(np.array([0.0, end / 3.0, end / 3.0 + simulator.step, end]), ("Y", "N"), values)


def distances(states: np.ndarray, status: np.ndarray) -> np.ndarray:
    """(n_sets,) largest distances (m) of states (1 + n_sets, n_times, 12) from the first; infinite for what fails."""
    off = np.linalg.norm(states[1:, :, :3] - states[0, :, :3], axis=2).max(axis=1)
    return np.where(status[1:] == 0, off, np.inf)

"""What compiling costs, by processor time: of the sets of equations and of the loops, each from an empty cache.

It has a process of its own: ``python -m bayesub.cli.compilation FILE`` writes the seconds.
"""

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bayesub.io import toml_files
from bayesub.kernels.families import UNITS, family
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import source
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle


def _taken(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def _compile(equations, plane) -> None:
    kernels = family(source(equations, plane))
    for name in UNITS:
        kernels.unit(name)


def measured() -> dict[str, float]:
    """Processor seconds by name: each set and sub-problem, then loops of flights, of batches and of derivatives."""
    found = {}
    for name in toml_files.built_in("equations"):
        equations = load_equations(name)
        for plane in (None, *equations.subproblems) if equations.degrees_of_freedom == 6 else equations.subproblems:
            found[f"{name} {plane or 'full'}"] = _taken(lambda of=(equations, plane): _compile(*of))
    boat = load_vehicle("suboff")
    simulator = Simulator(boat, load_manoeuvre("horizontal", boat), np.array([10.0]), dt=1.0)
    many = np.tile(boat.xi, (20, 1))
    found["loops of a flight"] = _taken(lambda: simulator.run(boat.xi))
    found["loops of a batch"] = _taken(lambda: simulator.run(many))
    found["loops of accelerations"] = _taken(lambda: simulator.accelerations(boat.xi, simulator.run(boat.xi)[0]))
    found["loops of derivatives"] = _taken(lambda: simulator.sensitivities(boat.xi, boat.equations.names))
    return found


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(measured()))

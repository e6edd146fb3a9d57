"""What a user of JAX would write instead of the simulator: ``jit(vmap(scan))``, and derivatives by ``jacfwd``.

The equations of motion are those of the kernels, which JAX follows. Precision and threads of
JAX are settled when it is loaded, so that it has a process of its own: ``python -m rivals.jax_simulator FILE
THREADS SECONDS`` writes what it has measured and computed.
"""

import importlib.util
import sys
from collections.abc import Callable
from functools import partial

import numpy as np

from bayesub.kernels.dynamics import Boat, InverseMass, euler_derivative
from bayesub.kernels.lanes import choose, sine_cosine, sqrt
from bayesub.logs import log_files
from bayesub.model.simulator import Simulator
from bayesub.study.before.bench import BATCH, perturbed, shortest, spiral
from rivals.in_threads import in_threads

OUTPUTS = ("x", "y", "psi")  # of which derivatives are computed


def is_installed() -> bool:
    """Whether JAX is."""
    return importlib.util.find_spec("jax") is not None


def environment(threads: int, cache: str) -> dict[str, str]:
    """Environment variables of a process that uses JAX in double precision on so many threads.

    It keeps what it has compiled in the folder `cache`.
    """
    of_cache = {"JAX_COMPILATION_CACHE_DIR": cache, "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    return {"JAX_ENABLE_X64": "1", "JAX_PLATFORMS": "cpu", "NPROC": str(threads), **of_cache}


def simulation(simulator: Simulator) -> Callable:
    """The function of JAX that gives states (n_steps + 1, 12) at all steps from coefficients (n_terms,)."""
    import jax
    import jax.numpy as jnp

    vehicle, kernels, step = simulator.vehicle, simulator.kernels, simulator.step
    factors = simulator.dimensional(np.ones_like(vehicle.xi))[0]
    rigid_body = kernels.mass_matrix(np.zeros_like(factors), vehicle.body)
    axes, accelerations, added = kernels.added_mass.T

    class Inverse(InverseMass):
        def __matmul__(self, forces):
            return tuple(self.entries @ jnp.stack(forces))

    def root(x):  # with a derivative at zero, which is what the kernels have there: none
        return jnp.where(x > 0.0, jnp.sqrt(jnp.where(x > 0.0, x, 1.0)), 0.0)

    choose.register(jax.core.Tracer, lambda test, a, b: jax.tree.map(partial(jnp.where, test), a, b))
    sine_cosine.register(jax.core.Tracer, lambda angle: (jnp.sin(angle), jnp.cos(angle)))
    sqrt.register(jax.core.Tracer, root)

    def simulate(xi):
        coefficients = factors * xi
        inverse = jnp.linalg.inv(rigid_body - jnp.zeros((6, 6)).at[axes, accelerations].add(coefficients[added]))

        def rates(state, controls):
            boat = Boat(
                kernels.equations, state, vehicle.body, Inverse(inverse), coefficients, vehicle.constants, controls
            )
            return jnp.stack(euler_derivative(boat))

        def advance(state, controls):
            k1 = rates(state, controls[0])
            k2 = rates(state + 0.5 * step * k1, controls[1])
            k3 = rates(state + 0.5 * step * k2, controls[1])
            k4 = rates(state + step * k3, controls[2])
            return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), state

        return jax.lax.scan(advance, jnp.array(simulator.manoeuvre.initial_state), jnp.array(simulator._stages))[1]

    return simulate


def main(file: str, threads: int, seconds: float) -> None:
    """Measure and write: seconds of a simulation and of a Jacobian, states and Jacobian of the boat itself."""
    import jax

    simulator = spiral()
    vehicle = simulator.vehicle
    simulate, outputs = simulation(simulator), np.array(log_files.positions(*OUTPUTS))
    fly, differentiate = jax.jit(jax.vmap(simulate)), jax.jit(jax.jacfwd(lambda xi: simulate(xi)[:, outputs]))
    boats = perturbed(vehicle, BATCH)
    boats[0] = vehicle.xi
    boats, boat = jax.device_put(boats), jax.device_put(vehicle.xi)
    states, jacobian = np.array(fly(boats)[0]), np.array(differentiate(boat))
    duration = in_threads(lambda: jax.block_until_ready(fly(boats)), threads, seconds) / BATCH
    (of_jacobian,) = shortest(lambda: jax.block_until_ready(differentiate(boat)), seconds=seconds)
    np.savez(file, seconds=duration, jacobian_seconds=of_jacobian, states=states, jacobian=jacobian)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]))

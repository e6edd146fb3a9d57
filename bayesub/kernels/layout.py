"""Rows of the lane workspace and of the body vector, and the compiler settings that all kernels share."""

import functools
import hashlib
import types
from pathlib import Path

import numba
from llvmlite import ir
from numba.extending import lower_builtin, type_callable

_SETTINGS = {"error_model": "numpy", "fastmath": {"contract"}}
_SOURCES = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
DIGEST = hashlib.sha256(_SOURCES).hexdigest()[:12]


def jit(function=None, **options):
    """Compile and cache a kernel.

    numba holds a cached function for current while its own file is unchanged, but kernels have functions of other
    files inlined. The name under which a kernel is cached therefore carries a digest of all kernel sources.
    """
    if function is None:
        return functools.partial(jit, **options)
    function.__qualname__ += f"_{DIGEST}"
    return numba.njit(cache=True, nogil=True, **_SETTINGS, **options)(function)


def batched(function):
    """Compile a kernel whose first argument is a batch, to run on all threads if that has more than LANES members.

    For fewer, waking the threads would take longer than the work.
    """
    serial = jit(types.FunctionType(function.__code__, function.__globals__, f"{function.__name__}_serial"))
    parallel = jit(function, parallel=True)

    @functools.wraps(function)
    def kernel(batch, *arguments):
        return (parallel if len(batch) > LANES else serial)(batch, *arguments)

    return kernel


inline = functools.partial(numba.njit, forceinline=True, **_SETTINGS)

LANES = 8


def widest_vectors():
    """Let the compiler use 512-bit vectors in the function that calls this, where the processor has them.

    LLVM prefers 256 bits unless told otherwise, function by function. Without the compiler this does nothing.
    """


@type_callable(widest_vectors)
def _type_widest_vectors(context):
    return lambda: numba.types.void


@lower_builtin(widest_vectors)
def _lower_widest_vectors(context, builder, signature, arguments):
    # llvmlite's own `add` takes only attributes that it knows.
    set.add(builder.function.attributes, '"prefer-vector-width"="512"')
    return context.get_dummy_value()


def distinct_arrays():
    """Promise the compiler that the arrays given to the function that calls this do not overlap.

    Without the promise a loop over a few elements would spend more on finding that out than on its arithmetic.
    """


@type_callable(distinct_arrays)
def _type_distinct_arrays(context):
    return lambda: numba.types.void


@lower_builtin(distinct_arrays)
def _lower_distinct_arrays(context, builder, signature, arguments):
    for argument in builder.function.args:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute("noalias")
    return context.get_dummy_value()


N_STATES = 12
N_CONTROLS = 4  # rudder, bow plane, stern plane (rad) and n/k0 (m/s)
N_COEFFICIENTS = 101

# The body vector: everything of a vehicle that is not a hydrodynamic coefficient. SI units.
BODY = (
    "mass", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Izx",
    "xG", "yG", "zG", "weight", "buoyancy", "xB", "yB", "zB",
    "b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8", "b9",  # thrust polynomial times (rho/2) l^2
    "zP", "Kn1", "Kn2",  # thrust line, and propeller torque per (n/k0)^2 and (n/k0) u
)  # fmt: skip
N_BODY = len(BODY)
THRUST = BODY[BODY.index("b1") : BODY.index("b9") + 1]
(
    MASS, IXX, IYY, IZZ, IXY, IYZ, IZX, XG, YG, ZG, WEIGHT, BUOYANCY, XB, YB, ZB,
    B1, B2, B3, B4, B5, B6, B7, B8, B9, ZP, KN1, KN2,
) = range(N_BODY)  # fmt: skip

# First row of each group in the workspace. A state takes thirteen rows: with quaternions its attitude is the vector
# part in the rows of the Euler angles and the scalar part in the last row, which Euler angles leave alone.
STATE_ROWS = N_STATES + 1
STATE = 0  # state at the start of the step
STAGE = STATE + STATE_ROWS  # state at which the next stage is evaluated
SUM = STAGE + STATE_ROWS  # weighted sum of the stage derivatives
SLOPE = SUM + STATE_ROWS  # derivative at the start of the step
PREVIOUS = SLOPE + STATE_ROWS  # state and derivative one step back, for the dense output
PREVIOUS_SLOPE = PREVIOUS + STATE_ROWS
OUTPUT = PREVIOUS_SLOPE + STATE_ROWS  # state interpolated to an output time
COEFFICIENTS = OUTPUT + STATE_ROWS  # dimensional
BODY_ROWS = COEFFICIENTS + N_COEFFICIENTS
INVERSE_MASS = BODY_ROWS + N_BODY  # 6 x 6, row by row
N_ROWS = INVERSE_MASS + 36

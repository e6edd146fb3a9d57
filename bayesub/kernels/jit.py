"""How every kernel is compiled and cached."""

import functools
import hashlib
import types
from pathlib import Path

import numba
from llvmlite import ir
from numba.extending import lower_builtin, type_callable

from bayesub.kernels.memory import keep_freed_memory
from bayesub.kernels.workspace import LANES

keep_freed_memory()
_SETTINGS = {"error_model": "numpy", "fastmath": {"contract"}}
_SOURCES = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
DIGEST = hashlib.sha256(_SOURCES).hexdigest()[:12]
FAMILY = "bayesub_motion_"  # begin of the names of packages of :mod:`bayesub.kernels.families`


def jit(function=None, **options):
    """Compile and cache a kernel.

    numba holds a cached function for current while its own file is unchanged, but kernels have functions of other
    files inlined. The name under which a kernel is cached therefore carries a digest of all kernel sources; that of a
    family of kernels (:mod:`bayesub.kernels.families`) carries the name of its package too.
    """
    if function is None:
        return functools.partial(jit, **options)
    family = function.__module__.rpartition(".")[0].rpartition("_")[2]
    function.__qualname__ += f"_{DIGEST}_{family}" if function.__module__.startswith(FAMILY) else f"_{DIGEST}"
    return numba.njit(cache=True, nogil=True, **_SETTINGS, **options)(function)


def batched(function):
    """Compile a kernel whose first argument is a batch, to run on all threads if that has more than LANES members.

    For fewer, waking the threads would take longer than the work. The attribute `variants` of the result holds both
    compiled functions.
    """
    serial = jit(types.FunctionType(function.__code__, function.__globals__, f"{function.__name__}_serial"))
    parallel = jit(function, parallel=True)

    @functools.wraps(function)
    def kernel(batch, *arguments):
        return (parallel if len(batch) > LANES else serial)(batch, *arguments)

    kernel.variants = serial, parallel
    return kernel


inline = functools.partial(numba.njit, forceinline=True, **_SETTINGS)


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

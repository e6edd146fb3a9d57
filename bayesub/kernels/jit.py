"""How loops and lane functions become machine code: all that leans on the inside of numba and of LLVM.

numba compiles loops over steps, blocks and columns, which are the same for all equation sets. What is compiled for an
equation set are lane functions (:mod:`bayesub.kernels.lanes`), which the loops call by the address of their code.
"""

import functools
import importlib
import os
import pickle
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
from llvmlite import ir
from numba.core import compiler, serialize, types
from numba.core.caching import NullCache
from numba.core.registry import cpu_target
from numba.extending import intrinsic, lower_builtin, type_callable

from bayesub.kernels import compiled_files, lanes
from bayesub.kernels.memory import keep_freed_memory, plain
from bayesub.kernels.workspace import LANES

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

keep_freed_memory()
# Threads of OpenMP sleep until the next loop. By default they spin, and beside a busy process each of the many short
# loops of a search then waits for a core.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
INTERPRETED = bool(numba.config.DISABLE_JIT)  # type: ignore[attr-defined]  # made by numba when it is imported
_EXACT: dict[str, Any] = {"error_model": "numpy"}
_SETTINGS = _EXACT | {"fastmath": {"contract"}}
# Loops that are shared among threads are written so; no other is.
_THREADS = dict.fromkeys(
    ("comprehension", "reduction", "inplace_binop", "setitem", "numpy", "stencil", "fusion"), False
) | {"prange": True}


@functools.cache
def processor() -> tuple[str, str, str]:
    """System, name and features of the processor for which is compiled; NUMBA_CPU_NAME names another."""
    return cpu_target.target_context.codegen().magic_tuple()


@functools.cache
def _sources(folder: Path) -> bytes:
    return b"".join(path.read_bytes() for path in sorted(folder.glob("*.py")))


def _key(*parts: str | bytes) -> str:
    versions = numba.__version__, llvmlite.__version__, repr(processor()), str(numba.config.OPT)  # type: ignore[attr-defined]
    return compiled_files.digest(_sources(Path(__file__).parent), *versions, *parts)


class _Kept(NullCache):
    """What numba compiled of a loop, kept in the user's cache folder with the names of the loops that it calls."""

    def __init__(self, function, options: dict):
        self._function, self._options = function, repr(sorted(options.items(), key=str))

    def _key(self, signature):
        # What is kept holds objects of Python, and code of other functions of its folder.
        others = _sources(Path(self._function.__code__.co_filename).parent)
        name = f"{self._function.__module__}.{self._function.__name__}"
        return _key(platform.python_version(), others, name, self._options, repr(signature))

    def load_overload(self, sig, target_context):
        content = compiled_files.load(self._key(sig))
        if content is None:
            _tell_user_to_wait()
            return None
        called, compiled = pickle.loads(content)
        if not all(_is_loaded(*one) for one in called):
            return None
        target_context.refresh()
        return compiler.CompileResult._rebuild(target_context, *compiled)

    def save_overload(self, sig, cres):
        names = (each.name for each in cres.library._final_module.functions if each.is_declaration)
        called = [(*_loops[name], name) for name in names if name in _loops]
        compiled_files.save(self._key(sig), serialize.dumps((called, cres._reduce())))


_loops: dict[str, tuple] = {}  # name in machine code -> module, name and types of a loop of this process


def _is_loaded(module, name, types_of_arguments, symbol) -> bool:
    """Whether a loop that another calls is there, by the name by which that calls it; it is loaded if it is not yet."""
    loop = getattr(importlib.import_module(module), name)
    loop.compile(types_of_arguments)
    return loop.overloads[types_of_arguments].fndesc.llvm_func_name == symbol


def _add_alone(dispatcher, cres):
    """Let loops call a loop by its name in machine code, where numba would make its code part of theirs."""
    type(dispatcher).add_overload(dispatcher, cres)
    context = cpu_target.target_context
    context.remove_user_function(cres.entry_point)
    context.insert_user_function(cres.entry_point, cres.fndesc)
    function = dispatcher.py_func
    _loops[cres.fndesc.llvm_func_name] = function.__module__, function.__name__, cres.signature.args


@functools.cache
def _tell_user_to_wait() -> None:
    if sys.stderr.isatty():
        print("bayesub: compiling, once for this version on this processor: some ten seconds", file=sys.stderr)


def jit(function: Callable | None = None, *, threads: bool = False, exact: bool = False) -> Any:
    """Compile a loop when it is first called, or load it.

    Its machine code is its own: of what it calls, loops are compiled and kept by themselves, so that each is compiled
    once and is the same whoever compiled it; and :data:`inline` and :data:`spliced` functions are part of it. With
    `threads` its ``prange`` is shared among them; if it is `exact` products and sums are rounded one by one.
    """
    if function is None:
        return functools.partial(jit, threads=threads, exact=exact)
    if INTERPRETED:
        return np.errstate(all="ignore")(function)  # as in machine code
    options = (_EXACT if exact else _SETTINGS) | ({"parallel": _THREADS} if threads else {})
    dispatcher: Any = numba.njit(nogil=True, **options)(function)
    dispatcher._cache = _Kept(function, options)
    dispatcher.add_overload = functools.partial(_add_alone, dispatcher)
    return dispatcher


def variants(function) -> tuple[Callable, Callable]:
    """A function with a ``prange``, compiled for one thread and for all."""
    serial = FunctionType(function.__code__, function.__globals__, f"{function.__name__}_serial")
    return jit(serial), jit(function, threads=True)


def batched(function: Callable) -> Callable[..., Any]:
    """Compile a kernel whose first argument is a batch, to run on all threads if that has more than LANES members.

    For fewer, waking the threads would take longer than the work. The attribute `variants` of the result holds both
    compiled functions. Arguments are arrays and numbers.
    """
    serial, parallel = variants(function)

    @functools.wraps(function)
    def kernel(batch, *arguments):
        given = (plain(each, each.dtype.type) if isinstance(each, np.ndarray) else float(each) for each in arguments)
        return (parallel if len(batch) > LANES else serial)(plain(batch), *given)

    kernel.variants = serial, parallel  # type: ignore[attr-defined]
    return kernel


# Part of whoever calls it: `inline` in the machine code, with what it promises, `spliced` in the text.
inline: Decorator = functools.partial(numba.njit, forceinline=True, **_SETTINGS)
inline_exact: Decorator = functools.partial(numba.njit, forceinline=True, **_EXACT)
spliced: Decorator = functools.partial(numba.njit, inline="always", **_SETTINGS)


def widest_vectors():
    """Let the compiler use 512-bit vectors in the function that calls this, where the processor has them.

    LLVM prefers 256 bits unless set otherwise, function by function. Without the compiler this does nothing.
    """


def distinct_arrays():
    """Promise the compiler that the arrays given to the function that calls this do not overlap.

    Without the promise a loop over a few elements would spend more on finding that out than on its arithmetic.
    """


@lower_builtin(widest_vectors)
def _lower_widest_vectors(context, builder, signature, arguments):
    # llvmlite's own `add` takes only attributes that it knows.
    set.add(builder.function.attributes, '"prefer-vector-width"="512"')
    return context.get_dummy_value()


@lower_builtin(distinct_arrays)
def _lower_distinct_arrays(context, builder, signature, arguments):
    for argument in builder.function.args:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute("noalias")
    return context.get_dummy_value()


for _function in (widest_vectors, distinct_arrays):
    type_callable(_function)(lambda context: lambda: types.void)


def _call_unit(typingctx, code, work, control, out, row, a, b):
    """Call a lane function with `work`, `control`, `out` from a row on, and the numbers `a` and `b`."""

    def generate(context, builder, signature, values):
        arrays = zip(signature.args[1:4], values[1:4], strict=True)
        pointers = [context.make_array(kind)(context, builder, value).data for kind, value in arrays]
        row_size = ir.Constant(values[4].type, LANES)
        pointers[2] = builder.gep(pointers[2], [builder.mul(values[4], row_size)])
        arguments = [*pointers, *values[5:]]
        kind = ir.FunctionType(ir.VoidType(), [each.type for each in arguments])
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), arguments)
        return context.get_dummy_value()

    return types.void(types.int64, work, control, out, types.int64, types.float64, types.float64), generate


def _interpret_unit(code, work, control, out, row, a, b):
    """Call a lane function of NumPy with `out` from a row on."""
    code(work, control, out.reshape(-1)[row * LANES :], a, b)


unit: Callable[..., Any] = _interpret_unit if INTERPRETED else intrinsic(_call_unit)


def unit_address(function: Callable, *names: str) -> Any:
    """What :func:`unit` calls: where the code of a lane function is, compiled or loaded.

    `names` are all that the function depends on besides the modules of this folder.
    """
    if INTERPRETED:
        return lanes.interpreted(function)
    key = _key("lanes", *names)
    code = compiled_files.load(key)
    if code is None:
        code = _machine().emit_object(_module(function, _width()))
        compiled_files.save(key, code)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _engines.append(engine)  # which owns the code
    return engine.get_function_address("unit")


_engines: list[llvm.ExecutionEngine] = []


def unit_assembly(function: Callable) -> str:
    """The instructions of a lane function, as text."""
    return _machine().emit_assembly(_module(function, _width()))


def _machine() -> llvm.TargetMachine:
    triple, name, features = processor()
    return llvm.Target.from_triple(triple).create_target_machine(cpu=name, features=features, opt=2, jit=True)


def _module(function: Callable, width: int) -> llvm.ModuleRef:
    """A lane function as an optimised module; what makes vectors of loops has nothing to do in it."""
    text = lanes.written(function, "unit", width, typed_pointers=llvm.llvm_version_info[0] < 16)
    machine, module = _machine(), llvm.parse_assembly(text)
    module.triple, module.data_layout = processor()[0], str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.slp_vectorization = options.loop_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    return module


@functools.cache
def _width() -> int:
    """How many numbers the processor takes at once, by the registers of an addition of eight."""

    def addition(given):
        given.out[0] = given.work[0] + given.work[1]

    assembly = _machine().emit_assembly(_module(addition, LANES))
    return 8 if "%zmm" in assembly else 4 if "%ymm" in assembly else 2

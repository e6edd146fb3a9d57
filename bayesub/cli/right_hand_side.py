"""The equations of motion as they stand in the kernels, for something else than numba to follow.

What follows a computation by doing it with symbols of its own, as JAX does, takes sums, products and calls as they are,
but cannot tell which branch of ``a if test else b`` is wanted. Here every such choice becomes a call, and so do ``and``
and ``or``. Nothing else is changed: terms and equations stand in the kernels alone, whoever computes them.
"""

import ast
import inspect
import textwrap
from collections.abc import Callable
from types import FunctionType


class _Calls(ast.NodeTransformer):
    """Choices and conjunctions as calls of `choose`; functions without what decorates them."""

    def visit_IfExp(self, node):
        self.generic_visit(node)
        return _choose(node.test, node.body, node.orelse)

    def visit_BoolOp(self, node):
        self.generic_visit(node)
        test, *others = node.values
        for other in others:
            both = isinstance(node.op, ast.And)
            test = _choose(test, other, ast.Constant(False)) if both else _choose(test, ast.Constant(True), other)
        return test

    def visit_FunctionDef(self, node):
        self.generic_visit(node)
        node.decorator_list = []
        return node


def _choose(*arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name("choose", ast.Load()), [*arguments], [])


def followed(kernel: Callable, **replaced: Callable) -> Callable:
    """A kernel and all that it calls as Python functions, with some names `replaced`.

    Among these is ``choose(test, a, b)``, which is called for every ``a if test else b``; a and b may be tuples.
    """
    function = getattr(kernel, "py_func", kernel)
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name not in replaced and isinstance(getattr(names.get(name), "py_func", names.get(name)), FunctionType):
            names[name] = followed(names[name], **replaced)
    tree = _Calls().visit(ast.parse(textwrap.dedent(inspect.getsource(function))))
    exec(compile(ast.fix_missing_locations(tree), inspect.getfile(function), "exec"), names | replaced, defined := {})
    return defined[tree.body[0].name]

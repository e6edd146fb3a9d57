"""The public names: listed once, each resolves when asked for, and each is used in the file that the types check."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import bayesub as bs

ROOT = Path(bs.__file__).parent
STUB = ast.parse((ROOT / "__init__.pyi").read_text(encoding="utf-8"))
PAGES = [*(ROOT / "manual").glob("*.md"), ROOT.parent / "README.md"]
TYPED = Path(__file__).parent / "typing" / "public_face.py"


def listed() -> list[str]:
    """``__all__`` of the stub."""
    (names,) = [
        ast.literal_eval(node.value)
        for node in STUB.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__"
    ]
    return names


def test_every_name_of_the_stub_is_public_and_sorted():
    imported = [name.name for node in STUB.body if isinstance(node, ast.ImportFrom) for name in node.names]
    assert sorted(imported) == sorted(listed())
    assert listed() == sorted(listed())
    assert sorted(bs.__all__) == listed()


@pytest.mark.parametrize("name", listed())
def test_every_public_name_resolves_and_explains_itself(name):
    assert getattr(bs, name).__doc__


@pytest.mark.parametrize("name", listed())
def test_every_public_name_is_in_the_manual_and_among_the_types(name):
    used = re.compile(rf"\bbs\.{name}\b")
    assert used.search(TYPED.read_text(encoding="utf-8"))
    assert any(used.search(page.read_text(encoding="utf-8")) for page in PAGES)


def test_what_the_pages_use_is_public():
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    names = {name for text in texts for name in re.findall(r"\bbs\.([A-Za-z_]\w*)", text)}
    assert names <= {*listed(), "__version__"}


def test_import_is_lazy():
    """Importing the package imports none of its modules."""
    program = "import sys, bayesub; print([m for m in sys.modules if m.startswith('bayesub.')])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def functions(name: str, thing) -> list:
    """The public functions and methods of a public name, with their names."""
    if isinstance(thing, ModuleType):
        inside = [key for key, value in vars(thing).items() if getattr(value, "__module__", "") == thing.__name__]
        names = [key for key in getattr(thing, "__all__", inside) if not key.startswith("_")]
        return [pair for key in names for pair in functions(f"{name}.{key}", getattr(thing, key))]
    if inspect.isclass(thing):
        methods = {key: value for key, value in vars(thing).items() if key == "__init__" or not key.startswith("_")}
        inner = {key: getattr(value, "fget", getattr(value, "__func__", value)) for key, value in methods.items()}
        return [
            (f"{name}.{key}", f)
            for key, f in inner.items()
            if inspect.isfunction(f) and f.__module__.startswith("bayesub")
        ]
    return [(name, thing)] if inspect.isfunction(thing) else []


@pytest.mark.parametrize("name", listed())
def test_what_is_public_says_the_types_of_all_that_it_takes_and_gives(name):
    """Methods that a base class outside brings along need not."""
    for key, function in functions(name, getattr(bs, name)):
        signature = inspect.signature(function)
        taken = [
            p for p in signature.parameters.values() if p.name not in ("self", "cls") and not p.name.startswith("_")
        ]
        assert [p.name for p in taken if p.annotation is p.empty] == [], key
        assert key.endswith("__init__") or signature.return_annotation is not signature.empty, key

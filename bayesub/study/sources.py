"""What computes: digests of the sources and the built-in data from which the numbers of a run come.

What counts is the import closure of roots (modules of bayesub, or a script): what they import, directly or through
others, at the top of a file or within a function. A lazy name counts as what it stands for, and a module that imports
by names which only a run knows counts with all of its folder. Of a file counts its syntax: comments, docstrings, layout
and what is for type checkers do not, texts that code uses do.

Rooms that only write (:data:`WRITERS`: pages, figures, words, progress, commands) do not count themselves, but what
they import does, so that no number is missed that is made for a page. Templates, scripts and styles of pages count for
nothing. Of the built-in data count those that a study names, of a script all.
"""

import ast
import functools
import hashlib
import json
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayesub.io import toml_files
from bayesub.kernels import compiled_files

PACKAGE = "bayesub"
EVERYTHING = f"{PACKAGE}.*"
WRITERS = (
    *(f"{PACKAGE}.{room}." for room in ("__main__", "cli", "report", "study.before", "study.new")),
    *(f"{PACKAGE}.io.{room}." for room in ("notebook", "templates", "terminal", "words")),
    *(f"{PACKAGE}.study.{room}." for room in ("provenance", "sources", "run.runs", "run.script_page")),
)
_ROOT = Path(__file__).parents[1]
_DIGITS = 12  # of the digest of a room


def digest(rooms: dict[str, str]) -> str:
    """The SHA-256 of several rooms."""
    return hashlib.sha256(json.dumps(rooms, sort_keys=True).encode()).hexdigest()


def rooms(roots: Iterable[str], texts: Iterable[str] | None = None) -> dict[str, str]:
    """Room of the package, or kind of built-in data -> digest of what counts of it.

    `roots`: dotted names that are imported, of bayesub or of others, which do not count; ``bayesub.*`` are all modules;
    `texts`: in which the built-in data that count are named; left out, all count.
    """
    found: dict[str, list[str]] = {}
    package = _package()
    for module in sorted(package.closure(roots)):
        if not f"{module}.".startswith(WRITERS):
            room = module.split(".")[1] if "." in module else PACKAGE
            found.setdefault(room, []).append(f"{module} {package.digests[module]}")
    for name, (_, one) in _named(texts).items():
        found.setdefault(f"data/{name.split('/')[0]}", []).append(f"{name} {one}")
    return {room: hashlib.sha256("\n".join(parts).encode()).hexdigest()[:_DIGITS] for room, parts in found.items()}


def file_digest(path: Path) -> str:
    """The SHA-256 of a file; InputError if it cannot be read."""
    with toml_files.reading(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def of_script(script: Path) -> tuple[str, dict[str, str], set[str]]:
    """The digest of a script, those of what lies beside it by name (:func:`beside`), and the names that they import."""
    found: dict[str, str] = {}
    names: set[str] = set()
    for name, file in {"": script, **beside(script)}.items():
        if file.suffix == ".py":
            found[name], others = _of_file(file, script.parent)
            names |= others
        else:
            found[name] = file_digest(file)
    return found.pop(""), found, names


def beside(script: Path) -> dict[str, Path]:
    """Name from the folder of the script -> file, of all modules that it imports directly or through others.

    Of a package, and of the folder with the name of the script that is not its run, all data count; of modules those
    that are imported. Files are read, not run.
    """
    root, found, waiting = script.parent, set(), [script]
    while waiting:
        for other in _files_beside(_of_file(waiting.pop(), root)[1], root):
            if other not in found:
                found.add(other)
                waiting.append(other)
    folders = {module.parent for module in found} - {root}
    if not (script.with_suffix("") / "config.toml").exists():
        folders.add(script.with_suffix(""))
    data = (file for folder in folders for file in folder.rglob("*") if file.is_file())
    found |= {file for file in data if file.suffix != ".py" and "__pycache__" not in file.parts}
    return {file.relative_to(root).as_posix(): file for file in sorted(found)}


def _files_beside(names: Iterable[str], root: Path) -> Iterator[Path]:
    """The modules below `root` that dotted names name, with the packages in which they are."""
    tops = {name.partition(".")[0] for name in names} - {PACKAGE, ""}
    present = {top for top in tops if (root / top).is_dir() or (root / f"{top}.py").is_file()}
    for name in names:
        parts = name.split(".")
        for k in range(1, len(parts) + 1) if parts[0] in present else ():
            place = root.joinpath(*parts[:k])  # a package comes before a module of its name, as in an import
            files = [place / "__init__.py", place.with_name(f"{place.name}.py")]
            yield from place.parent.glob("*.py") if parts[k - 1] == "*" else [f for f in files if f.is_file()][:1]


def _of_file(file: Path, root: Path) -> tuple[str, frozenset[str]]:
    """The digest of a file below a folder from which modules are imported, and the names that it imports."""
    with toml_files.reading(file):
        return _read(file.read_bytes(), ".".join(file.parent.relative_to(root).parts))


@functools.lru_cache(maxsize=1000)
def _read(content: bytes, package: str) -> tuple[str, frozenset[str]]:
    """The digest of the syntax of a module in a package, and the dotted names that it imports or takes from imports."""
    try:
        syntax = _Syntax(ast.parse(content), package)
    except (SyntaxError, ValueError):  # of which the import will complain
        return hashlib.sha256(content).hexdigest(), frozenset()
    return hashlib.sha256("\n".join(syntax.words).encode("utf-8", "surrogatepass")).hexdigest(), syntax.names()


class _Syntax:
    """The syntax of a module as words, with its imports."""

    def __init__(self, tree: ast.Module, package: str):
        self.package = package.split(".") if package else []
        self.words: list[str] = []
        self.imported: set[str] = set()
        self.aliases: dict[str, str] = {}  # name in the module -> what it stands for
        self.chains: set[str] = set()  # such as np.linalg.norm, and names that stand alone
        self._add(tree)

    def names(self) -> frozenset[str]:
        """Dotted names that are imported or that are looked up in what is; with ``.*`` those of which all may be."""
        found = set(self.imported)
        for chain in self.chains:
            first, _, rest = chain.partition(".")
            if first in self.aliases:
                found.add(f"{self.aliases[first]}.{rest or '*'}")
            if chain.endswith("import_module") and self.package:
                found.add(f"{'.'.join(self.package)}.*")
        return frozenset(found)

    def _add(self, part: Any) -> None:
        if isinstance(part, list):
            for one in part:
                self._add(one)
            self.words.append("]")
        elif not isinstance(part, ast.AST):
            self.words.append(repr(part))
        elif isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant):
            pass  # docstrings
        elif isinstance(part, ast.If) and _chain(part.test).endswith("TYPE_CHECKING"):
            self._add(part.orelse)
        elif isinstance(part, ast.Attribute | ast.Name) and (chain := _chain(part)):
            self.chains.add(chain)
            self.words.append(f".{chain}")
        else:
            if isinstance(part, ast.Import | ast.ImportFrom):
                self._import(part)
            self.words.append(type(part).__name__)
            for field in part._fields:
                if (value := getattr(part, field)) not in (None, []) or isinstance(part, ast.Constant):
                    self.words.append(field)
                    self._add(value)

    def _import(self, node: ast.Import | ast.ImportFrom) -> None:
        base = ""
        if isinstance(node, ast.ImportFrom):
            above = self.package[: len(self.package) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
        for alias in node.names:
            whole = f"{base}.{alias.name}".lstrip(".")
            self.imported.add(whole)
            is_top = not base and alias.asname is None
            self.aliases[alias.asname or alias.name.partition(".")[0]] = whole.partition(".")[0] if is_top else whole


def _chain(node: ast.AST) -> str:
    """``a.b.c`` of names looked up in a name; empty for what begins otherwise."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(names)]) if isinstance(node, ast.Name) else ""


@dataclass(frozen=True)
class _Package:
    """The modules of bayesub."""

    digests: dict[str, str]
    imports: dict[str, list[str]]  # module -> modules of the package that it imports
    lazy: dict[str, str]  # name of the public face -> what it stands for

    def closure(self, names: Iterable[str]) -> set[str]:
        """The modules that names need."""
        found = set[str]()
        waiting = self.resolved(names)
        while waiting:
            found |= waiting
            waiting = {other for module in waiting for other in self.imports[module]} - found
        return found

    def resolved(self, names: Iterable[str]) -> set[str]:
        """The modules that are imported for dotted names."""
        return {module for name in names for module in self._of_name(name)}

    def _of_name(self, name: str) -> set[str]:
        parts = name.split(".")
        if parts[0] == PACKAGE and ".".join(parts[:2]) not in self.digests and parts[1] in self.lazy:
            parts = [*self.lazy[parts[1]].split("."), *parts[2:]]
        found = {".".join(parts[:k]) for k in range(1, len(parts) + 1)} & self.digests.keys()
        if parts[-1] == "*":
            found |= {module for module in self.digests if module.startswith(f"{'.'.join(parts[:-1])}.")}
        return found


@functools.cache
def _package() -> _Package:
    """The modules of bayesub, read or from the cache folder of the user, where they are kept."""
    contents = {path.relative_to(_ROOT.parent): path.read_bytes() for path in sorted(_ROOT.rglob("*.py"))}
    stub = (_ROOT / "__init__.pyi").read_bytes()
    parts = (part for path, content in contents.items() for part in (path.as_posix(), content))
    key = compiled_files.digest("what computes", sys.version, stub, *parts)
    if (kept := compiled_files.load(key)) is not None:
        return _Package(*json.loads(kept))
    digests, named = {}, {}
    for path, content in contents.items():
        package = ".".join(path.parts[:-1])
        module = package if path.name == "__init__.py" else f"{package}.{path.stem}"
        digests[module], names = _read(content, package)
        named[module] = [name for name in names if name.startswith(PACKAGE)]
    lazy = _Syntax(ast.parse(stub), PACKAGE).aliases
    resolved = _Package(digests, {}, lazy).resolved
    found = digests, {module: sorted(resolved(names)) for module, names in named.items()}, lazy
    compiled_files.save(key, json.dumps(found).encode())
    return _Package(*found)


@functools.cache
def _built_in() -> dict[str, tuple[str, str]]:
    """Kind and name of all built-in data, ``vehicles/suboff`` -> text (of logs none) and digest."""
    found: dict[str, tuple[str, str]] = {}
    for path in sorted((_ROOT / "data").rglob("*")):
        content, text = path.read_bytes() if path.suffix in (".toml", ".gz") else b"", ""
        if path.suffix == ".toml":
            text = json.dumps(tomllib.loads(content.decode()), sort_keys=True, default=str)
            content = text.encode()
        if content:
            kind, *names = path.relative_to(_ROOT / "data").parts
            texts, before = found.get(name := f"{kind}/{Path(names[0]).stem}", ("", ""))
            found[name] = texts + text, hashlib.sha256(before.encode() + content).hexdigest()
    return found


def _named(texts: Iterable[str] | None) -> dict[str, tuple[str, str]]:
    """Those of the built-in data whose names are words of texts, or of those that are; all without texts."""
    if texts is None:
        return _built_in()
    found: dict[str, tuple[str, str]] = {}
    waiting = list(texts)
    while waiting:
        words = set(re.findall(r"\w+", waiting.pop()))
        for name, one in _built_in().items():
            if name not in found and name.partition("/")[2] in words:
                found[name] = one
                waiting.append(one[0])
    return found

"""How large the house is: .ci/structure.py [--by-room] [ROOM ..] prints a row a measure of the package of this tree.

Lines and files are those of `bayesub/` under version control without `__init__`, arrows are imports from one room (a
folder of the package) to another. With rooms named, the rows are of these and without the measures of the whole.
With --limits it measures the whole but for what a run loads, and fails above a limit of LIMITS.
"""

import ast
import collections
import itertools
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
LIMITS = {
    "lines": 45_000,
    "files": 260,
    "rooms": 13,
    "arrows between rooms": 50,
    "arrows back": 0,
    "methods of the largest classes": 20,
    "functions with more than 10 parameters outside of kernels": 0,
    "public functions without types outside of kernels": 0,
}
PARAMETERS = 10  # the most of a function outside of kernels
SHORT = 75  # lines of a file that might stand in its only importer


def room(module: str) -> str:
    """The folder of a module: the second name; none of the package itself and its entry."""
    names = module.split(".")
    return names[1].replace("__main__", "") if len(names) > 1 else ""


def graph_rows(graph: grimp.ImportGraph) -> list[tuple[str, object]]:
    """Rooms, arrows between them, and those that run both ways."""
    arrows = {(room(a), room(b)) for a in graph.modules for b in graph.find_modules_directly_imported_by(a)}
    arrows = {(a, b) for a, b in arrows if a != b and a and b}
    circles = sorted({tuple(sorted(pair)) for pair in arrows if pair[::-1] in arrows})
    rooms = {r for arrow in arrows for r in arrow}
    return [("rooms", len(rooms)), ("arrows between rooms", len(arrows)), ("arrows back", len(circles))]


def files() -> list[Path]:
    """The hand-written modules."""
    listed = subprocess.run(["git", "ls-files", "bayesub/*.py"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [Path(f) for f in listed.stdout.split() if Path(f).name != "__init__.py" and (ROOT / f).exists()]


def typed(function: ast.FunctionDef) -> bool:
    """Whether all parameters but self have a type, and the function one of what it gives."""
    given = function.args
    parameters = [a for a in (*given.posonlyargs, *given.args, *given.kwonlyargs) if a.arg not in ("self", "cls")]
    return all(a.annotation for a in parameters) and (function.returns is not None or function.name.startswith("__"))


def source_rows(paths: list[Path]) -> list[tuple[str, object]]:
    """Measures of the syntax trees of modules."""
    trees = {p: ast.parse((ROOT / p).read_text()) for p in paths}
    used = collections.Counter()
    classes, wide, private, untyped = [], [], [], []
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Name):
                used[node.id] += 1
            elif isinstance(node, ast.Attribute):
                used[node.attr] += 1
            elif isinstance(node, ast.ClassDef):
                classes.append((sum(isinstance(n, ast.FunctionDef) for n in node.body), f"{path}:{node.name}"))
            elif isinstance(node, ast.FunctionDef):
                given = node.args
                names = [a.arg for a in given.posonlyargs + given.args + given.kwonlyargs]
                count = len([name for name in names if name not in ("self", "cls")])
                if count > PARAMETERS and path.parts[1] != "kernels":
                    wide.append(f"{path}:{node.name} {count}")
                if node.name.startswith("_") and not node.name.startswith("__"):
                    private.append((path, node.name))
        outer = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
        inner = [n for c in tree.body if isinstance(c, ast.ClassDef) for n in c.body if isinstance(n, ast.FunctionDef)]
        public = [n for n in outer + inner if not n.name.startswith("_")]
        untyped += [f"{path}:{n.name}" for n in public if path.parts[1] != "kernels" and not typed(n)]
    once = [(p, name) for p, name in private if used[name] == 1]
    return [
        ("lines", sum(len((ROOT / p).read_text().splitlines()) for p in paths)),
        ("files", len(paths)),
        ("methods of the largest classes", "; ".join(f"{n} {c}" for n, c in sorted(classes)[::-1][:4])),
        (f"functions with more than {PARAMETERS} parameters outside of kernels", "; ".join([f"{len(wide)}", *wide])),
        ("private functions called once, of all", f"{len(once)} of {len(private)}"),
        ("public functions without types outside of kernels", "; ".join([f"{len(untyped)}", *untyped])),
    ]


def short_row(graph: grimp.ImportGraph, paths: list[Path]) -> tuple[str, object]:
    """Short modules that one other module imports."""
    short = []
    for path in paths:
        lines = len((ROOT / path).read_text().splitlines())
        module = ".".join(path.with_suffix("").parts)
        if lines < SHORT and module in graph.modules:
            users = graph.find_modules_that_directly_import(module)
            if len(users) == 1:
                short.append(f"{path} {lines} ({', '.join(users)})")
    return f"files under {SHORT} lines with one importer", "; ".join([f"{len(short)}", *sorted(short)])


def loaded_row() -> tuple[str, object]:
    """What a run of the quickstart has loaded of the package, without packages' own files."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-X", "importtime", "-m", "bayesub", "run", "studies/quickstart.toml", "--quick"]
        ended = subprocess.run([*command, "-o", f"{folder}/run"], cwd=ROOT, capture_output=True, text=True, check=True)
    names = {line.rsplit("|", 1)[-1].strip() for line in ended.stderr.splitlines() if line.startswith("import time")}
    modules = {n for n in names if n.split(".")[0] == "bayesub" and not (ROOT / n.replace(".", "/")).is_dir()}
    return "modules that a run loads", len(modules)


def by_room(paths: list[Path]) -> list[tuple[str, object]]:
    """Lines and files of each room."""
    groups = itertools.groupby(sorted(paths), key=lambda p: p.parts[1])
    rows = []
    for name, group in groups:
        some = list(group)
        rows.append((name, f"{sum(len((ROOT / p).read_text().splitlines()) for p in some)} in {len(some)}"))
    return rows


def main(*options: str) -> None:
    """Print the rows; of some rooms only, if they are named."""
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    chosen = [o for o in options if not o.startswith("-")]
    graph = grimp.build_graph("bayesub")
    paths = [p for p in files() if not chosen or any(str(p).startswith(f"bayesub/{c}") for c in chosen)]
    rows = [*source_rows(paths), short_row(graph, paths)]
    if not chosen:
        rows += graph_rows(graph)
    if not chosen and "--limits" not in options:
        rows.append(loaded_row())
    if "--by-room" in options:
        rows += by_room(paths)
    for name, value in rows:
        print(f"{name}: {value}")
    above = [name for name, value in rows if name in LIMITS and int(re.match(r"\d+", str(value))[0]) > LIMITS[name]]
    if above and "--limits" in options:
        sys.exit(f"over a limit of .ci/structure.py: {', '.join(above)}")


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Dependencies point one way, and heavy libraries stay where they belong."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import pathwalker_cli

PACKAGE = Path(pathwalker_cli.__file__).parent
ROOT = "pathwalker_cli"

LAYERS = (
    {"errors", "paths", "installed"},
    {"nlp"},
    {"ocp"},
    {"versions", "model.choices", "model.skeleton"},
    {"model.contact", "model.numbers"},
    {"conventions"},
    {"trajectory"},
    {"io"},
    {"patient.blocks", "patient.proportions"},
    {"patient"},
    {"io.recordings"},
    {"model"},
    {"problems", "patient.variation", "gait.choices", "gait.costs"},
    {"config"},
    {"case"},
    {"stride"},
    {"gait", "inverse", "ocp.solve"},
    {"extensions"},
    {"results"},
    {"evaluation"},
    {"studies"},
    {
        "reproduce",
        "report",
        "animation",
        "explore",
        "export",
        "starter",
        "checking",
        "verification",
    },
    {"commands"},
    {"cli"},
)
"""Later ones may import earlier ones. `io.recordings` knows patients, who know `io`."""

APART = ({"gait", "inverse"},)
"""Members of one layer that must not know each other."""

CONFINED = {
    "casadi": ("model", "nlp", "ocp", "stride", "gait", "commands.doctor"),
    "pinocchio": (
        "model",
        "gait",
        "inverse",
        "stride",
        "animation.viewer",
        "starter.example",
    ),
    "jinja2": ("io.templates", "animation.html", "report.page", "starter"),
    "matplotlib": (
        "animation.film",
        "stride.figures",
        "inverse.figures",
        "evaluation.curves",
        "evaluation.figures",
        "evaluation.laboratory",
        "report.figures",
        "report.pdf",
        "reproduce.figures",
        "studies.landscape.figures",
        "studies.sensitivity.figures",
        "studies.perturbation.figures",
        "studies.tradeoff.figures",
        "studies.uncertainty.figures",
    ),
    "fpdf": ("report.pdf",),
    "click": ("cli", "commands"),
    "rich": ("commands", "inverse", "results", "stride"),
    "dask": ("studies.batch.cluster",),
    "dask_jobqueue": ("studies.batch.cluster",),
    "distributed": ("studies.batch.cluster",),
    "ezc3d": ("io",),
    "tornado": ("explore.server",),
    "pebble": ("io.processes", "studies.batch.worker"),
    "yaml": ("io",),
}
"""Libraries and the parts of the package that may import them."""


@cache
def modules() -> dict[str, Path]:
    """Return every module by its name below the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(part for part in parts if part != "__init__")
        if name:
            found[name] = path
    return found


@cache
def imports(name: str) -> frozenset[str]:
    """Return the full names of all that a module imports, inside functions too."""
    tree = ast.parse(modules()[name].read_text(encoding="utf-8"))
    return frozenset(_imported(tree))


def _imported(node: ast.AST) -> Iterator[str]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "imports are absolute"
            yield from (f"{child.module}.{alias.name}" for alias in child.names)
        yield from _imported(child)


def own_imports(name: str) -> set[str]:
    """Return the modules of the package that a module imports."""
    known, found = modules(), set()
    for full in imports(name):
        part = full.removeprefix(f"{ROOT}.")
        while part != full and part and part not in known:
            part = part.rpartition(".")[0]
        if part and part != full:
            found.add(part)
    return found - {name}


def covers(part: str, module: str) -> bool:
    """Return whether a module is this part of the package or in it."""
    return module == part or module.startswith(f"{part}.")


def home(module: str) -> tuple[int, str]:
    """Return layer and part of a module; the longest name counts."""
    found = [(len(part), i, part) for i, layer in enumerate(LAYERS) for part in layer
             if covers(part, module)]  # fmt: skip
    assert found, f"{module} belongs to no layer: add it to LAYERS"
    _, layer, part = max(found)
    return layer, part


def test_the_package_is_found() -> None:
    assert {"cli", "config", "gait.solve", "commands.solve"} <= modules().keys()
    assert "studies.run" in own_imports("commands.solve"), "imports inside functions count"


@pytest.mark.parametrize("name", modules())
def test_no_module_imports_from_a_later_layer(name: str) -> None:
    layer, part = home(name)
    for other in own_imports(name):
        theirs, their_part = home(other)
        assert theirs <= layer, f"{name} imports {other}, which is further out"
        for group in APART:
            together = {part, their_part} <= group and part != their_part
            assert not together, f"{name} imports {other}"


def test_no_module_imports_itself_in_a_circle() -> None:
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, " -> ".join([*path[path.index(name) :], name])
        if name not in done:
            for other in sorted(own_imports(name)):
                if not covers(other, name):  # a package that re-exports from inside it
                    visit(other, (*path, name))
            done.add(name)

    for name in modules():
        visit(name, ())


@pytest.mark.parametrize("name", modules())
def test_heavy_libraries_stay_in_their_parts(name: str) -> None:
    for full in imports(name):
        library = full.partition(".")[0]
        allowed = CONFINED.get(library)
        if allowed is not None:
            assert any(covers(part, name) for part in allowed), f"{name} imports {library}"


def test_every_entry_names_something_that_exists() -> None:
    parts = {part for layer in LAYERS for part in layer}
    parts |= {part for allowed in CONFINED.values() for part in allowed}
    assert sum(map(len, LAYERS)) == len(set().union(*LAYERS)), "a part stands in two layers"
    for part in parts:
        assert any(covers(part, name) for name in modules()), part


WALKING = re.compile(
    r"\b(gait|stride|patient|muscle|orthos|stiffness|knee|hip_|ankle|toe|heel|pinocchio)",
    re.IGNORECASE,
)


@pytest.mark.parametrize("name", [name for name in modules() if re.match(r"nlp|ocp", name)])
def test_the_numerical_layer_speaks_of_no_walking(name: str) -> None:
    if name == "ocp.solve":  # the name by which scripts import `solve_study`
        return
    for number, line in enumerate(modules()[name].read_text(encoding="utf-8").splitlines(), 1):
        assert not WALKING.search(line.replace("PathWalker", "")), f"{name}, line {number}: {line}"

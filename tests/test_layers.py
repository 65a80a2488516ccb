"""The library is cut into rooms, and imports point one way; public names are few and listed in order."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import fivebar_pin

ROOT = Path(fivebar_pin.__file__).parent
# A room may use the rooms before it; those in one tuple do not use each other.
ORDER = (
    ("errors",),
    ("_arrays",),
    ("_files",),
    ("closures", "motion", "springs"),
    ("chain",),
    ("trajectory",),
    ("engine",),
    ("mechanism",),
    ("kinematics", "dynamics"),
    ("control", "simulation", "diagnosis", "balancing", "io", "paper", "sweeps"),
    ("shipped", "planar"),
    ("viz",),
    ("cli",),
    ("__main__",),
)
MOST_FLOORS = 10
PAPER_USES = {"errors", "_arrays", "chain", "closures", "motion", "trajectory", "paper"}
HEAVY = ("scipy.optimize", "scipy.interpolate", "matplotlib", "meshcat", "cvxpy", "clarabel", "yaml", "rich", "typer")
MOST_NAMES = 40
MOST_AT_THE_TOP = 5


def name_of(path: Path) -> str:
    """Return the module's dotted name inside the library, "" for the library itself."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(ROOT.rglob("*.py")) if "urdf" not in path.parts}


def resolve(dotted: str) -> str | None:
    """Return the longest known module that a dotted name inside the library starts with."""
    parts = dotted.split(".")
    while parts and ".".join(parts) not in MODULES:
        parts.pop()
    return ".".join(parts) or None


def statements(node: ast.AST, *, at_load: bool):
    """Yield the statements of a module; with `at_load` only those that run when it is imported."""
    for child in ast.iter_child_nodes(node):
        yield child
        late = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        late |= isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
        if not (at_load and late):
            yield from statements(child, at_load=at_load)


@cache
def imports(module: str, *, at_load: bool = False) -> frozenset[str]:
    """Return the library's modules that a module imports, anywhere in its text or only when it is loaded."""
    found: set[str] = set()
    package = module if MODULES[module].name == "__init__.py" else module.rpartition(".")[0]
    for node in statements(ast.parse(MODULES[module].read_text()), at_load=at_load):
        if isinstance(node, ast.Import):
            names = [a.name.removeprefix("fivebar_pin.") for a in node.names if a.name.startswith("fivebar_pin.")]
        elif isinstance(node, ast.ImportFrom) and node.level:
            base = package.split(".")[: len(package.split(".")) - node.level + 1]
            names = [".".join([*base, *filter(None, [node.module]), a.name]) for a in node.names]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "fivebar_pin":
            base_name = (node.module or "").removeprefix("fivebar_pin").lstrip(".")
            names = [f"{base_name}.{a.name}".lstrip(".") for a in node.names]
        else:
            continue
        found |= {target for target in map(resolve, names) if target}
    return frozenset(found - {module})


def room(module: str) -> str:
    """Return the room a module belongs to: its top-level name."""
    return module.split(".")[0]


@cache
def reach(module: str) -> frozenset[str]:
    """Return the rooms that a module imports from."""
    return frozenset(room(target) for target in imports(module) if target)


@cache
def floor(name: str) -> int:
    """Return how many rooms stand on each other up to this one, itself included."""
    below = {r for m in MODULES if m and room(m) == name for r in reach(m)} - {name}
    return 1 + max(map(floor, below), default=0)


def test_every_module_has_its_room_in_the_order():
    assert {room(m) for m in MODULES if m} == {r for layer in ORDER for r in layer}


def test_no_module_stands_at_the_top_for_want_of_a_room():
    top = [m for m in MODULES if "." not in m and MODULES[m].name != "__init__.py"]
    assert len(top) <= MOST_AT_THE_TOP, top


def test_loading_a_module_never_comes_back_to_it():
    done: set[str] = set()

    def visit(module: str, trail: tuple[str, ...]) -> None:
        assert module not in trail, " -> ".join((*trail, module))
        if module in done:
            return
        for target in sorted(imports(module, at_load=True)):
            if target:
                visit(target, (*trail, module))
        done.add(module)

    for module in MODULES:
        if module:
            visit(module, ())


def test_no_files_import_each_other_in_a_circle():
    """Imports inside functions and for types alone count too: each file can be read after those it uses."""
    done: set[str] = set()

    def visit(module: str, trail: tuple[str, ...]) -> None:
        assert module not in trail, " -> ".join((*trail[trail.index(module) :], module))
        if module not in done:
            for target in sorted(imports(module) - {""}):
                visit(target, (*trail, module))
            done.add(module)

    for module in MODULES:
        if module:
            visit(module, ())


@pytest.mark.parametrize("layer", range(len(ORDER)), ids=[layer[0] for layer in ORDER])
def test_rooms_import_only_what_comes_before_them(layer):
    before = {r for rooms in ORDER[:layer] for r in rooms}
    for module in MODULES:
        if room(module) in ORDER[layer]:
            allowed = before | {room(module)}
            assert reach(module) <= allowed, f"{module} uses {sorted(reach(module) - allowed)}"


def test_the_house_is_not_high():
    floors = {name: floor(name) for layer in ORDER for name in layer}
    assert max(floors.values()) <= MOST_FLOORS, floors


def test_the_paper_stands_on_chain_and_motion_alone():
    """Only its kernels, which are compiled, and the comparison with the general road may look further."""
    for module in MODULES:
        if room(module) == "paper" and module not in ("paper", "paper.compare"):
            allowed = PAPER_USES | ({"engine"} if module.startswith("paper.kernels") else set())
            assert reach(module) <= allowed, f"{module} uses {sorted(reach(module) - allowed)}"
    assert reach("paper.compare") <= PAPER_USES | {"kinematics"}


def test_the_test_of_directions_sees_imports_inside_functions():
    assert "mechanism.loops" in imports("kinematics.drive")
    assert "chain" in reach("kinematics.drive")
    assert "kinematics" not in reach("chain.closed_chain")


PACKAGES = ["", *(m.name for m in pkgutil.iter_modules([str(ROOT)]) if m.ispkg)]
PUBLIC = sorted(m for m in MODULES if not any(part.startswith("_") for part in m.split(".")) and room(m) != "cli")


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: p or "fivebar_pin")
def test_public_names_are_few(package):
    names = getattr(importlib.import_module(f"fivebar_pin.{package}".rstrip(".")), "__all__", None)
    assert names is not None
    assert 0 < len(names) <= MOST_NAMES


@pytest.mark.parametrize("module", PUBLIC, ids=lambda m: m or "fivebar_pin")
def test_public_names_are_listed_in_order_and_exist(module):
    loaded = importlib.import_module(f"fivebar_pin.{module}".rstrip("."))
    names = list(loaded.__all__)
    # Constants, then classes, then functions, each alphabetical: the order that the linter keeps.
    assert names == sorted(names, key=lambda n: (not (n.isupper() and len(n) > 1), not n[0].isupper(), n))
    for name in names:
        assert getattr(loaded, name, None) is not None, f"{module}.{name}"
        assert not name.startswith("_")


def test_importing_the_library_leaves_heavy_modules_alone():
    code = f"import sys, fivebar_pin; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == []


def test_asking_for_what_the_library_offers_leaves_heavy_modules_alone_too():
    """What a function needs, linear algebra, the compiler or the web, is loaded when it is called; pages serve."""
    heavy = (*HEAVY, "numba", "scipy.linalg", "scipy.sparse", "urllib.request")
    code = (
        "import sys, fivebar_pin as fb\n"
        "[getattr(fb, name) for name in fb.__all__ if name != 'viz']\n"
        f"print(*[m for m in {heavy!r} if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == []


def test_an_unknown_attribute_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'five'"):
        _ = fivebar_pin.five

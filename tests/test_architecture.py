"""The layers, read from the sources: who may import whom, and how long a file may be.

Every module under `labkit` is looked at, so one that is written tomorrow is held to the
same rules; a package that is new altogether has to be given its place in `ORDER` first.
"""

import ast
from functools import cache
from pathlib import Path

import labkit

ROOT = Path(labkit.__file__).parent
MAX_LINES = 400

# Lower layers first: a module may import from its own layer and from those before it. "" is
# labkit/__init__.py, what labkit exports to its users.
ORDER = (
    *("support", "support.errors", "support.arrays", "support.code_cache"),
    *("support.records", "support.compiled", "support.extras", "support.files"),
    *("support.interrupts", "support.progress", "se2", "scan", "filters", "deskew"),
    *("parameters", "alignment", "eigen", "line_alignment", "selection", "neighbors"),
    *("normals", "target", "schedule", "correspondences", "degeneracy", "covariance", "result"),
    *("icp", "odometry", "simulation", "evaluation", "logs", "", "support.warm", "plotting"),
    *("grading", "course", "course.assignment", "course.exercises", "course.authoring"),
    *("course.report", "course.ladder", "course.loops"),
    *("interactive", "cli", "__main__"),
)
DATA = {"support.errors", "support.arrays", "support.compiled", "se2", "scan"}
LEANING_ON_LITTLE = {
    "simulation": DATA,
    "evaluation": DATA | {"alignment"},
    "logs": DATA | {"support.files", "support.extras"},
    # It knows no ICP: a grader that imported what students write would grade it by itself.
    "grading": {"support.errors", "support.arrays", "support.extras", "support.files"}
    | {"support.progress"},
}


# Every source file by its dotted name below labkit; packages by the package's name.
FILES = {path.relative_to(ROOT).with_suffix(""): path for path in sorted(ROOT.rglob("*.py"))}
MODULES = {".".join(name.parts).removesuffix("__init__").rstrip("."): FILES[name] for name in FILES}


def layer(name):
    """The first part of a dotted name below labkit, or two in course and support, as in `ORDER`."""
    return ".".join(name.split(".")[: 2 if name.startswith(("course.", "support.")) else 1])


@cache
def parsed(name):
    return ast.parse(MODULES[name].read_text(encoding="utf-8"))


def imported(name):
    """The absolute names of all that a module imports, inside functions too."""
    for node in ast.walk(parsed(name)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"labkit.{name} imports relatively, in line {node.lineno}"
            if node.module == "labkit":  # labkit itself, or one of its modules
                yield from (f"labkit.{alias.name}" for alias in node.names)
            else:
                yield node.module


def imported_layers(name):
    """The other layers of labkit that a module imports; "" for what labkit itself exports."""
    below = (
        target.removeprefix("labkit").lstrip(".")
        for target in imported(name)
        if layer(target) == "labkit"
    )
    return {layer(target) if layer(target) in ORDER else "" for target in below} - {layer(name)}


def allowed(name):
    """The layers that a module may import."""
    own = layer(name)
    below = set(ORDER[: ORDER.index(own)])
    return LEANING_ON_LITTLE.get(own, below)


def offenders(packages, allowed_in=()):
    """The modules outside `allowed_in` that import one of `packages`."""
    return {
        name
        for name in MODULES
        if layer(name) not in allowed_in and packages & set(map(layer, imported(name)))
    }


def test_imports_point_one_way():
    assert {"icp", "scan", "target"} <= imported_layers("odometry.lesson")  # they are read
    upwards = {name: imported_layers(name) - allowed(name) for name in MODULES}
    assert not {name: layers for name, layers in upwards.items() if layers}


def test_who_draws_shows_widgets_and_prints():
    assert not [name for name in MODULES if "matplotlib.pyplot" in imported(name)]
    assert not offenders({"matplotlib"}, allowed_in={"plotting", "interactive", "cli"})
    assert not offenders({"ipywidgets", "anywidget"}, allowed_in={"interactive"})
    printing = {
        layer(name)
        for name in MODULES
        for node in ast.walk(parsed(name))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "print"
    }
    assert printing <= {"__main__", "cli"}  # the commands


def test_a_file_holds_one_idea():
    lines = {name: len(path.read_text("utf-8").splitlines()) for name, path in MODULES.items()}
    assert not {name: count for name, count in lines.items() if count > MAX_LINES}

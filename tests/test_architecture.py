"""The layers, read from the sources: who may import whom, and how long a file may be.

Every module under `labkit` is looked at, so one that is written tomorrow is held to the
same rules; a package that is new altogether has to be given its place in `LAYERS` first.
"""

import ast
import importlib
from functools import cache
from pathlib import Path

import labkit

ROOT = Path(labkit.__file__).parent
MAX_LINES = 400

# What a module or package may import from labkit, lower layers first. A package may import
# from itself; "" is labkit/__init__.py, what labkit exports to its users.
BASE = {"errors", "arrays", "compiled"}
DATA = BASE | {"se2", "scan"}
STAGES = {
    "filters": DATA,
    "parameters": BASE,
    "alignment": BASE,
    "line_alignment": BASE | {"alignment"},
    "neighbors": BASE,
    "normals": DATA | {"neighbors"},
    "target": DATA | {"neighbors", "normals"},
    "schedule": BASE | {"parameters"},
    "correspondences": DATA | {"neighbors", "parameters", "schedule", "target"},
    "degeneracy": DATA | {"correspondences", "line_alignment", "target"},
    "result": DATA | {"correspondences", "degeneracy", "line_alignment", "parameters", "target"},
}
MATCHING = DATA | STAGES.keys()
ESTIMATION = MATCHING | {"icp", "covariance", "odometry"}
MATHS = ESTIMATION | {"simulation", "evaluation", "logs", "files", "extras"}
BELOW_PLOTTING = MATHS | {""}
# What the student writes: a grader that imported it would grade it by itself.
GRADED = {"", "alignment", "correspondences", "line_alignment", "icp", "odometry"}
LAYERS = {
    "errors": set(),
    "arrays": {"errors"},
    "code_cache": set(),
    "compiled": {"code_cache"},
    "extras": {"errors"},
    "files": {"errors"},
    "se2": BASE,
    "scan": BASE | {"se2"},
    **STAGES,
    "icp": MATCHING,
    "covariance": MATCHING,
    "odometry": ESTIMATION,
    "simulation": DATA,
    "evaluation": DATA | {"alignment"},
    "logs": DATA | {"files", "extras"},
    "": MATHS,
    "warm": ESTIMATION | {""},
    "plotting": BELOW_PLOTTING,
    "course": set(),
    "course.grading": BELOW_PLOTTING - GRADED,
    "course.authoring": BELOW_PLOTTING | {"course.grading"},
    "course.exercises": BELOW_PLOTTING | {"course.grading"},
    "course.report": BELOW_PLOTTING,
    "interactive": BELOW_PLOTTING | {"plotting", "course.grading"},
    "cli": BELOW_PLOTTING | {"plotting", "warm", "course.grading", "course.report"},
    "__main__": set(),
}


def modules():
    """Every source file by its dotted name below labkit; packages by the package's name."""
    for path in sorted(ROOT.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        yield ".".join(part for part in parts if part != "__init__"), path


MODULES = dict(modules())


def layer(name):
    """The first part of a dotted name below labkit, or two in the course: as in `LAYERS`."""
    return ".".join(name.split(".")[: 2 if name.startswith("course.") else 1])


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
    return {layer(target) if layer(target) in LAYERS else "" for target in below} - {layer(name)}


def offenders(packages, allowed_in=()):
    """The modules outside `allowed_in` that import one of `packages`."""
    return {
        name
        for name in MODULES
        if layer(name) not in allowed_in and packages & set(map(layer, imported(name)))
    }


def test_the_reader_of_imports_sees_them_all():
    assert {"labkit.alignment", "labkit.schedule", "numpy", "math"} <= set(imported("icp"))
    assert {"icp", "degeneracy", "scan"} <= imported_layers("odometry.step")
    assert imported_layers("arrays") == {"errors"}
    assert offenders({"scipy"}) >= {"filters"}


def test_every_module_has_its_place():
    assert {layer(name) for name in MODULES} <= LAYERS.keys()


def test_the_layers_have_no_circle():
    """Each layer is allowed only what is listed before it, down to `errors`."""
    before = set()
    for name, allowed in LAYERS.items():
        assert allowed - {name} <= before
        before.add(name)


def test_imports_point_one_way():
    upwards = {name: imported_layers(name) - LAYERS[layer(name)] for name in MODULES}
    assert not {name: layers for name, layers in upwards.items() if layers}


def test_only_plotting_and_what_stands_on_it_import_matplotlib():
    assert not offenders({"matplotlib"}, allowed_in={"plotting", "interactive", "cli"})


def test_only_one_package_imports_widgets():
    assert not offenders({"ipywidgets", "anywidget"}, allowed_in={"interactive"})


def test_only_the_command_line_prints():
    calls = {
        (name, node.func.id)
        for name in MODULES
        for node in ast.walk(parsed(name))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    printing = {name for name, function in calls if function == "print"}
    assert {layer(name) for name in printing} <= {"cli"}


def test_a_file_holds_one_idea():
    lines = {name: len(path.read_text("utf-8").splitlines()) for name, path in MODULES.items()}
    assert not {name: count for name, count in lines.items() if count > MAX_LINES}


def test_every_module_says_what_it_is():
    assert not [name for name in MODULES if not ast.get_docstring(parsed(name))]


def exports(name):
    """Whether a module has an `__all__`; read, not run."""
    return any(
        isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        for node in parsed(name).body
    )


def test_every_public_name_is_there_once_and_documented():
    for name in filter(exports, MODULES):
        module = importlib.import_module(f"labkit.{name}" if name else "labkit")
        assert len(set(module.__all__)) == len(module.__all__)
        undocumented = [public for public in module.__all__ if not getattr(module, public).__doc__]
        assert not undocumented, name

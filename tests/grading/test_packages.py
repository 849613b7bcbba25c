"""Packages in the box: what is installed works behind each wall, what is not is named.

Law 4: an honest style costs nothing, and the same hand-in has the same mark behind each wall.
"""

import pytest

from labkit.course.assignment import load_assignment
from tests.grading.notebooks import RIGHT, answered

ASSIGNMENT = load_assignment()


def with_line(name, line, above):
    """A right answer with one more line in it, and lines above it."""
    head, body = RIGHT[name].split("\n", 1)
    return f"{above}\n\n\n{head}\n    {line}\n{body}"


DRAWING = """import matplotlib.pyplot as plt


def fitness(kept):
    fig, (left, right) = plt.subplots(1, 2)
    line, = left.plot([1.0, 2.0])
    r, g, b = plt.get_cmap("viridis")(0.5)[:3]
    plt.show()
    return kept.mean()
"""
DERIVED = {  # above an answer: classes that derive from those of other packages
    "a box of widgets": "import ipywidgets\nclass Panel(ipywidgets.VBox):\n    pass",
    "traits": "import traitlets\nclass Panel(traitlets.HasTraits):\n    x = traitlets.Float(1.0)",
    "labkit's parameters": "import labkit\nclass Mine(labkit.IcpParameters):\n    pass",
    "a dataclass of labkit's": "import labkit\nfrom dataclasses import dataclass\n@dataclass\n"
    "class Mine(labkit.Scan):\n    x: int = 0",
}
SCREEN = "import matplotlib\nmatplotlib.use('TkAgg')\n"
PYLAB = "%pylab inline\ndef rotation(theta):\n    c, s = cos(theta), sin(theta)\n"
PACKAGES = {
    **{name: ("ipywidgets", answered({"icp": f"{above}\n\n\n" + RIGHT["icp"]}))
       for name, above in DERIVED.items()},
    "a bar of a notebook": ("tqdm", answered({"icp": with_line(
        "icp", "list(tqdm(range(3)))", "from tqdm.notebook import tqdm")})),
    "axes and colours": ("matplotlib", answered({"fitness": DRAWING})),
    "a backend with a screen": ("matplotlib", answered({"fitness": SCREEN + DRAWING})),
    "%pylab": ("matplotlib", answered({"rotation": PYLAB + "    return array([[c, -s], [s, c]])"})),
    "a Series": ("pandas", answered({
        "huber_weights": "import pandas as pd\n\n\ndef huber_weights(residuals, delta):\n"
        "    r = pd.Series(np.asarray(residuals, dtype=float))\n"
        "    return delta / r.where(r > delta, delta)\n"})),
    "a fraction": ("numpy", answered({
        "fitness": "from fractions import Fraction\n\n\ndef fitness(kept):\n"
        "    return Fraction(int(sum(kept)), len(kept))\n"})),
    "numba.guvectorize": ("numba", answered({
        "huber_weights": "import numba\n\n\n"
        "@numba.guvectorize(['void(f8[:], f8, f8[:])'], '(n),()->(n)')\n"
        "def weigh(r, d, out):\n    for k in range(len(r)):\n"
        "        out[k] = 1.0 if r[k] <= d else d / r[k]\n\n\n"
        "def huber_weights(residuals, delta):\n    return weigh(residuals * 1.0, delta)\n"})),
    "pandas": ("pandas", answered({
        "overlap": "import pandas as pd\n\n\ndef overlap(distances, overlap_ratio):\n"
        "    count = max(3, int(overlap_ratio * len(distances)))\n"
        "    return pd.Series(distances).rank(method='first').to_numpy() <= count\n"})),
    "numba.vectorize": ("numba", answered({
        "huber_weights": "import numba\n\n\n@numba.vectorize\ndef weight(r, delta):\n"
        "    return 1.0 if r <= delta else delta / r\n\n\n"
        "def huber_weights(residuals, delta):\n    return weight(residuals * 1.0, delta)\n"})),
}  # fmt: skip


@pytest.mark.parametrize("style", PACKAGES)
def test_packages_that_are_installed_work_behind_each_wall(style, graded, safe_wall):
    package, notebook = PACKAGES[style]
    pytest.importorskip(package)

    verdict = graded({"a.ipynb": notebook}, ASSIGNMENT, seconds=5.0, behind=safe_wall)

    assert verdict.score == 100.0, verdict.notes


OPERATIONS = ["p + 2.0", "2.0 - p", "p * p", "p @ p", "p / 2.0", "p < 2.0", "float(p)", "x, y = p"]


@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_number_of_labkit_s_is_none_and_names_the_package(operation, graded):
    source = with_line("fitness", f"p = labkit.rotation(0.1); {operation}", "import labkit")

    verdict = graded({"a.ipynb": answered({"fitness": source})}, ASSIGNMENT)

    (fitness,) = [one for one in verdict.questions if not one.passed]
    assert "labkit is not available while grading" in fitness.message


def test_what_reads_the_cells_in_the_box_cannot_be_imported(graded):
    line = "import labkit.grading.box.inside.session as own; assert not own.Session"

    verdict = graded({"a.ipynb": answered({"fitness": with_line("fitness", line, "")})}, ASSIGNMENT)

    assert verdict.score == 100.0, verdict.questions


@pytest.mark.parametrize("code", [
    "def wrap(angle):\n    import nothing_of_this_name\n    return angle\n",
    "from nothing_of_this_name import Angle\n\n\ndef wrap(angle):\n    return Angle(angle)\n",
    "import nothing_of_this_name as no\n\n\ndef wrap(angle):\n    return no.wrap(angle)\n",
    "from nothing_of_this_name import Model\n\n\nclass Angle(Model):\n    pass\n\n\n"
    "def wrap(angle):\n    return Angle(angle)\n",
    "from nothing_of_this_name import fast\n\n\n@fast\ndef wrap(angle):\n    return angle\n",
])  # fmt: skip
def test_a_package_that_is_not_there_is_named(code, graded):
    """Law 4: also where its import stands above the function."""
    changed = {"wrap": code}

    verdict = graded({"a.ipynb": answered(changed)}, ASSIGNMENT)

    ((message),) = [one.message for one in verdict.questions if not one.passed]
    assert "No module named 'nothing_of_this_name'" in message


MISSES = """import nothing_of_this_name as no


def turned(angle):
    return no.wrap(angle)


def share(kept):
    return kept.mean()
"""


@pytest.mark.parametrize("line", ["from helpers import turned, share", "from helpers import *"])
def test_a_package_that_a_script_misses_costs_what_uses_it_and_is_named(line, graded):
    """Law 4."""
    uses = {
        "wrap": f"{line}\n\n\ndef wrap(angle):\n    return turned(angle)\n",
        "fitness": "def fitness(kept):\n    return share(kept)\n",
    }
    files = {"a.ipynb": answered(uses), "helpers.py": MISSES.encode()}

    verdict = graded(files, ASSIGNMENT)

    (wrap,) = [one for one in verdict.questions if not one.passed]
    assert wrap.question == "wrap"
    assert "'nothing_of_this_name'" in wrap.message
    assert "that package is not installed where the grading runs" in wrap.message

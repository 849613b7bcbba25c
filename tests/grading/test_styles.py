"""Honest ways to write and to hand in right answers: each earns all that it should."""

import io
import json
import sys
import zipfile
from pathlib import Path

import pytest

import labkit
from labkit.course.assignment import load_assignment
from labkit.grading.classroom.handins import one_submission, read_files
from tests.course.authoring.right_answers import plain_python, source_of
from tests.grading.notebooks import RIGHT, answered, cell, notebook

ASSIGNMENT = load_assignment()
NUMPY = "import numpy as np\n\n"
ZEROS = [f"def {name}(*given):\n    return 0" for name in RIGHT]
NOTHING = dict.fromkeys(RIGHT, "0")
SCRIPT = NUMPY + "\n\n\n".join(RIGHT.values()) + "\n"
STARRED = "from numpy import *\nfrom builtins import max"
STUB = "def {}(*arguments):\n    raise NotImplementedError\n"


STEP = RIGHT["icp_step"]
ICP = RIGHT["icp"]
HELPED = "def transform(T, p):\n    return p @ T[:2, :2].T + T[:2, 2]\n\n\n" + STEP.replace(
    "source @ T[:2, :2].T + T[:2, 2]", "transform(T, source)"
)
EXPERIMENTS = (
    "source, target = np.random.rand(9, 2), np.random.rand(9, 2)\n"
    "transform = icp(source, target, np.eye(3), 1.0, 0.9, 0.1, 5)\n"
    "overlap = 0.8\nrotation = np.eye(2)\nfitness = fitness(np.array([True]))",
)
CLASSES = (
    "from __future__ import annotations\nfrom dataclasses import dataclass\n{numpy}"
    "@dataclass\nclass Aligner:\n    weights: Weights\n"
    "    def run(self, source: Points, target: Points) -> Result:\n"
    "        return align_weighted(source, target, self.weights.values)\n"
    "@dataclass\nclass Weights:\n    values: np.ndarray\n"
)
MAGIC = (
    "%matplotlib inline\n%load_ext autoreload\nimport matplotlib.pyplot as plt\n"
    "!pip install open3d\nplt.plot?\nfiles = !ls",
    "%%bash\nrm -rf /\nif then else",
    "from google.colab import drive\ndrive.mount('/content/drive')\n"
    "import ipywidgets as w\nfrom tqdm.notebook import tqdm\n@w.interact(x=(0, 1))\n"
    "def show(x):\n    fig, ax = plt.subplots(1, 2)\n    line, = ax[0].plot([x])\n"
    "for k in tqdm(range(3)):\n    print(k)",
)
BARS = "from tqdm.auto import tqdm, trange\nimport matplotlib.pyplot as plt\n\n\n"
DRAWN = (
    "    bar = tqdm(range(2))\n    for k in bar:\n        bar.set_postfix(k=k)\n"
    "        tqdm.write(f'{k} of {len(bar)}')\n    low, high = plt.xlim()\n"
    "    print(f'{plt.gca().get_ylim()[1]:.2f}')\n"
    "    counts, edges, bars = plt.hist([1.0, 2.0])\n"
)
TIMED = {name: f"%%time\n{RIGHT[name]}" for name in ("rotation", "icp")} | {
    "wrap": "%%capture output\n%config x\n" + RIGHT["wrap"]
}
STYLES = {
    "the handed-out notebook": answered(),
    "transform, and an experiment": answered({"icp_step": HELPED}, after=EXPERIMENTS),
    "globals()": answered(
        {"has_converged": 'globals()["EPS"] = 0.0\n' + RIGHT["has_converged"].replace(
            "):\n", "):\n    EPS\n", 1)}
    ),
    "what an answer prints goes nowhere": answered(
        {"wrap": "import os\n\n\n" + RIGHT["wrap"].replace(
            "    return", "    with open(os.devnull, 'w') as null:\n"
            "        print(angle, file=null)\n    return", 1)}
    ),
    "numba": answered(
        {"best_translation": "from numba import njit, prange\n\n\n@njit(parallel=True)\n"
         "def best_translation(R, source, target):\n    t = np.zeros(2)\n"
         "    for k in prange(len(source)):\n        t += target[k] - R @ source[k]\n"
         "    return t / len(source)\n"}
    ),
    "magics": answered(TIMED, before=MAGIC),
    "lines that begin as magics do": answered({
        "wrap": "%matplotlib inline\nfiles = !ls\nhere = %pwd\nTURN = 2 * np.pi\n"
        + RIGHT["wrap"].replace("np.pi - (np.pi - angle) % (2 * np.pi)",
            "(np.pi - ((np.pi - angle)\n        % TURN) if (angle\n        != None) else 0)")}),
    "bars and axes": answered({"icp": BARS + ICP.replace(
        "    T = T_init", f"{DRAWN}    T = T_init").replace(
        "for _ in range(max_iterations):", "for _ in trange(max_iterations, desc='ICP'):")}),
    "a cell that is none": answered().replace(b'"cells": [', b'"cells": [null, {"cell_type": '
        b'"code", "source": null}, ', 1),
    "classes": answered({"align": RIGHT["align"]}, before=(CLASSES.format(numpy=NUMPY),)),
    "an error at the end": answered(after=("this is no Python", "1 / 0")),
    "a failing assert in the cell": answered({"wrap": RIGHT["wrap"] + "\n\nassert wrap(4) == 4"}),
    "waits between two pictures": answered({
        "icp": "import time\n" + ICP.replace("        if", "        time.sleep(9)\n        if", 1)
    }),
    "UTF-16": json.dumps(json.loads(answered())).encode("utf-16"),
    "one cell": notebook([cell("import open3d, numpy as np\n" + SCRIPT + "fitness = 3")]),
    "a stub again below": answered(after=(STUB.format("icp"), STUB.format("rotation"))),
    "recursion": answered({"wrap": "def wrap(angle, k=400):\n"
        "    return wrap(angle, k - 1) if k else np.pi - (np.pi - angle) % (2 * np.pi)\n"}),
    "cKDTree": answered({"nearest_neighbors": "from scipy.spatial import cKDTree\n\n\n"
        "def nearest_neighbors(source, target):\n    d, i = cKDTree(target).query(source)\n"
        "    return i, d\n"}),
    "mended below": answered(NOTHING, after=list(RIGHT.values())),
    "mended last": answered(NOTHING, after=[*ZEROS, *RIGHT.values()]),
    "slow": answered(
        before=["import numpy as np", *["while True:\n    pass"] * 3],
        after=["while True:\n    pass"],
        changed={
            "wrap": "from functools import partial\nEPS = np.finfo(float).eps\n"
            "HALF, TURN = map(float, (np.pi, 2 * np.pi))\n" + RIGHT["wrap"].replace(
                "np.pi - (np.pi - angle) % (2 * np.pi)",
                "HALF - (HALF - angle) % TURN + EPS - EPS"),
            "fitness": "mean = partial(np.mean)\n" + RIGHT["fitness"].replace(
                "kept.mean()", "mean(kept)")}),
}  # fmt: skip
SCRIPTS = {
    "loops and lists": SCRIPT + source_of(plain_python),
    "from numpy import *": SCRIPT.replace("import numpy as np", STARRED).replace("np.", ""),
    "jupytext": f"# %% [markdown]\n# # Lab\n\n# %%\n{SCRIPT}\n# %%\n%matplotlib inline\n1 / 0\n",
    "nbconvert": f"#!/usr/bin/env python\n# coding: utf-8\n\n# In[1]:\n\n{SCRIPT}\n# In[ ]:\n\n"
    "get_ipython().system('ls')\n",
    "main": f"{SCRIPT}\nif __name__ == '__main__':\n    assert rotation(0)[0, 0] == 2\n",
    "syntax": SCRIPT.replace("\n", "\n# %%\nx = (1,\n", 1) + "\n\ndef extra(:\n    pass",
    "NUL": SCRIPT.replace("\n", "\n# \0\n", 1),
    "latin-1": f"# -*- coding: latin-1 -*-\n# é\n{SCRIPT}",
    "utf-16": SCRIPT,  # as PowerShell writes it
}
ENCODINGS = "latin-1", "utf-16"
SECOND = "def helper(x):\n    return 2 * x\n\n\nclass Point:\n    pass\n"
OWN_HELPER = "def helper(x):\n    return x\n\n\ndef share(kept):\n    return helper(kept.mean())\n"
USES_HELPERS = "import first, second\n\n\ndef fitness(kept):\n    return first.share(kept)\n"
RELATIVE = {
    "work/pkg/__init__.py": b"from .tools import share\n",
    "work/pkg/tools.py": b"def share(kept):\n    return kept.mean()\n",
    "work/a.ipynb": answered({
        "fitness": "import pkg\n\n\ndef fitness(kept):\n    return pkg.share(kept)\n"}),
}  # fmt: skip
FROM_CELL = "from share import share\n\n\ndef fitness(kept):\n    return share(kept)\n"
WRITES = "%%writefile share.py\ndef share(kept):\n    return kept.mean()\n"
MODULES = {
    "two modules with helpers of one name": {
        "a.ipynb": answered({"fitness": USES_HELPERS}),
        "first.py": OWN_HELPER.encode(),
        "second.py": SECOND.encode(),
    },
    "a package with relative imports": RELATIVE,
    "a notebook named like a package that it imports": {"scipy.ipynb": STYLES["cKDTree"]},
    "a folder named like a package": {"scipy/a.ipynb": STYLES["cKDTree"]},
    "a cell that writes a module": {"a.ipynb": answered({"fitness": FROM_CELL}, before=[WRITES])},
    "%run of a notebook": {
        "a.ipynb": answered({"fitness": "%run helpers.ipynb\n\n\ndef fitness(kept):\n"
                             "    return share(kept)\n"}),
        "helpers.ipynb": notebook([cell("def share(kept):\n    return kept.mean()")]),
    },
}  # fmt: skip


def zipped(name, data):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(name, data)
    return buffer.getvalue()


COLOURS = "import colorsys\n\n\ndef fitness(kept):\n    colorsys.rgb_to_hsv(0.1, 0.2, 0.3)\n"
FILES = {
    **MODULES,
    "a folder of one's own called labkit": {"work/labkit/mine.py": SCRIPT.encode()},
    "a script with the name of one of Python's": {
        "a.ipynb": answered({"fitness": COLOURS + "    return kept.mean()\n"}),
        "colorsys.py": b"x = 1\n",
    },
    "cp1252": {"a.py": f"# é ß €\n{SCRIPT}".encode("cp1252")},
    "GBK": {"a.py": f"# 点云配准\n{SCRIPT}".encode("gbk")},
    "a zip of a folder above": {"a.zip": zipped("../lab/a.py", SCRIPT)},
    "a zip in a zip": {"a.zip": zipped("inner.zip", zipped("a.py", SCRIPT))},
    "a lone surrogate": {"a.ipynb": answered({"wrap": "# \ud800\n" + RIGHT["wrap"]})},
    **{style: {"renamed (1).ipynb": notebook} for style, notebook in STYLES.items()},
    **{style: {"a.py": source.encode(style if style in ENCODINGS else "utf-8")}
       for style, source in SCRIPTS.items()},
    "old": {"assignment_old.ipynb": answered(NOTHING | {"wrap": "def rotation(): 0"}),
            "assignment.ipynb": answered()},
    "old script": {"a_old.py": "\n".join(ZEROS).encode(), "a.ipynb": answered()},
}  # fmt: skip
NOTES = {
    "slow": "it took too long",
    "syntax": "line 3 of a.py is no Python",
    "NUL": "line 2 of a.py holds a NUL byte",
    "old script": "a_old.py and a.ipynb answer the same; those of a.ipynb count",
}


@pytest.mark.parametrize("style", FILES)
def test_an_honest_style_costs_nothing(style, graded):
    """Law 4: what was wrong in one place, or shown for too long, hides no right answer."""
    seconds = 1.0 if style == "slow" else 5.0  # a busy processor takes more to import scipy
    verdict = graded(FILES[style], ASSIGNMENT, seconds=seconds)
    lost = [(one.question, one.message) for one in verdict.questions if not one.passed]
    assert not lost, verdict.notes
    assert NOTES.get(style, "") in str(verdict.notes)
    assert not (style == "the handed-out notebook" and verdict.notes)


GUARDED = "if __name__ == '__main__':\n    np.loadtxt('scan.csv')\n"
WRAPPED = "import helpers as h\n\n\ndef icp_step(*given):\n    return h.icp_step(*given)"


@pytest.mark.parametrize(
    "line", ["from helpers import icp_step", "%run helpers.py", "%run ./helpers", WRAPPED]
)
def test_a_notebook_may_use_its_own_scripts(line, graded):
    book = notebook([cell(f"from lab.mine import *\n{line}"), cell(ICP)])
    rest = NUMPY + "\n\n".join(RIGHT[n] for n in RIGHT if n not in ("icp", "icp_step"))
    files = {"work.zip/a.ipynb": book, "work.zip/lab/mine.py": rest.encode()}
    files["work.zip/helpers.py"] = f"{NUMPY}from lab.mine import *\n{STEP}\n{GUARDED}".encode()
    assert graded(files, ASSIGNMENT).score == 100.0


def test_a_slip_costs_its_own_points_alone(graded):
    called = {"icp_step": STEP.replace("dT @ T", "compose(dT, T)")}
    slip = {"compose": "def compose(a, b):\n    return b @ a\n"}
    verdict = graded({"a.ipynb": answered(called | slip)}, ASSIGNMENT)
    assert {one.question for one in verdict.questions if not one.passed} == {"compose"}
    lent = next(one for one in verdict.questions if one.replaced)
    assert "in place of yours. With yours it would get" in lent.message


HANDS_LISTS = {  # to a function of its own that has a slip
    "nearest_neighbors": {"nearest_neighbors(moved,": "nearest_neighbors(moved.tolist(),"},
    "distance_gate": {"distance_gate(d,": "distance_gate(list(d),"},
    "overlap": {"overlap(d,": "overlap(distances=d.tolist(), overlap_ratio="},
    "compose": {"dT @ T": "np.array(compose(dT.tolist(), T.tolist()))"},
}
SLIPPED = "def {name}(*given, **named):\n    return np.zeros(3)\n"


@pytest.mark.parametrize("name", HANDS_LISTS)
def test_a_slip_costs_no_caller_that_hands_on_lists(name, graded):
    """Law 2: a right function that is lent takes lists, as one's own may."""
    step = STEP
    for text, other in HANDS_LISTS[name].items():
        assert text in step
        step = step.replace(text, other)
    changed = {"icp_step": step, name: SLIPPED.format(name=name)}

    verdict = graded({"a.ipynb": answered(changed)}, ASSIGNMENT)

    assert {one.question for one in verdict.questions if not one.passed} == {name}


def test_a_whole_repository_is_graded_by_what_is_ones_own(graded, read, tmp_path):
    with zipfile.ZipFile(tmp_path / "repo.zip", "w") as archive:
        archive.writestr("lab/notebooks/assignment.ipynb", answered())
        for path in Path(labkit.__file__).parent.glob("*.py"):
            archive.write(path, f"lab/labkit/{path.name}")
    (tmp_path / "outer").mkdir()
    (tmp_path / "repo.zip").rename(tmp_path / "outer/work.zip")
    handed_in = one_submission(tmp_path / "outer", "ada")
    files, unread = read(handed_in)
    assert [Path(file).name for file in files] == ["assignment.ipynb"]
    assert not unread
    assert graded(read_files(handed_in.files)[0], ASSIGNMENT).score == 100.0


def large_output(kind):
    if kind == "picture":
        return {"output_type": "display_data", "data": {"image/png": "iVBOR" * (8 << 20)}}
    if kind == "prints of lists":
        return {"output_type": "stream", "text": ["[[1, 2], [3, 4]], {\n" * 300_000]}
    points = [[{"x": [k]}] for k in range(200_000)]
    return {"output_type": "display_data", "data": {"plotly": points}}


def widgets(count):
    """Metadata that hold the state of widgets, as JupyterLab saves it."""
    return {"widgets": {"state": {str(k): [{"value": [k]}] for k in range(count)}}}


@pytest.mark.parametrize("kind", ["picture", "prints of lists", "figure of plotly"])
def test_outputs_and_the_state_of_widgets_may_be_large(kind, read, tmp_path):
    """Law 4; the text of a cell may speak of outputs."""
    speaks = cell('says = "\\"outputs\\": [{"\nk = 1')
    shows = cell("k = 2") | {"outputs": [large_output(kind)]}
    (tmp_path / "a.ipynb").write_bytes(
        notebook([speaks, shows, cell("k = 3")], **widgets(count=200_000))
    )

    files, unread = read(one_submission(tmp_path, "ada"))

    assert not unread
    assert files["a.ipynb"].split("\n\n") == [speaks["source"], "k = 2", "k = 3"]


def test_what_is_no_python_here_is_not_defined_and_says_so(graded):
    """Law 4: as where the student's Python is newer than the grader's."""
    body = RIGHT["icp"].replace("    T = T_init", "    T = T_init\n    print(f'{'a' b}')", 1)

    verdict = graded({"a.ipynb": answered({"icp": body})}, ASSIGNMENT)

    (icp,) = [one for one in verdict.questions if not one.passed]
    version = ".".join(map(str, sys.version_info[:2]))
    assert icp.score == 0.0
    assert "there is no function `icp`: line " in icp.message
    assert f"is no Python {version} (" in icp.message

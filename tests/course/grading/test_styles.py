"""Honest ways to write and to hand in right answers: each earns all that it should."""

import json
import zipfile
from pathlib import Path

import pytest
from right_answers import plain_python

import labkit
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.handins import one_submission, read_files
from notebooks import NUMPY, RIGHT, answered, cell, functions, notebook

ASSIGNMENT = load_assignment()
SCRIPT = NUMPY + "\n\n\n".join(RIGHT.values()) + "\n"
STARRED = "from numpy import *\nfrom builtins import max"
STUB = "def {}(*arguments):\n    raise NotImplementedError\n"


def replaced(name, old, new):
    assert old in RIGHT[name]
    return {name: RIGHT[name].replace(old, new)}


STEP = RIGHT["icp_step"]
ICP = RIGHT["icp"]
HELPED = "def transform(T, p):\n    return p @ T[:2, :2].T + T[:2, 2]\n\n\n" + STEP.replace(
    "source @ T[:2, :2].T + T[:2, 2]", "transform(T, source)"
)
LIMITED = {"icp": "LIMITS = (1e-7, 1e-7)\n\n\n" + ICP.replace("< 1e-7", "< LIMITS[1]")}
CONVERGES = {"icp": ICP.partition("        if np")[0] + (
    "        if has_converged(dT, 1.0, 0, 1e-7, 1e-7, 0.0, 99):\n            break\n    return T\n"
)}  # fmt: skip
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
TIMED = {name: f"%%time\n{RIGHT[name]}" for name in ("rotation", "icp")} | {
    "wrap": "%%capture output\n%config x\n" + RIGHT["wrap"]
}
STYLES = {
    "the handed-out notebook": answered(),
    "own LIMITS": answered(LIMITED),
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
    "loops and lists": answered(functions(plain_python), before=(
        "import math\n" + functions(plain_python)["centroid"],)),
    "checks and text deleted": answered(checks=False, closing=False),
    "magics": answered(TIMED, before=MAGIC),
    "classes": answered({"align": RIGHT["align"]}, before=(CLASSES.format(numpy=NUMPY),)),
    "an error at the end": answered(after=("this is no Python", "1 / 0")),
    "a failing assert in the cell": answered({"wrap": RIGHT["wrap"] + "\n\nassert wrap(4) == 4"}),
    "waits between two pictures": answered({
        "icp": "import time\n" + ICP.replace("        if", "        time.sleep(9)\n        if", 1)
    }),
    "UTF-16": json.dumps(json.loads(answered())).encode("utf-16"),
    "one cell": notebook([cell("import open3d, numpy as np\n" + SCRIPT + "fitness = 3")]),
    "a stub again below": answered(after=(STUB.format("icp"), STUB.format("rotation"))),
    "cKDTree": answered({"nearest_neighbors": "from scipy.spatial import cKDTree\n\n\n"
        "def nearest_neighbors(source, target):\n    d, i = cKDTree(target).query(source)\n"
        "    return i, d\n"}),
}  # fmt: skip
SCRIPTS = {
    "script": SCRIPT.encode(),
    "from numpy import *": SCRIPT.replace("import numpy as np", STARRED).replace(
        "np.", "").encode(),
    "latin-1": f"# -*- coding: latin-1 -*-\n# é\n{SCRIPT}".encode("latin-1"),
    "jupytext": ("# %% [markdown]\n# # Lab\n\n# %%\n" + SCRIPT + "\n# %%\n%matplotlib inline\n"
                 "# %%\n1 / 0\n").encode(),
    "nbconvert": ("#!/usr/bin/env python\n# coding: utf-8\n\n# In[1]:\n\n" + SCRIPT
                  + "\n# In[ ]:\n\nget_ipython().system('ls')\n").encode(),
    "main": (SCRIPT + "\nif __name__ == '__main__':\n    assert rotation(0)[0, 0] == 2\n").encode(),
}  # fmt: skip


@pytest.mark.parametrize("style", [*STYLES, *SCRIPTS])
def test_a_right_hand_in_gets_all_points(style, graded):
    files = {"a.py": SCRIPTS[style]} if style in SCRIPTS else {"renamed (1).ipynb": STYLES[style]}
    verdict = graded(files, ASSIGNMENT, seconds=1.0)
    assert verdict.score == 100.0, [
        (one.question, one.score, one.message) for one in verdict.questions if not one.passed
    ] + list(verdict.notes)


@pytest.mark.parametrize(
    "line", ["from helpers import icp_step", "%run helpers.py", "%run ./helpers"]
)
def test_a_notebook_may_use_its_own_scripts(line, graded):
    book = notebook([cell(f"from lab.mine import *\n{line}"), cell(ICP)])
    rest = NUMPY + "\n\n".join(RIGHT[n] for n in RIGHT if n not in ("icp", "icp_step"))
    files = {"work.zip/a.ipynb": book, "work.zip/lab/mine.py": rest.encode()}
    files["work.zip/helpers.py"] = f"{NUMPY}from lab.mine import *\n{STEP}".encode()
    assert graded(files, ASSIGNMENT).score == 100.0


@pytest.mark.parametrize(
    ("changed", "lost"),
    [
        ({"compose": "def compose(a, b):\n    return b @ a\n",
          **replaced("icp_step", "dT @ T", "compose(dT, T)")}, {"compose"}),
        ({"has_converged": "def has_converged(*arguments):\n    return True\n", **CONVERGES},
         {"has_converged"}),
    ],
)  # fmt: skip
def test_a_slip_costs_its_own_points_alone(changed, lost, graded):
    verdict = graded({"a.ipynb": answered(changed)}, ASSIGNMENT)
    assert {one.question for one in verdict.questions if not one.passed} == lost
    lent = next(one for one in verdict.questions if one.replaced)
    assert "in place of yours: with yours it would get" in lent.message


def test_a_whole_repository_is_graded_by_what_is_ones_own(graded, read, tmp_path):
    with zipfile.ZipFile(tmp_path / "repo.zip", "w") as archive:
        archive.writestr("lab/notebooks/assignment.ipynb", answered())
        for path in Path(labkit.__file__).parent.glob("*.py"):
            archive.write(path, f"lab/labkit/{path.name}")
    (tmp_path / "outer").mkdir()
    (tmp_path / "repo.zip").rename(tmp_path / "outer/work.zip")
    for place in ("outer", "outer/work.zip"):
        handed_in = one_submission(tmp_path / place, "ada")
        files, unread = read(handed_in)
        assert [Path(file).name for file in files] == ["assignment.ipynb"]
        assert not unread
        files, _ = read_files(handed_in.files)
        assert graded(files, ASSIGNMENT).score == 100.0

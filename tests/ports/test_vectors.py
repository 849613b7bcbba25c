"""The vectors: labkit still gives them, edges are refused, answers are told apart."""

import math
import subprocess
import sys

import pytest

from tests.conformance.compare import disagreement
from tests.conformance.reference import answer, read_files
from tests.conformance.write_vectors import (
    ROUNDING,
    OnAnEdgeError,
    answer_anew,
    refuse_edges,
    texts,
)
from tests.ports.runner import CONFORMANCE, GROUPS, NAMES, VECTORS, labkit_reasons

LIMIT = 400_000  # bytes, all of them together


@pytest.mark.parametrize("group", GROUPS)
def test_labkit_agrees(group):
    wrong = labkit_reasons()
    assert not {
        v["name"]: wrong[v["name"]] for v in VECTORS if v["group"] == group and wrong[v["name"]]
    }


def test_writing_anew_changes_nothing():
    """No case is on an edge, every file is asked for, and the commands are the vectors'."""
    written = texts()
    asked = {word for vector in VECTORS for word in vector["command"] if word.startswith("data/")}
    assert asked == {
        file.relative_to(CONFORMANCE).as_posix() for file in CONFORMANCE.glob("data/*")
    }
    assert len(NAMES) == len(set(NAMES))
    for name, text in written.items():
        assert text == (CONFORMANCE / name).read_text()


def test_an_answer_that_is_missing_or_wrong_is_written():
    vector = dict(VECTORS[0])
    wrong = vector | {"expected": vector["expected"] | {"x": 1.0}}
    del vector["expected"]

    again = [
        answer_anew(each, read_files(CONFORMANCE, [each["command"]])) for each in (vector, wrong)
    ]

    assert all(disagreement(each, VECTORS[0]["expected"], ROUNDING) is None for each in again)


def test_they_are_small_and_reach_every_termination():
    files = [
        *CONFORMANCE.glob("data/*"),
        CONFORMANCE / "vectors.json",
        CONFORMANCE / "commands.txt",
    ]
    assert sum(file.stat().st_size for file in files) < LIMIT
    reached = {v["expected"].get("termination") for v in VECTORS}
    assert reached - {None} == {
        "converged_pose",
        "converged_cost",
        "budget_spent",
        "too_few_correspondences",
        "degenerate",
    }


# ---------------------------------------------------------------- edges

POSTS = [[0.0, 0.0], [4.0, 0.1], [0.2, 3.0], [5.0, 4.0]]
ONE = {"max_iterations": 1}


def shifted(by):
    return [[x + by, y] for x, y in POSTS]


@pytest.mark.parametrize(
    ("source", "target", "parameters"),
    [
        ([[2.0, 1.0], *POSTS[1:]], [[1.75, 1.0], [2.25, 1.0], *POSTS[1:]], ONE),
        (shifted(0.25), POSTS, {"max_correspondence_distance": 0.25}),
        ([[0.25, 0], [4, 0.35], [0.2, 3.25], [5.25, 4]], POSTS, {"overlap_ratio": 0.75} | ONE),
        (shifted(0.25), POSTS, {"translation_tolerance": 0.25, "rotation_tolerance": 1.0}),
        (shifted(0.25), POSTS, {"cost_tolerance": 0.06}),
    ],
)
def test_a_run_on_an_edge_is_refused(source, target, parameters):
    told = {"overlap_ratio": 1.0, "cost_tolerance": 0.0} | parameters
    files = {"t": target, "s": source, "p": told}
    command = ["match", "t", "s", "p"]
    with pytest.raises(OnAnEdgeError, match="edge: a relative jitter"):
        refuse_edges("edge", command, files)
    refuse_edges("edge", command, files | {"s": POSTS, "p": {"overlap_ratio": 1.0}})


def test_an_alignment_on_an_edge_is_refused():
    with pytest.raises(OnAnEdgeError, match="edge: a relative jitter"):
        refuse_edges("edge", ["align", "pairs"], {"pairs": [[900, 0, 1, 0], [900, 1e-4, 1, 1e-4]]})


# ---------------------------------------------------------------- the comparison

POSE = {"x": 1.0, "y": -2.0, "theta": math.pi - 1e-12}
RUN = {**POSE, "termination": "budget_spent", "iterations": 3, "inlier_rmse": None}


@pytest.mark.parametrize(
    "near",
    [
        RUN,
        RUN | {"x": 1.0 + 9e-10},
        RUN | {"x": 1},
        RUN | {"theta": -math.pi + 1e-12},
    ],
)
def test_answers_that_agree(near):
    assert disagreement(near, RUN) is None


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"y": -2.0 + 2e-9}, "y = -2.0 was expected, got -1.999999998, 2e-09 apart"),
        ({"theta": math.pi - 1e-12 - 2e-9}, "theta = 3.14"),
        ({"theta": -math.pi}, "theta must lie in"),
        ({"theta": 3.0 * math.pi}, "theta must lie in"),
        ({"x": None}, "x = 1.0 was expected, got None"),
        ({"x": math.nan}, "x = 1.0 was expected, got nan"),
        ({"x": "1.0"}, "x = 1.0 was expected, got '1.0'"),
        ({"iterations": 4}, "iterations = 3 was expected, got 4"),
        ({"iterations": 3.0}, "iterations = 3 was expected, got 3.0"),
        ({"inlier_rmse": 0.0}, "inlier_rmse = None was expected, got 0.0"),
        ({"termination": "converged_pose"}, "termination = 'budget_spent' was expected"),
        ({"more": 1}, "the keys"),
    ],
)
def test_answers_that_do_not(change, reason):
    assert disagreement(RUN | change, RUN).startswith(reason)


def test_errors_and_poses():
    degenerate = {"error": "degenerate"}
    assert disagreement({"error": "degenerate: the points coincide"}, degenerate) is None
    assert disagreement({"error": "no such file"}, degenerate)
    assert disagreement(POSE, degenerate)
    assert disagreement(degenerate, POSE)
    assert disagreement([1], POSE) == "[1] is no JSON object"
    poses = answer(["integrate", "steps", "0", "0", "0"], {"steps": [[1.0, 0.0, 0.5]] * 2})
    assert disagreement(poses, poses) is None
    assert disagreement({"poses": poses["poses"][:2]}, poses).startswith("3 poses were expected")
    moved = {"poses": [*poses["poses"][:2], [0.0, 0.0, 1.0]]}
    assert disagreement(moved, poses).startswith("pose 2: x = ")


def test_a_program_is_told_which_case_differs():
    says = "import json; print(json.dumps({'error': 'degenerate'}))"
    done = subprocess.run(
        [sys.executable, CONFORMANCE / "compare.py", "alignment", sys.executable, "-c", says],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stdout.startswith("angle_0: the keys ['theta', 'x', 'y'] were expected")
    assert done.stdout.endswith("9 of 37 cases of alignment agree\n")

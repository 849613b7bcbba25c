"""The explorer's loop in JavaScript against labkit's: generated runs, names and equations."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import labkit
from labkit import IcpParameters, IcpResult, Target, Termination
from labkit.interactive import Scene, default_scenes
from labkit.interactive.explorer.widget import parameters_to_json
from labkit.interactive.front_end import FOLDER
from labkit.neighbors import nearest_by_brute_force
from labkit.scan import as_scan
from tests.interactive.in_node import run_explorer

RUN_COUNT = 300
SEED = 20
POSE_TOLERANCE = 1e-9  # [m] and [rad]
COST_TOLERANCE = 1e-12  # [m²], and relative
OFF_SHARE = 0.2  # of the gates and deltas
HISTORY_STRIDE = 7  # every so many-th run is compared iteration by iteration


@cache
def scenes():
    pytest.importorskip("rtbdata")
    return default_scenes()


def parameter_sets():
    """Guesses around the answer and parameters over their sliders' ranges; some extreme."""
    rng = np.random.default_rng(SEED)

    def maybe_off(low, high):
        return math.inf if rng.random() < OFF_SHARE else float(rng.uniform(low, high))

    for number in range(RUN_COUNT):
        scene = number % len(scenes())
        answer = labkit.to_xytheta(scenes()[scene].T_reference)
        guess = answer + rng.uniform(-1.0, 1.0, 3) * [0.6, 0.6, 0.4]
        if number % 40 == 0:
            guess[0] += 30.0  # nothing within any gate
        parameters = IcpParameters(
            max_correspondence_distance=maybe_off(0.05, 2.0),
            overlap_ratio=float(rng.uniform(0.2, 1.0)),
            huber_delta=maybe_off(0.01, 0.5),
            max_iterations=int(rng.choice([1, 20, 60, 200])),
            cost_tolerance=float(rng.choice([0.0, 1e-12, 1e-6])),
            metric="point_to_line" if rng.random() < 0.5 else "point_to_point",
            step_fraction=float(rng.choice([0.5, 1.0, 1.0, 1.0])),
            approach=bool(rng.random() < 0.5),
        )
        yield scene, guess.tolist(), parameters


def as_json(scene: int, guess: list[float], parameters: IcpParameters) -> dict[str, Any]:
    return {"pair": scene, "guess": guess, "parameters": parameters_to_json(parameters)}


def difference(expected: IcpResult, answer: dict[str, Any], compare_history: bool) -> str | None:
    """Describe the first difference of two runs; None if they agree.

    Costs of all iterations are compared on demand: labkit takes long to replay them.
    """
    dx, dy, dtheta = labkit.to_xytheta(expected.poses[-1]) - answer["pose"]
    outcome = {
        "termination": expected.termination.name,
        "iterations": expected.iterations,
        "kept": "".join("01"[int(is_kept)] for is_kept in expected.correspondences.kept),
        "inlier_count": expected.inlier_count,
    }
    if not expected.termination.failed:
        outcome["unobservable"] = list(expected.unobservable)
    for name, value in outcome.items():
        if answer[name] != value:
            return f"{name}: {answer[name]}, not {value}"
    if not max(abs(dx), abs(dy), abs(labkit.wrap(dtheta))) <= POSE_TOLERANCE:
        return f"pose differs by {dx}, {dy}, {dtheta}"
    costs = [expected.cost]
    if compare_history:
        costs = [iteration.cost for iteration in expected.history]
    if not np.allclose(
        costs, answer["costs"][-len(costs) :], rtol=COST_TOLERANCE, atol=COST_TOLERANCE
    ):
        return "costs differ"
    return None


@pytest.mark.slow
def test_the_page_computes_what_labkit_computes(tmp_path):
    """Slow (300 runs in Node): buys that what a slider shows is what labkit would answer."""
    sets = list(parameter_sets())
    jobs = [as_json(*parameter_set) for parameter_set in sets]
    targets = [Target(scene.target) for scene in scenes()]

    answers = run_explorer(scenes(), jobs, tmp_path)

    differences, endings = [], Counter()
    for number, ((scene, guess, parameters), answer) in enumerate(zip(sets, answers, strict=True)):
        T_init = labkit.from_xytheta(guess)
        expected = labkit.icp(scenes()[scene].source, targets[scene], T_init, parameters)
        endings[expected.termination] += 1
        reason = difference(expected, answer, compare_history=number % HISTORY_STRIDE == 0)
        if reason:
            differences.append(f"{scenes()[scene].name} from {guess}, {parameters}: {reason}")
    assert not differences, "\n".join(differences[:5])
    assert len({scene for scene, _, _ in sets}) >= 3
    assert endings.keys() == set(Termination), endings


def test_of_equally_near_points_the_first_is_taken(tmp_path):
    """The page's tree and brute force settle ties alike; a lattice is full of them."""
    lattice = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0)), axis=-1).reshape(-1, 2)
    shuffled = np.random.default_rng(1).permutation(lattice)
    between = np.vstack([lattice + shift for shift in ([0.5, 0.5], [0.5, 0.0], [0.0, 0.5])])
    scene = Scene(
        name="lattice", source=as_scan(between), target=as_scan(shuffled), T_init=np.eye(3)
    )
    job = as_json(0, [0.0, 0.0, 0.0], IcpParameters(max_iterations=1))

    (answer,) = run_explorer([scene], [job], tmp_path)

    assert answer["first_index"] == nearest_by_brute_force(between, shuffled).tolist()


def mirrors() -> Iterator[tuple[str, str, str]]:
    """Name and text of each module of the page that mirrors one of labkit's, and labkit's text."""
    for path in sorted(FOLDER.glob("*/*.js")):
        text = path.read_text("utf-8")
        for module in re.findall(r"mirrors (labkit/[\w/]+\.py)", text):
            yield path.name, text, (FOLDER.parents[1] / module).read_text("utf-8")


def test_the_page_s_functions_and_equations_are_labkit_s():
    """What a mirror exports stands in labkit under the same name, an equation under its number."""
    for name, page, core in mirrors():
        for function in re.findall(r"^export function (\w+)", page, re.MULTILINE):
            snake = (
                re.sub(r"(?<!_)([A-Z])", r"_\1", function).lower().replace("x_y_theta", "xytheta")
            )
            assert re.search(rf"def {snake}\(|^    {snake}: ", core, re.M), f"{name}: {function}"
        for number in re.findall(r"\(\d\.\d+\)", page):
            assert number in core, f"{name}: {number}"
    assert len(list(mirrors())) >= 9

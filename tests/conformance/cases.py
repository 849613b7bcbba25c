"""The cases that every port answers: inputs and commands, no answers.

`Cases` collects them. A table is a list of rows of floats, a parameter file a dict; both
stand under the path that the command names, relative to the folder of ``vectors.json``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labkit import Scan, apply, from_xytheta, invert, read_log, transform
from labkit.arrays import FloatArray
from labkit.simulation import Lidar, cast, lesson_experiment, room, two_rooms

PI = math.pi
Parameters = dict[str, float | None]
Content = list[list[float]] | Parameters


@dataclass(frozen=True, kw_only=True)
class Case:
    """One command; its name is unique."""

    name: str
    group: str
    command: list[str]


@dataclass(frozen=True)
class Cases:
    """All cases and the files that their commands name."""

    cases: list[Case] = field(default_factory=list)
    files: dict[str, Content] = field(default_factory=dict)

    def table(self, name: str, rows: Any, decimals: int = 6) -> str:
        """Keep `rows` as ``data/name.csv``; rounded, so that no libm decides a digit."""
        rounded = np.round(np.asarray(rows, dtype=np.float64), decimals) + 0.0  # no -0.0
        return self._keep(f"data/{name}.csv", rounded.tolist())

    def align(self, name: str, p: Any, q: Any, w: Any = None, decimals: int = 6) -> None:
        columns = (p, q) if w is None else (p, q, w)
        self._case(name, "alignment", "align", self.table(name, np.column_stack(columns), decimals))

    def match(self, group: str, name: str, target: str, source: str, **parameters: Any) -> None:
        """`name` also names the file of parameters."""
        file = self._keep(f"data/{name}.json", parameters)
        self._case(name, group, "match", target, source, file)

    def integrate(self, name: str, increments: Any, start: tuple[float, float, float]) -> None:
        file = self.table(name, increments, decimals=16)
        self._case(name, "integration", "integrate", file, *map(repr, start))

    def _keep(self, path: str, content: Content) -> str:
        if self.files.setdefault(path, content) != content:
            raise ValueError(f"two different files are named {path}")
        return path

    def _case(self, name: str, group: str, *command: str) -> None:
        if any(case.name == name for case in self.cases):
            raise ValueError(f"two cases are named {name}")
        self.cases.append(Case(name=name, group=group, command=list(command)))


def all_cases() -> Cases:
    """Every case, in the order of the file."""
    cases = Cases()
    _alignment(cases)
    _degenerate_alignment(cases)
    _step(cases)
    _run(cases)
    _killian(cases)
    _termination(cases)
    _integration(cases)
    return cases


# ---------------------------------------------------------------- alignment

SQUARE = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
CLOUD = np.random.default_rng(11).normal(0.0, 2.0, (12, 2))
WEIGHTS = np.random.default_rng(12).uniform(0.05, 2.0, 12)
NOISE = np.random.default_rng(13).normal(0.0, 0.05, (12, 2))


def _seen(theta: float, points: FloatArray = CLOUD) -> FloatArray:
    return apply(transform(-3.0, 0.5, theta), points)


def _alignment(cases: Cases) -> None:
    for degrees in (0, 30, 90, 135, 179, -179, -135, -90, -30):
        name = f"angle_{degrees}".replace("-", "minus_")
        cases.align(name, CLOUD, _seen(math.radians(degrees)) + NOISE)
    for name, theta in (
        ("angle_tiny", 1e-8),
        ("angle_just_below_pi", PI - 1e-9),
        ("angle_just_above_minus_pi", -PI + 1e-9),
    ):
        cases.align(name, CLOUD, _seen(theta), decimals=14)
    cases.align("angle_pi_exactly", SQUARE, -SQUARE)
    cases.align("weighted", CLOUD, _seen(2.1) + NOISE, WEIGHTS)
    cases.align("weights_scaled", CLOUD, _seen(2.1) + NOISE, 1000.0 * WEIGHTS)
    half = np.where(np.arange(12) % 2, WEIGHTS, 0.0)
    wrong = _seen(-1.2) + np.where(half[:, None] > 0.0, NOISE, [7.0, -9.0])
    cases.align("weight_zero_silences_outliers", CLOUD, wrong, half)
    cases.align("weights_of_nine_decades", CLOUD, _seen(0.4) + NOISE, np.logspace(-9, 0, 12), 12)
    cases.align("two_pairs", CLOUD[:2], _seen(-2.5, CLOUD[:2]))
    cases.align("two_pairs_that_disagree_in_length", [[0, 0], [1, 0]], [[2, 3], [2, 8]])
    wall = np.column_stack([np.linspace(-4.0, 4.0, 17), np.full(17, 2.0)])
    cases.align("points_on_one_line", wall, _seen(1.9, wall))
    cases.align(
        "far_from_the_origin", CLOUD + np.array([60.0, -40.0]), _seen(1.0) + NOISE + [-50.0, 80.0]
    )
    cases.align("tiny_scale", 1e-6 * CLOUD, 1e-6 * _seen(-0.8), decimals=18)
    cases.align("large_scale", 40.0 * CLOUD, 40.0 * (_seen(-0.8) + NOISE))
    cases.align("reflected_and_noisy", CLOUD, apply(transform(1, 2, 0.6), CLOUD * [1, -1]) + NOISE)
    almost = SQUARE * [1.0, -1.0] + [[0.03, 0.01], [0.0, 0.02], [0.0, 0.0], [0.01, 0.0]]
    cases.align("almost_a_mirror_image", SQUARE, almost)
    light = [1.0, 1e-16]
    cases.align("a_light_second_pair_is_enough", SQUARE[:2], [[1, 1], [3, 4]], light, decimals=20)
    near = np.array([[0.8, 0.3], [0.8, 0.31]])
    cases.align("close_together", near, apply(transform(-3.0, 0.5, 1.3), near), decimals=12)


def _degenerate_alignment(cases: Cases) -> None:
    spot = np.tile([0.1, 0.9], (4, 1))
    cases.align("degenerate_one_pair", SQUARE[:1], SQUARE[1:2])
    cases.align("degenerate_source_coincides", spot, SQUARE)
    cases.align("degenerate_target_coincides", SQUARE, spot)
    cases.align("degenerate_all_weights_zero", SQUARE, SQUARE, np.zeros(4))
    cases.align("degenerate_one_weight_left", SQUARE, SQUARE, [0.0, 0.0, 3.0, 0.0])
    light = [1.0, 1e-24, 0.0, 0.0]
    cases.align("degenerate_second_pair_too_light", SQUARE, SQUARE, light, decimals=30)
    grains = np.array([[900.0, 300.0], [900.0, 300.0 + 2.0**-42]])
    cases.align("degenerate_within_rounding", grains, SQUARE[:2], decimals=20)
    cases.align("degenerate_mirror_image", SQUARE, SQUARE * [1.0, -1.0])
    cases.align("degenerate_circulating", SQUARE, [[1, 0], [0, 1], [1, 0], [0, 1]])


# ---------------------------------------------------------------- the loop


def _room_pair(cases: Cases, name: str = "room", beam_count: int = 136) -> tuple[str, str]:
    """A noisy look at the room, and another after (0.12, 0.06) m and 4°."""
    rng = np.random.default_rng(5)
    lidar = Lidar(beam_count=beam_count)
    pose = transform(0.12, 0.06, math.radians(4.0))
    older, newer = (cast(room(), T, lidar, rng=rng) for T in (np.eye(3), pose))
    return (
        cases.table(f"{name}_target", older.points, 4),
        cases.table(f"{name}_source", newer.points, 4),
    )


def _small_pair(cases: Cases) -> tuple[str, str]:
    """The same by so few beams that a slow interpreter answers at once."""
    return _room_pair(cases, "small", 28)


def _moved(cases: Cases, file: str, name: str, pose: tuple[float, float, float]) -> str:
    """The points of `file` moved by `pose`."""
    return cases.table(name, apply(from_xytheta(pose), cases.files[file]))


def _step(cases: Cases) -> None:
    """One step each: who follows a single stage wrongly is found here."""
    pair = _small_pair(cases)
    plain: Parameters = {
        "max_iterations": 1,
        "max_correspondence_distance": None,
        "overlap_ratio": 1.0,
        "huber_delta": None,
    }
    cases.match("step", "step_plain", *pair, **plain)
    cases.match("step", "step_gate", *pair, **plain | {"max_correspondence_distance": 0.15})
    cases.match("step", "step_overlap", *pair, **plain | {"overlap_ratio": 0.7})
    cases.match("step", "step_huber", *pair, **plain | {"huber_delta": 0.04})
    cases.match("step", "step_defaults", *pair, max_iterations=1)
    guess: Parameters = {"initial_x": 0.3, "initial_y": -0.2, "initial_theta": -0.15}
    cases.match("step", "step_from_a_guess", *pair, max_iterations=1, **guess)
    turned = _moved(cases, pair[0], "small_target_turned", (1.5, -0.7, 2.3))
    guess = {"initial_x": 1.7, "initial_y": -0.6, "initial_theta": 2.5}
    cases.match("step", "step_turned_far", turned, pair[1], max_iterations=1, **guess)
    three = cases.table("three_source", [[0.1, 0.0], [4.1, 0.2], [0.0, 3.2]])
    posts = cases.table("three_target", [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [9.0, 9.0]])
    cases.match("step", "step_of_three_pairs", posts, three, max_iterations=1, overlap_ratio=0.1)


def _run(cases: Cases) -> None:
    lesson = lesson_experiment()
    pair = (
        cases.table("lesson_target", lesson.target.points, 16),
        cases.table("lesson_source", lesson.source.points, 16),
    )
    guess: Parameters = {"initial_x": 0.2, "initial_theta": math.radians(3.0)}
    cases.match("run", "lesson", *pair, **guess)
    room_pair = _room_pair(cases)
    off: Parameters = {
        "max_correspondence_distance": None,
        "overlap_ratio": 1.0,
        "huber_delta": None,
    }
    tight: Parameters = {  # each of the three stages rejects or weighs down what it can
        "max_correspondence_distance": 0.07,
        "overlap_ratio": 0.9,
        "huber_delta": 0.015,
        "initial_x": 0.05,
        "initial_theta": 0.04,
    }
    cases.match("run", "room_defaults", *room_pair)
    cases.match("run", "room_tight", *room_pair, **tight)
    for stage, value in off.items():
        short = stage.split("_")[0].replace("max", "gate")
        cases.match("run", f"room_tight_without_{short}", *room_pair, **tight | {stage: value})
    cases.match("run", "room_plain", *room_pair, **off)
    cases.match("run", "room_only_gate", *room_pair, **off | {"max_correspondence_distance": 0.2})
    cases.match("run", "room_only_overlap", *room_pair, **off | {"overlap_ratio": 0.8})
    cases.match("run", "room_only_huber", *room_pair, **off | {"huber_delta": 0.03})
    weak: Parameters = {"initial_x": 0.5, "initial_y": -0.3, "initial_theta": 0.35}
    cases.match("run", "room_weak_guess", *room_pair, **weak)
    turned = _moved(cases, room_pair[0], "room_target_turned", (1.5, -0.7, 2.3))
    guess = {"initial_x": 1.6, "initial_y": -0.6, "initial_theta": 2.4}
    cases.match("run", "room_turned_far", turned, room_pair[1], **guess)
    opposite = _moved(cases, room_pair[0], "room_target_opposite", (-20.0, 35.0, PI - 0.07))
    guess = {"initial_x": -20.1, "initial_y": 35.1, "initial_theta": -PI + 0.02}
    cases.match("run", "room_across_pi", opposite, room_pair[1], **guess)
    hundred = cases.table("room_hundred", cases.files[room_pair[1]][:100], 4)  # type: ignore[index]
    # In doubles 0.29 · 100 is 28.999999999999996, and ⌊ ⌋ makes it 28.
    cases.match("run", "room_product_rounds_down", room_pair[0], hundred, overlap_ratio=0.29)
    small_pair = _small_pair(cases)
    cases.match("run", "small_defaults", *small_pair)
    cases.match(
        "run", "small_strict", *small_pair, max_correspondence_distance=0.2, huber_delta=0.03
    )
    guess = {"initial_x": 1.6, "initial_y": -0.6, "initial_theta": 2.4}
    turned = _moved(cases, small_pair[0], "small_target_turned", (1.5, -0.7, 2.3))
    cases.match("run", "small_turned_far", turned, small_pair[1], **guess)
    rng = np.random.default_rng(8)
    lidar = Lidar(beam_count=90, field_of_view=2.0 * PI)
    T = transform(0.2, -0.1, 0.08)
    older, newer = (cast(two_rooms(), pose, lidar, rng=rng) for pose in (np.eye(3), T))
    doors = (
        cases.table("doors_target", older.points, 4),
        cases.table("doors_source", newer.points, 4),
    )
    cases.match("run", "two_rooms", *doors, overlap_ratio=0.9, huber_delta=0.05)


def _killian(cases: Cases) -> None:
    """Real scans: 180 beams each, ranges in steps of 5 cm."""
    scans = read_log("killian").scans
    for k in (120, 1000, 2500, 3300):
        pair = (_real(cases, scans, k), _real(cases, scans, k + 1))
        cases.match("run", f"killian_{k}", *pair, overlap_ratio=0.9, max_iterations=40)


def _real(cases: Cases, scans: Any, k: int) -> str:
    scan: Scan = scans[k]
    return cases.table(f"killian_{k}", scan.points, 6)


def _termination(cases: Cases) -> None:
    pair = _small_pair(cases)
    by_cost = {"translation_tolerance": 0.0, "rotation_tolerance": 0.0, "cost_tolerance": 2e-5}
    cases.match("termination", "ends_by_pose", *pair, cost_tolerance=0.0)
    cases.match("termination", "ends_by_cost", *pair, **by_cost)
    cases.match("termination", "ends_with_the_budget", *pair, max_iterations=2)
    # A scene turned about its own centre hardly shifts: both tolerances must hold.
    half = np.random.default_rng(3).uniform(-4.0, 4.0, (10, 2))
    scene = np.vstack([half, -half])
    turned = apply(invert(transform(0.0, 0.0, math.radians(8.0))), scene)
    files = (cases.table("symmetric_target", scene), cases.table("symmetric_source", turned))
    cases.match("termination", "turn_on_the_spot", *files, cost_tolerance=0.0, overlap_ratio=1.0)
    cases.match("termination", "too_few_from_the_start", *pair, initial_x=100.0)
    posts = np.array([[0.0, 0.0], [0.0, 50.0], [0.0, 100.0]])
    shaken = posts + np.array([[0.4, 0.0], [-0.4, 0.0], [0.4, 0.0]])
    files = (cases.table("posts", posts), cases.table("posts_shaken", shaken))
    wide: Parameters = {"max_correspondence_distance": 0.45, "huber_delta": None}
    cases.match("termination", "too_few_after_a_step", *files, **wide)
    two = cases.table("two_points", [[0.0, 0.1], [0.1, 50.0]])
    cases.match("termination", "too_few_points", files[0], two)
    spot = cases.table("spot", np.tile([0.1, 0.9], (5, 1)))
    wall = cases.table("wall", np.column_stack([np.linspace(-1.0, 1.0, 12), np.ones(12)]))
    one = cases.table("one_point", [[0.1, 0.9]])
    cases.match("termination", "degenerate_source", wall, spot, overlap_ratio=1.0)
    near = np.random.default_rng(4).uniform([0.0, 0.8], [0.2, 1.0], (6, 2))
    cluster = cases.table("cluster", near)
    cases.match("termination", "degenerate_target", one, cluster, overlap_ratio=1.0)


# ---------------------------------------------------------------- integration


def _integration(cases: Cases) -> None:
    cases.integrate("one_step", [[0.5, 0.0, 0.1]], (1.0, 0.0, PI / 2))
    cases.integrate("square", [[1.0, 0.0, PI / 2]] * 8, (0.0, 0.0, 0.0))
    cases.integrate("across_pi", [[0.3, 0.1, 0.4]] * 20, (2.0, -1.0, 3.0))
    cases.integrate("across_minus_pi", [[0.3, -0.1, -0.4]] * 20, (2.0, -1.0, -3.0))
    cases.integrate("half_turns", [[1.0, 0.5, PI], [1.0, 0.5, -PI]] * 3, (0.0, 0.0, 0.0))
    cases.integrate("more_than_a_turn", [[1.0, 0.0, 7.0], [1.0, 0.0, -20.0]], (0.0, 0.0, 1.0))
    steps = np.random.default_rng(6).normal([0.1, 0.0, 0.01], [0.02, 0.01, 0.1], (100, 3))
    cases.integrate("many_steps", np.round(steps, 5), (-3.0, 4.0, 0.5))

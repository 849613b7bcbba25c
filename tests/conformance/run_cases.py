"""Runs of the loop: single steps, whole runs, recorded scans."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from collection import Cases, Parameters
from labkit import Scan, read_log, transform
from labkit.arrays import FloatArray
from labkit.simulation import Lidar, cast, lesson_experiment, two_rooms
from scenes import moved, room_pair, small_pair

PI = math.pi


def step(cases: Cases) -> None:
    """One step each: who follows a single stage wrongly is found here."""
    pair = small_pair(cases)
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
    turned = moved(cases, pair[0], "small_target_turned", (1.5, -0.7, 2.3))
    guess = {"initial_x": 1.7, "initial_y": -0.6, "initial_theta": 2.5}
    cases.match("step", "step_turned_far", turned, pair[1], max_iterations=1, **guess)
    three = cases.table("three_source", [[0.1, 0.0], [4.1, 0.2], [0.0, 3.2]])
    posts = cases.table("three_target", [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [9.0, 9.0]])
    cases.match("step", "step_of_three_pairs", posts, three, max_iterations=1, overlap_ratio=0.1)


def run(cases: Cases) -> None:
    lesson = lesson_experiment()
    pair = (
        cases.table("lesson_target", lesson.target.points, 16),
        cases.table("lesson_source", lesson.source.points, 16),
    )
    guess: Parameters = {"initial_x": 0.2, "initial_theta": math.radians(3.0)}
    cases.match("run", "lesson", *pair, **guess)
    rooms = room_pair(cases)
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
    cases.match("run", "room_defaults", *rooms)
    cases.match("run", "room_tight", *rooms, **tight)
    for stage, value in off.items():
        short = stage.split("_")[0].replace("max", "gate")
        cases.match("run", f"room_tight_without_{short}", *rooms, **tight | {stage: value})
    cases.match("run", "room_plain", *rooms, **off)
    cases.match("run", "room_only_gate", *rooms, **off | {"max_correspondence_distance": 0.2})
    cases.match("run", "room_only_overlap", *rooms, **off | {"overlap_ratio": 0.8})
    cases.match("run", "room_only_huber", *rooms, **off | {"huber_delta": 0.03})
    weak: Parameters = {"initial_x": 0.5, "initial_y": -0.3, "initial_theta": 0.35}
    cases.match("run", "room_weak_guess", *rooms, **weak)
    turned = moved(cases, rooms[0], "room_target_turned", (1.5, -0.7, 2.3))
    guess = {"initial_x": 1.6, "initial_y": -0.6, "initial_theta": 2.4}
    cases.match("run", "room_turned_far", turned, rooms[1], **guess)
    opposite = moved(cases, rooms[0], "room_target_opposite", (-20.0, 35.0, PI - 0.07))
    guess = {"initial_x": -20.1, "initial_y": 35.1, "initial_theta": -PI + 0.02}
    cases.match("run", "room_across_pi", opposite, rooms[1], **guess)
    hundred = cases.table("room_hundred", cases.files[rooms[1]][:100], 4)  # type: ignore[index]
    # In doubles 0.29 · 100 is 28.999999999999996, and ⌊ ⌋ makes it 28.
    cases.match("run", "room_product_rounds_down", rooms[0], hundred, overlap_ratio=0.29)
    smalls = small_pair(cases)
    cases.match("run", "small_defaults", *smalls)
    cases.match("run", "small_strict", *smalls, max_correspondence_distance=0.2, huber_delta=0.03)
    guess = {"initial_x": 1.6, "initial_y": -0.6, "initial_theta": 2.4}
    turned = moved(cases, smalls[0], "small_target_turned", (1.5, -0.7, 2.3))
    cases.match("run", "small_turned_far", turned, smalls[1], **guess)
    rng = np.random.default_rng(8)
    lidar = Lidar(beam_count=90, field_of_view=2.0 * PI)
    T = transform(0.2, -0.1, 0.08)
    older, newer = (cast(two_rooms(), pose, lidar, rng=rng) for pose in (np.eye(3), T))
    doors = (
        cases.table("doors_target", older.points, 4),
        cases.table("doors_source", newer.points, 4),
    )
    cases.match("run", "two_rooms", *doors, overlap_ratio=0.9, huber_delta=0.05)


def killian(cases: Cases) -> None:
    """Real scans: 180 beams each, ranges in steps of 5 cm."""
    scans = read_log("killian").scans
    for k in (120, 1000, 2500, 3300):
        pair = (_real(cases, scans, k), _real(cases, scans, k + 1))
        cases.match("run", f"killian_{k}", *pair, overlap_ratio=0.9, max_iterations=40)
    thin = tuple(cases.table(f"small_killian_{k}", _points(scans, k)[::7], 6) for k in (2500, 2501))
    cases.match("run", "small_killian_2500", *thin, overlap_ratio=0.9, max_iterations=40)


def _real(cases: Cases, scans: Any, k: int) -> str:
    return cases.table(f"killian_{k}", _points(scans, k), 6)


def _points(scans: Any, k: int) -> FloatArray:
    scan: Scan = scans[k]
    return scan.points

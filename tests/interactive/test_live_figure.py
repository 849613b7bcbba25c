"""Live figures: what the page computes at each place of the sliders is what labkit computes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

pytest.importorskip("anywidget")

import labkit
from labkit import IcpParameters
from labkit.interactive import live_figure
from labkit.interactive.live_figure import LiveFigure
from labkit.se2 import relative
from labkit.simulation import Lidar, cast, room
from tests.interactive.in_node import run_in_node

TRUTH = labkit.transform(0.30, 0.05, math.radians(5.0))
PLACE = labkit.transform(0.5, -0.4, 0.3)
TOLERANCE = 1e-9  # [m]

lidar, rng = Lidar(beam_count=181), np.random.default_rng(3)
older = cast(room(), PLACE, lidar, rng=rng)
newer = cast(room(), PLACE @ TRUTH, lidar, rng=rng)
lattice = np.stack(np.meshgrid(np.arange(6.0), np.arange(4.0)), axis=-1).reshape(-1, 2)


def run_model(folder, moves, model, **given):
    """Answers of a model, as the widget ships it, with its sliders at each of the moves."""
    sliders = {f"slider {k}": (0, 1) for k in range(len(moves[0]))}
    figure = live_figure(
        model, sliders, label="", start=moves[0], xlim=(-5.0, 5.0), ylim=(-5.0, 5.0), **given
    )
    job = {"figures": [{"model": figure.model_name, "data": figure.model_data, "moves": moves}]}
    return run_in_node("live.mjs", LiveFigure._esm, job, folder)["answers"][0]


def as_points(flat):
    return np.reshape(flat, (-1, 2))


def error_text(T, truth=TRUTH):
    """Error of a pose, as the page writes it."""
    x, y, theta = labkit.to_xytheta(relative(truth, T))
    metres = math.hypot(x, y)
    length = f"{1e3 * metres:.1f} mm" if metres < 0.1 else f"{metres:.3f} m"
    return f"{length}, {math.degrees(abs(theta)):.2f}°"


TURNS = [[0.0, 0.0, 0.0], [-12.0, 0.4, -0.3], [30.0, 0.0, 0.1]]  # [°], [m], [m]


@pytest.mark.parametrize("source", [newer.points, newer.points[1:]])  # an odd and an even number
def test_a_moved_scan_and_its_median_distance(tmp_path, source):
    nearest = labkit.Target(older).search

    answers = run_model(tmp_path, TURNS, "turn", source=source, target=older.points)

    for (degrees, x, y), answer in zip(TURNS, answers, strict=True):
        moved = labkit.apply(labkit.transform(x, y, math.radians(degrees)), source)
        drawn = as_points(answer["panels"][0]["newer"])
        np.testing.assert_allclose(drawn, moved, rtol=0, atol=TOLERANCE)
        median = np.median(nearest.query(moved)[1])
        assert answer["numbers"] == {"median distance": f"{median:.3f} m"}


def test_the_cost_of_pairs_that_are_moved(tmp_path):
    p, q = newer.points, older.points[: len(newer)]
    w = np.linspace(0.0, 1.0, len(newer))

    answers = run_model(tmp_path, TURNS, "turn", source=p, target=q, weights=w)

    for (degrees, x, y), answer in zip(TURNS, answers, strict=True):
        T = labkit.transform(x, y, math.radians(degrees))
        cost = w @ ((labkit.apply(T, p) - q) ** 2).sum(axis=1)
        assert answer["numbers"] == {"cost J": f"{cost:.3f} m²"}


def test_the_trace_of_centred_pairs_is_the_height_of_a_cosine(tmp_path):
    p = newer.points[::20]
    w = np.linspace(0.1, 1.0, len(p))
    x = p - w @ p / w.sum()
    y = labkit.apply(TRUTH, x) + 0.1 * np.random.default_rng(3).normal(size=x.shape)
    y -= w @ y / w.sum()
    H = (w[:, None] * x).T @ y
    best = float(np.degrees(labkit.to_xytheta(labkit.align(x, y, w))[2]))

    answers = run_model(tmp_path, [[40.0], [best]], "trace", source=x, target=y, weights=w)

    for degrees, answer in zip((40.0, best), answers, strict=True):
        T = labkit.transform(0.0, 0.0, np.radians(degrees))
        cost = w @ ((labkit.apply(T, x) - y) ** 2).sum(axis=1)
        assert answer["numbers"]["tr(RH)"] == f"{np.trace(T[:2, :2] @ H):.1f} m²"
        assert answer["numbers"]["cost J"] == f"{cost:.1f} m²"
        assert np.isclose(answer["panels"][1]["query"][0], degrees / 36)
    top = answers[1]["panels"][1]
    np.testing.assert_allclose(top["query"], top["after"], rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize(("weight", "metres"), [(1.0, 2.0), (0.3, 2.0), (0.0, 4.0), (1.0, 0.0)])
def test_an_outlier_pulls_by_its_weight(tmp_path, weight, metres):
    p = newer.points[::20]
    q = labkit.apply(TRUTH, p) + np.random.default_rng(3).normal(0.0, 0.02, p.shape)
    weights, moved_q = np.ones(len(p)), q.copy()
    weights[4] = weight
    moved_q[4, 0] += metres
    T = labkit.align(p, moved_q, weights)
    given = {"source": p, "target": q, "truth": labkit.to_xytheta(TRUTH), "row": 4}

    (answer,) = run_model(tmp_path, [[weight, metres]], "outlier", **given)

    marks = answer["panels"][0]
    before, after = weights @ q / weights.sum(), weights @ moved_q / weights.sum()
    expected = {
        "newer": labkit.apply(T, p).ravel(),
        "after": after,
        "before": before,
        "pull": [*before, *(before + 5.0 * (after - before))],  # its label says "5 times"
        "stray": [*labkit.apply(T, p)[4], *moved_q[4]],
    }
    for name, numbers in expected.items():
        np.testing.assert_allclose(marks[name], numbers, rtol=0, atol=TOLERANCE)
    assert len(marks["pair"]) == 4 * (len(p) - 1)
    assert answer["numbers"] == {
        "centroid moves": f"{weight * metres / weights.sum():.3f} m",
        "error of the motion": error_text(T),
    }


def search_cells(points, depth):
    """Cells of scipy's KD-tree after `depth` cuts: rows (left, low, right, high)."""

    def cut(node, low, high, depth):
        if depth == 0 or node.split_dim < 0:
            return [[*low, *high]]
        high_of_lesser, low_of_greater = high.copy(), low.copy()
        high_of_lesser[node.split_dim] = low_of_greater[node.split_dim] = node.split
        return [
            *cut(node.lesser, low, high_of_lesser, depth - 1),
            *cut(node.greater, low_of_greater, high, depth - 1),
        ]

    tree = cKDTree(points, leafsize=1)
    low, high = np.asarray(tree.mins), np.asarray(tree.maxes)
    margin = 0.02 * float((high - low).max()) or 0.5
    return np.array(cut(tree.tree, low - margin, high + margin, depth))


def points_within(points, cells):
    """Count the points that lie in any of the cells."""
    inside = (points[:, None] >= cells[:, :2]) & (points[:, None] < cells[:, 2:])
    return inside.all(axis=2).sum()


@pytest.mark.parametrize("points", [older.points, lattice, np.ones((3, 2))])
def test_the_cells_of_a_tree_are_those_that_are_drawn(tmp_path, points):
    """Equal coordinates, too: a lattice is full of them, and one place cannot be cut."""
    moves = [[cuts, x, y] for cuts in range(8) for x, y in [(0.3, 0.9), (-4.0, 2.5)]]

    answers = run_model(tmp_path, moves, "cuts", target=points)

    for (cuts, x, y), answer in zip(moves, answers, strict=True):
        marks = answer["panels"][0]
        radius = np.hypot(*(points - [x, y]).T).min()
        cells = search_cells(points, cuts)
        distance = np.maximum(np.maximum(cells[:, :2] - [x, y], [x, y] - cells[:, 2:]), 0.0)
        to_open = cells[np.hypot(*distance.T) <= radius]
        count = points_within(points, to_open)
        percent = math.floor(100 * count / len(points) + 0.5)  # a half goes up
        np.testing.assert_allclose(
            np.reshape(marks["cell"], (-1, 4)), cells, rtol=0, atol=TOLERANCE
        )
        np.testing.assert_allclose(
            np.reshape(marks["open"], (-1, 4)), to_open, rtol=0, atol=TOLERANCE
        )
        assert marks["reach"][2] == pytest.approx(radius)
        assert answer["numbers"] == {
            "cells": f"{len(cells)}",
            "to open": f"{len(to_open)}",
            "points in them": f"{count} of {len(points)} ({percent} %)",
        }


@pytest.mark.parametrize(("panel", "name"), [(0, "point-to-point"), (1, "point-to-line")])
def test_a_race_shows_both_runs_after_as_many_steps(tmp_path, panel, name):
    target, parameters = labkit.Target(older), IcpParameters(overlap_ratio=0.9)
    result = labkit.icp(
        newer, target, parameters=replace(parameters, metric=name.replace("-", "_"))
    )
    given = {"source": newer.points, "target": target.points, "normals": target.normals}

    answers = run_model(
        tmp_path,
        [[0], [2], [99]],
        "race",
        truth=labkit.to_xytheta(TRUTH),
        parameters=parameters,
        **given,
    )

    assert 2 < result.iterations < 99
    for k, answer in zip((0, 2, result.iterations), answers, strict=True):
        T = result.history[k].T_target_source
        drawn = as_points(answer["panels"][panel]["newer"])
        np.testing.assert_allclose(drawn, labkit.apply(T, newer.points), rtol=0, atol=TOLERANCE)
        ending = "" if k < result.iterations else f", the end after {k} steps"
        assert answer["numbers"][name] == f"{error_text(T)} off the truth{ending}"

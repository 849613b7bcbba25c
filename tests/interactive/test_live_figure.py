"""Live figures: what the page computes at each place of the sliders is what labkit computes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

pytest.importorskip("anywidget")

from in_node import told_by

import labkit
from labkit import IcpParameters
from labkit.interactive import live_figure
from labkit.interactive.live_figure import LiveFigure
from labkit.se2 import relative
from labkit.simulation import Lidar, cast, room

TRUTH = labkit.transform(0.30, 0.05, math.radians(5.0))
PLACE = labkit.transform(0.5, -0.4, 0.3)
WINDOW: dict[str, Any] = {"xlim": (-5.0, 5.0), "ylim": (-5.0, 5.0)}
CLOSE = 1e-9  # m

lidar, rng = Lidar(beam_count=181), np.random.default_rng(3)
older = cast(room(), PLACE, lidar, rng=rng)
newer = cast(room(), PLACE @ TRUTH, lidar, rng=rng)
lattice = np.stack(np.meshgrid(np.arange(6.0), np.arange(4.0)), axis=-1).reshape(-1, 2)


def shown(folder, moves, model, **given):
    """What the page shows at each of the moves, from the module that the widget ships."""
    names = [f"slider {k}" for k in range(len(moves[0]))]
    figure = live_figure(
        model, dict.fromkeys(names, (0, 1)), label="it", start=moves[0], **WINDOW, **given
    )
    job = {"figures": [{"model": figure.model_name, "given": figure.given, "moves": moves}]}
    return told_by("live.mjs", LiveFigure._esm, job, folder)["answers"][0]


def rows(flat):
    return np.reshape(flat, (-1, 2))


def said(T, truth=TRUTH):
    """How far a pose is off, as the page writes it."""
    x, y, theta = labkit.to_xytheta(relative(truth, T))
    metres = math.hypot(x, y)
    far = f"{1e3 * metres:.1f} mm" if metres < 0.1 else f"{metres:.3f} m"
    return f"{far}, {math.degrees(abs(theta)):.2f}°"


def test_a_moved_scan_and_its_median_distance(tmp_path):
    moves = [[0.0, 0.0, 0.0], [-12.0, 0.4, -0.3], [30.0, 0.0, 0.1]]
    search = labkit.Target(older).search
    for source in (newer.points, newer.points[1:]):  # an odd and an even number
        found = shown(tmp_path, moves, "turn", source=source, target=older.points)
        for (degrees, x, y), answer in zip(moves, found, strict=True):
            moved = labkit.apply(labkit.transform(x, y, math.radians(degrees)), source)
            assert np.allclose(rows(answer["panels"][0]["newer"]), moved, rtol=0, atol=CLOSE)
            median = np.median(search.query(moved)[1])
            assert answer["numbers"] == {"median distance": f"{median:.3f} m"}
    p, q, w = newer.points, older.points[: len(newer)], np.linspace(0.0, 1.0, len(newer))
    for move, answer in zip(
        moves, shown(tmp_path, moves, "turn", source=p, target=q, weights=w), strict=True
    ):
        T = labkit.transform(*move[1:], math.radians(move[0]))
        cost = w @ ((labkit.apply(T, p) - q) ** 2).sum(axis=1)
        assert answer["numbers"] == {"cost J": f"{cost:.3f} m²"}


def test_an_outlier_pulls_by_its_weight(tmp_path):
    p = newer.points[::20]
    q = labkit.apply(TRUTH, p) + rng.normal(0.0, 0.02, p.shape)
    moves = [[1.0, 2.0], [0.3, 2.0], [0.0, 4.0], [1.0, 0.0]]
    given = {"source": p, "target": q, "truth": labkit.to_xytheta(TRUTH), "row": 4}
    for (weight, metres), answer in zip(
        moves, shown(tmp_path, moves, "outlier", **given), strict=True
    ):
        weights, spoilt = np.ones(len(p)), q.copy()
        weights[4], spoilt[4, 0] = weight, q[4, 0] + metres
        T = labkit.align(p, spoilt, weights)
        marks = answer["panels"][0]
        assert np.allclose(rows(marks["newer"]), labkit.apply(T, p), rtol=0, atol=CLOSE)
        assert np.allclose(marks["after"], weights @ spoilt / weights.sum(), rtol=0, atol=CLOSE)
        assert np.allclose(marks["before"], weights @ q / weights.sum(), rtol=0, atol=CLOSE)
        assert np.allclose(marks["stray"], [*labkit.apply(T, p)[4], *spoilt[4]], rtol=0, atol=CLOSE)
        assert len(marks["pair"]) == 4 * (len(p) - 1)
        moved = weight * metres / weights.sum()
        assert answer["numbers"] == {
            "centroid moves": f"{moved:.3f} m",
            "error of the motion": said(T),
        }


def search_cells(points, depth):
    """The cells of scipy's KD-tree after `depth` cuts: rows (left, low, right, high)."""

    def cut(node, low, high, depth):
        if depth == 0 or node.split_dim < 0:
            return [[*low, *high]]
        below, above = high.copy(), low.copy()
        below[node.split_dim] = above[node.split_dim] = node.split
        return cut(node.lesser, low, below, depth - 1) + cut(node.greater, above, high, depth - 1)

    tree = cKDTree(points, leafsize=1)
    low, high = np.asarray(tree.mins), np.asarray(tree.maxes)
    margin = 0.02 * float((high - low).max()) or 0.5
    return np.array(cut(tree.tree, low - margin, high + margin, depth))


@pytest.mark.parametrize("points", [older.points, lattice, np.ones((3, 2))])
def test_the_cells_of_a_tree_are_those_that_are_drawn(tmp_path, points):
    """Equal coordinates, too: a lattice is full of them, and one place cannot be cut."""
    moves = [[cuts, x, y] for cuts in range(8) for x, y in [(0.3, 0.9), (-4.0, 2.5)]]
    found = shown(tmp_path, moves, "cuts", target=points)
    for (cuts, x, y), answer in zip(moves, found, strict=True):
        marks, radius = answer["panels"][0], np.hypot(*(points - [x, y]).T).min()
        cells = search_cells(points, cuts)
        beyond = np.maximum(np.maximum(cells[:, :2] - [x, y], [x, y] - cells[:, 2:]), 0.0)
        to_open = cells[np.hypot(*beyond.T) <= radius]
        inside = (points[:, None] >= to_open[:, :2]) & (points[:, None] < to_open[:, 2:])
        looked = inside.all(axis=2).sum()
        assert np.allclose(np.reshape(marks["cell"], (-1, 4)), cells, rtol=0, atol=CLOSE)
        assert np.allclose(np.reshape(marks["open"], (-1, 4)), to_open, rtol=0, atol=CLOSE)
        assert marks["reach"][2] == pytest.approx(radius)
        share = math.floor(100 * looked / len(points) + 0.5)  # a half goes up
        assert answer["numbers"] == {
            "cells": f"{len(cells)}",
            "to open": f"{len(to_open)}",
            "points in them": f"{looked} of {len(points)} ({share} %)",
        }


def test_a_race_shows_both_runs_after_as_many_steps(tmp_path):
    target, parameters = labkit.Target(older), IcpParameters(overlap_ratio=0.9)
    found = shown(
        tmp_path,
        [[0], [2], [99]],
        "race",
        source=newer.points,
        target=target.points,
        normals=target.normals,
        truth=labkit.to_xytheta(TRUTH),
        parameters=parameters,
    )
    for panel, name in enumerate(["point-to-point", "point-to-line"]):
        metric = name.replace("-", "_")
        run = labkit.icp(newer, target, parameters=IcpParameters(overlap_ratio=0.9, metric=metric))
        assert 2 < run.iterations < 99
        for k, answer in zip((0, 2, run.iterations), found, strict=True):
            T = run.history[k].T_target_source
            moved = rows(answer["panels"][panel]["newer"])
            assert np.allclose(moved, labkit.apply(T, newer.points), rtol=0, atol=CLOSE)
            end = "" if k < run.iterations else f", the end after {k} steps"
            assert answer["numbers"][name] == f"{said(T)} off the truth{end}"

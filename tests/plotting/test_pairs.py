"""Every pair has one fate, as the masks say, and is one line in the look of its fate."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.correspondences import pairs_at
from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.plotting import plot_correspondences
from labkit.plotting.pairs import fates
from labkit.se2 import apply
from labkit.target import Target


@pytest.fixture(scope="module")
def first(lesson):
    """The association at the lesson's guess, where all four fates occur."""
    experiment = lesson.experiment
    points, target = experiment.source.points, Target(experiment.target)
    return pairs_at(points, target, experiment.T_init, lesson.parameters)


def test_fates_partition_the_pairs_as_the_masks_say(lesson, first):
    by_line = replace(lesson.parameters, metric="point_to_line")
    scans, T = lesson.experiment, lesson.experiment.T_init
    for pairs in (first, pairs_at(scans.source.points, Target(scans.target), T, by_line)):
        fate, full = fates(pairs), pairs.weights == 1.0
        gate, overlap = pairs.within_gate, pairs.within_overlap
        np.testing.assert_array_equal(fate == "gated", ~gate)
        np.testing.assert_array_equal(fate == "trimmed", gate & ~overlap)
        np.testing.assert_array_equal(fate == "no line", gate & overlap & ~pairs.kept)
        np.testing.assert_array_equal(fate == "down-weighted", pairs.kept & ~full)
        np.testing.assert_array_equal(fate == "kept", full)
    assert (fate == "no line").any()


def test_each_pair_is_one_line_of_its_fate(ax, lesson, first):
    assert plot_correspondences(ax, lesson.experiment.target, first) is ax
    assert ax.get_title() == f"{first.inlier_count} of 597 pairs are inliers"
    shown = ["gated", "trimmed", "down-weighted", "kept"]
    moved = apply(lesson.experiment.T_init, lesson.experiment.source.points)
    partner = lesson.experiment.target.points[first.target_index]
    for fate, line in zip(shown, ax.lines[1:], strict=True):
        chosen = fates(first) == fate
        assert chosen.any()
        ends = line.get_xydata().reshape(-1, 3, 2)
        np.testing.assert_allclose(ends[:, 0], moved[chosen], atol=1e-12)
        np.testing.assert_array_equal(ends[:, 1], partner[chosen])
        assert np.isnan(ends[:, 2]).all()
        assert line.get_markevery() == 3


def test_pairs_without_a_line_show_where_they_occur(ax, labels):
    grid = np.stack(np.meshgrid(np.arange(6.0), [0.0]), axis=-1).reshape(-1, 2)
    target = np.vstack([grid, [[40.0, 40.0]]])
    result = icp(target, target, parameters=IcpParameters(metric="point_to_line"))
    plot_correspondences(ax, target, result.correspondences)
    count = np.count_nonzero(fates(result.correspondences) == "no line")
    assert count > 0
    assert f"no line: {count}" in labels(ax)

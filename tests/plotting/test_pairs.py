"""Every pair has one fate, as the masks say, and is one line in the look of its fate."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.correspondences import pairs_at
from labkit.plotting import plot_correspondences
from labkit.plotting.pairs import fates
from labkit.se2 import apply
from labkit.target import Target


@pytest.fixture(scope="module", params=["point_to_point", "point_to_line"])
def pairs(lesson, request):
    """The association at the lesson's guess, where all fates of the metric occur."""
    parameters = replace(lesson.parameters, metric=request.param)
    points = lesson.experiment.source.points
    target = Target(lesson.experiment.target)
    return pairs_at(points, target, lesson.experiment.T_init, parameters)


def test_fates_partition_the_pairs_as_the_masks_say(pairs):
    fate = fates(pairs)
    gate, overlap, full_weight = pairs.within_gate, pairs.within_overlap, pairs.weights == 1.0

    np.testing.assert_array_equal(fate == "gated", ~gate)
    np.testing.assert_array_equal(fate == "trimmed", gate & ~overlap)
    np.testing.assert_array_equal(fate == "no line", gate & overlap & ~pairs.kept)
    np.testing.assert_array_equal(fate == "down-weighted", pairs.kept & ~full_weight)
    np.testing.assert_array_equal(fate == "kept", full_weight)


def test_each_pair_is_one_line_of_its_fate(ax, lesson, pairs):
    moved = apply(lesson.experiment.T_init, lesson.experiment.source.points)
    nearest = lesson.experiment.target.points[pairs.target_index]

    assert plot_correspondences(ax, lesson.experiment.target, pairs) is ax

    for line in ax.lines[1:]:
        chosen = fates(pairs) == line.get_label().partition(":")[0]
        from_source, to_target, gap = line.get_xydata().reshape(-1, 3, 2).swapaxes(0, 1)
        np.testing.assert_allclose(from_source, moved[chosen], atol=1e-12)
        np.testing.assert_array_equal(to_target, nearest[chosen])
        assert np.isnan(gap).all()
        assert line.get_markevery() == 3  # the source point


def test_the_legend_counts_each_fate(ax, labels, lesson, pairs):
    plot_correspondences(ax, lesson.experiment.target, pairs)

    names, counts = np.unique(fates(pairs), return_counts=True)
    expected = {f"{name}: {count}" for name, count in zip(names, counts, strict=True)}
    assert set(labels(ax)[1:]) == expected
    assert set(names) >= {"gated", "trimmed", "down-weighted", "kept"}
    assert ax.get_title() == f"{pairs.inlier_count} of 597 pairs are inliers"

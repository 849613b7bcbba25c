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
    points, target = lesson.experiment.source.points, Target(lesson.experiment.target)
    return pairs_at(points, target, lesson.experiment.T_init, parameters)


def test_fates_partition_the_pairs_as_the_masks_say(pairs):
    fate, full = fates(pairs), pairs.weights == 1.0
    gate, overlap = pairs.within_gate, pairs.within_overlap
    np.testing.assert_array_equal(fate == "gated", ~gate)
    np.testing.assert_array_equal(fate == "trimmed", gate & ~overlap)
    np.testing.assert_array_equal(fate == "no line", gate & overlap & ~pairs.kept)
    np.testing.assert_array_equal(fate == "down-weighted", pairs.kept & ~full)
    np.testing.assert_array_equal(fate == "kept", full)


def test_each_pair_is_one_line_of_its_fate(ax, labels, lesson, pairs):
    assert plot_correspondences(ax, lesson.experiment.target, pairs) is ax
    assert ax.get_title() == f"{pairs.inlier_count} of 597 pairs are inliers"
    moved = apply(lesson.experiment.T_init, lesson.experiment.source.points)
    partner = lesson.experiment.target.points[pairs.target_index]
    shown = [line.get_label().partition(":")[0] for line in ax.lines[1:]]
    assert set(shown) == set(fates(pairs)) >= {"gated", "trimmed", "down-weighted", "kept"}
    for fate, line in zip(shown, ax.lines[1:], strict=True):
        chosen = fates(pairs) == fate
        ends = line.get_xydata().reshape(-1, 3, 2)
        np.testing.assert_allclose(ends[:, 0], moved[chosen], atol=1e-12)
        np.testing.assert_array_equal(ends[:, 1], partner[chosen])
        assert np.isnan(ends[:, 2]).all()
        assert line.get_markevery() == 3
        assert f"{fate}: {np.count_nonzero(chosen)}" in labels(ax)

"""Every pair has one fate, and the fates agree with the masks."""

import numpy as np
import pytest

from labkit.arrays import homogeneous
from labkit.correspondences import Correspondences, distance_gate, overlap
from labkit.icp import icp
from labkit.line_alignment import line_rows
from labkit.plotting import Fate, fates
from labkit.registration import IcpParameters
from labkit.simulation import lesson_experiment

GATES = (0.02, 0.1, 0.5, np.inf)


def random_pairs(rng, count=200):
    """Masks in every combination, with `kept` and `weights` as ICP sets them."""
    distances = rng.uniform(0.0, 0.8, count)
    normals = np.stack([rng.random(count) < 0.6, np.zeros(count)])
    gate, ratio = rng.choice([0.3, 0.6], 2)
    kept = distance_gate(distances, gate) & overlap(distances, ratio) & normals.any(axis=0)
    return Correspondences(
        rows=line_rows(
            homogeneous(np.zeros((count, 2))), np.concatenate((-np.ones((2, count)), normals))
        ),
        center=np.zeros((2, 1)),
        target_points=-np.ones((1, 2)),
        gate=gate,
        overlap_ratio=ratio,
        huber_delta=0.2,
        target_index=np.zeros(count, dtype=np.intp),
        distances=distances,
        kept=kept,
        weights=np.where(kept, rng.choice([0.3, 1.0], count), 0.0),
    )


@pytest.mark.parametrize("seed", range(5))
def test_fates_partition_the_pairs_as_the_masks_say(seed):
    pairs = random_pairs(np.random.default_rng(seed))
    fate = fates(pairs)
    gate, overlap, full = pairs.within_gate, pairs.within_overlap, pairs.weights == 1.0
    np.testing.assert_array_equal(fate == Fate.GATED, ~gate)
    np.testing.assert_array_equal(fate == Fate.TRIMMED, gate & ~overlap)
    np.testing.assert_array_equal(fate == Fate.NO_LINE, gate & overlap & ~pairs.kept)
    np.testing.assert_array_equal(fate == Fate.DOWN_WEIGHTED, pairs.kept & ~full)
    np.testing.assert_array_equal(fate == Fate.KEPT, full)
    assert sum(np.count_nonzero(fate == each) for each in Fate) == len(fate)


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("metric", ["point_to_point", "point_to_line"])
def test_the_two_kept_fates_are_the_inliers(gate, metric):
    experiment = lesson_experiment()
    parameters = IcpParameters(max_correspondence_distance=gate, metric=metric, max_iterations=2)
    result = icp(experiment.source, experiment.target, experiment.T_init, parameters)
    fate = fates(result.correspondences)
    kept = np.count_nonzero((fate == Fate.DOWN_WEIGHTED) | (fate == Fate.KEPT))
    assert kept == result.inlier_count
    if metric == "point_to_point":
        assert not (fate == Fate.NO_LINE).any()
    if gate == np.inf:
        assert not (fate == Fate.GATED).any()


def test_labels_are_words():
    words = ["gated", "trimmed", "no line", "down-weighted", "kept"]
    assert [fate.label for fate in Fate] == words

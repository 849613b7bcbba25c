"""Absolute and relative errors against evo, the field's own evaluation package."""

import numpy as np
import pytest

from labkit.evaluation import ate, rpe
from labkit.odometry import integrate
from labkit.se2 import from_xytheta

pytest.importorskip("evo", reason="evo is the oracle of this module")

from evo.core.metrics import APE, RPE, PoseRelation
from evo.core.trajectory import PosePath3D
from evo.core.units import Unit

RELATIONS = {
    "translation_errors": PoseRelation.translation_part,
    "rotation_errors": PoseRelation.rotation_angle_rad,
}
UNITS = {"steps": Unit.frames, "metres": Unit.meters}
STATISTICS = ["mean", "std", "median", "p95", "max", "rmse"]


def trajectories(seed, length=120):
    """An estimate and its reference, poses (length, 3), each in a world frame of its own."""
    rng = np.random.default_rng(seed)
    increments = rng.normal([0.4, 0.0, 0.05], [0.2, 0.05, 0.3], (length, 3))
    noise = rng.normal(0.0, 0.03, increments.shape)
    estimate = integrate(increments + noise, start=[3.0, -2.0, 1.0])
    return estimate, integrate(increments, start=[-1.0, 4.0, 2.0])


def as_path(poses):
    """The same poses in space: z = 0 and a turn about z."""
    T = from_xytheta(poses)
    T_space = np.tile(np.eye(4), (len(poses), 1, 1))
    T_space[:, :2, :2] = T[:, :2, :2]
    T_space[:, :2, 3] = T[:, :2, 2]
    return PosePath3D(poses_se3=list(T_space))


def assert_same(errors, name, metric):
    summary = errors.translation if name == "translation_errors" else errors.rotation
    expected = metric.get_all_statistics() | {"p95": np.percentile(metric.error, 95.0)}

    np.testing.assert_allclose(getattr(errors, name), metric.error, rtol=0, atol=1e-9)
    for statistic in STATISTICS:
        assert getattr(summary, statistic) == pytest.approx(expected[statistic], abs=1e-9)


@pytest.mark.parametrize("name", RELATIONS)
@pytest.mark.parametrize("align", ["rigid", "origin", None])
@pytest.mark.parametrize("seed", range(2))
def test_absolute_errors(seed, align, name):
    estimate, reference = trajectories(seed)
    path, truth = as_path(estimate), as_path(reference)
    if align == "rigid":
        path.align(truth)
    elif align == "origin":
        path.align_origin(truth)
    metric = APE(RELATIONS[name])
    metric.process_data((truth, path))

    assert_same(ate(estimate, reference, align), name, metric)


@pytest.mark.parametrize("name", RELATIONS)
@pytest.mark.parametrize(
    ("delta", "unit"), [(1, "steps"), (7, "steps"), (1.0, "metres"), (5.0, "metres")]
)
@pytest.mark.parametrize("seed", range(2))
def test_relative_errors(seed, delta, unit, name):
    estimate, reference = trajectories(seed)
    metric = RPE(RELATIONS[name], delta, UNITS[unit], all_pairs=True, pairs_from_reference=True)
    metric.process_data((as_path(reference), as_path(estimate)))

    errors = rpe(estimate, reference, delta, unit)

    np.testing.assert_array_equal(errors.pairs[:, 1], metric.delta_ids)
    assert_same(errors, name, metric)

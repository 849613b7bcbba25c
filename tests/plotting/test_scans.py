"""Every point of both scans is drawn."""

import numpy as np
import pytest

from labkit.icp import icp
from labkit.plotting import plot_scans
from labkit.scan import Scan
from labkit.se2 import apply, transform

SOURCE = np.array([[0.0, 1.0], [2.0, 1.0], [2.0, 3.0]])
TARGET = np.array([[0.0, 0.9], [2.1, 1.0]])


@pytest.mark.parametrize("make", [np.asarray, np.ndarray.tolist, Scan.from_points])
@pytest.mark.parametrize("T_target_source", [np.eye(3), transform(1.0, -2.0, 0.7)])
def test_the_source_lies_where_the_transform_puts_it(ax, make, T_target_source):
    assert plot_scans(ax, make(SOURCE), make(TARGET), T_target_source) is ax

    target, source = ax.lines
    np.testing.assert_allclose(source.get_xydata(), apply(T_target_source, SOURCE))
    np.testing.assert_array_equal(target.get_xydata(), TARGET)


def test_without_a_transform_the_source_stays(ax):
    plot_scans(ax, SOURCE, TARGET)

    np.testing.assert_array_equal(ax.lines[1].get_xydata(), SOURCE)
    assert ax.get_title() == "Scans as measured"


def test_a_result_stands_for_its_scans_and_its_estimate(ax):
    result = icp(SOURCE, TARGET, max_correspondence_distance=5.0)
    plot_scans(ax, result)
    target, source = ax.lines
    np.testing.assert_allclose(source.get_xydata(), apply(result.T_target_source, SOURCE))
    np.testing.assert_array_equal(target.get_xydata(), TARGET)

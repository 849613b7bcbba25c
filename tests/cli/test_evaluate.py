"""``labkit evaluate``: a trajectory against a reference."""

import json

import numpy as np
import pytest

from labkit.logs import write_tum


@pytest.fixture
def trajectories(tmp_path):
    """A circle of 20 m radius, and the same with a known error in its second half."""
    angle = np.linspace(0.0, 3.0, 100)
    reference = np.column_stack([20 * np.sin(angle), 20 - 20 * np.cos(angle), angle])
    estimate = reference.copy()
    estimate[50:, 0] += 0.5
    write_tum(tmp_path / "reference.tum", np.arange(100.0), reference)
    write_tum(tmp_path / "estimate.tum", np.arange(100.0) + 0.001, estimate)
    return reference


def test_json_in_metres_and_radians(run, trajectories):
    status, out, err = run("evaluate", "estimate.tum", "--reference", "reference.tum")
    assert (status, err) == (0, "")
    assert "100 of 100 poses have a partner" in out
    assert "estimate, RPE over 10 m" in out
    _, out, _ = run("evaluate", "estimate.tum", "--reference", "reference.tum", "--json")
    step = json.loads(out)["estimate, RPE a step"]
    assert step["translation_m"]["count"] == 99
    assert step["translation_m"]["max"] == pytest.approx(0.5)
    assert step["rotation_rad"]["max"] < 1e-12


@pytest.mark.parametrize("turn", [0.0, 0.1])
def test_a_robot_that_stays_in_its_place_has_errors(run, tmp_path, turn):
    reference = np.array([[2.0, 1.0, turn * k] for k in range(10)])
    estimate = reference + [[0.0, 0.0, 0.02 * k] for k in range(10)]
    write_tum(tmp_path / "reference.tum", np.arange(10.0), reference)
    write_tum(tmp_path / "estimate.tum", np.arange(10.0), estimate)
    status, out, err = run("evaluate", "estimate.tum", "--reference", "reference.tum", "--json")
    errors = json.loads(out)
    assert (status, err) == (0, "")
    assert errors["estimate, RPE a step"]["rotation_rad"]["median"] == pytest.approx(0.02)
    assert errors["estimate, ATE, first poses aligned"]["rotation_rad"]["max"] == pytest.approx(
        0.18
    )
    assert errors["estimate, ATE, first poses aligned"]["translation_m"]["max"] < 1e-12


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("reference.tum", "1.0 2.0\n", "reference.tum:1: "),
        ("reference.tum", "900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n", "share 0 stamps within"),
        ("estimate.tum", "", "empty"),
    ],
)
def test_files_that_do_not_fit(run, trajectories, tmp_path, file, content, message):
    (tmp_path / file).write_text(content)
    status, out, err = run("evaluate", "estimate.tum", "--reference", "reference.tum")
    assert (status, out) == (1, "")
    assert message in err

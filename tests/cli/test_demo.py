"""``labkit demo``: the lesson's numbers, and the pictures on request."""

import re

import pytest


def test_the_lesson_s_numbers(run):
    status, out, err = run("demo")
    assert (status, err) == (0, "")
    assert "truth       t = (0.3500, 0.1000) m, theta = 6.000 deg" in out
    assert "estimate    t = (0.3496, 0.1008) m, theta = 6.011 deg" in out
    assert "iterations  25 (converged" in out
    assert "over 507 inliers, 0.1283 m over all 597 points" in out


def test_a_parameter_changes_the_estimate(run):
    estimate = [
        re.search(r"estimate.*", run("demo", *more)[1])[0] for more in ((), ("--overlap", 1))
    ]
    assert estimate[0] != estimate[1]


def test_a_failed_match_says_why(run):
    status, out, _ = run("demo", "--gate", "1e-6")
    assert status == 1
    assert out.startswith("failed: fewer than 3 correspondences are left")


def test_pictures(run, tmp_path):
    status, _, _ = run("demo", "--plot", "scans.png", "--animate", "run.gif")
    assert status == 0
    assert (tmp_path / "scans.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "run.gif").read_bytes().startswith(b"GIF8")


def test_an_unwritable_picture(run):
    status, _, err = run("demo", "--plot", "no/such/folder/scans.png")
    assert status == 1
    assert "cannot write no/such/folder/scans.png: the directory" in err


@pytest.mark.parametrize(
    ("option", "name", "kinds"),
    [
        ("--plot", "scans.xyz", "a figure's name must end in .png, .pdf or .svg"),
        ("--animate", "run.mp4", "an animation's name must end in .gif or .html"),
    ],
)
def test_an_unknown_kind_of_picture_is_refused_before_the_work(run, tmp_path, option, name, kinds):
    status, out, err = run("demo", option, name)
    assert (status, out) == (2, "")
    assert err == f"labkit demo: {kinds}, got {name!r}\n"
    assert list(tmp_path.iterdir()) == []

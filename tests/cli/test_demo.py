"""``labkit demo``: the lesson's numbers."""

import re


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

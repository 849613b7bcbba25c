"""``labkit demo``: the lesson's numbers, until a parameter is another."""


def test_the_lesson_s_numbers(run):
    status, out, err = run("demo")
    assert (status, err) == (0, "")
    assert "truth       t = (0.3500, 0.1000) m, theta = 6.000 deg" in out
    estimate = "estimate    t = (0.3496, 0.1008) m, theta = 6.011 deg"
    assert estimate in out
    assert "iterations  25 (converged" in out
    assert "over 507 inliers, 0.1283 m over all 597 points" in out
    assert estimate not in run("demo", "--overlap", 1)[1]

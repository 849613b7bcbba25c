"""The curves of a run, its end in words, and what a log scale cannot hold."""

import numpy as np

from labkit.icp import icp
from labkit.plotting import book_figure, plot_convergence
from labkit.se2 import apply, invert, transform


def drawn(result):
    """The axes of the cost and of the steps, below one another."""
    upper, lower = book_figure().subplots(2, 1, sharex=True)
    assert plot_convergence(upper, result, lower) is upper
    upper.figure.draw_without_rendering()
    return upper, lower


def test_the_curves_are_the_history(lesson, labels):
    upper, lower = drawn(lesson.result)
    history = lesson.result.history
    names = ("cost", "translation_step", "rotation_step")
    for line, name in zip([*upper.lines, *lower.lines], names, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), range(len(history)))
        np.testing.assert_array_equal(line.get_ydata(), [getattr(each, name) for each in history])
    assert (upper.get_yscale(), lower.get_yscale()) == ("log", "log")
    assert labels(lower) == ["translation step", "rotation step"]


def test_what_is_as_good_as_zero_does_not_stretch_the_scale():
    target = np.random.default_rng(0).uniform(0.0, 5.0, (100, 2))
    result = icp(apply(invert(transform(0.05, -0.02, 0.01)), target), target)
    cost = np.array([each.cost for each in result.history])
    assert cost.min() < 1e-7 * cost.max()
    assert drawn(result)[0].get_ylim()[0] == 1e-7 * cost.max()


def test_a_run_that_failed_at_the_guess():
    upper, _ = drawn(icp([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[90.0, 90.0]]))
    assert upper.get_title().startswith("0 iterations\nfailed: fewer than 3")

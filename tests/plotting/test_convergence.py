"""The curves of a run, its end in words, and what a log scale cannot hold."""

import numpy as np

from labkit.icp import icp
from labkit.plotting import book_figure, plot_convergence
from labkit.se2 import apply, invert, transform


def test_the_curves_are_the_history(ax, lesson):
    assert plot_convergence(ax, lesson.result) is ax
    history = lesson.result.history
    cost = ax.lines[0]
    np.testing.assert_array_equal(cost.get_xdata(), range(len(history)))
    np.testing.assert_array_equal(cost.get_ydata(), [each.cost for each in history])
    steps = ax.figure.axes[1]
    for line, name in zip(steps.lines[:2], ("translation_step", "rotation_step"), strict=True):
        values = np.array([getattr(each, name) for each in history])
        large = values > 1e-6
        np.testing.assert_array_equal(line.get_ydata()[large], values[large])
    assert (ax.get_yscale(), steps.get_yscale()) == ("log", "log")


def test_steps_go_to_an_axes_of_their_own(lesson):
    figure = book_figure()
    upper, lower = figure.subplots(2, 1, sharex=True)
    plot_convergence(upper, lesson.result, lower)
    assert figure.axes == [upper, lower]
    assert [line.get_label() for line in upper.lines] == ["cost J"]
    assert [line.get_label() for line in lower.lines[:2]] == ["translation step", "rotation step"]


def test_what_is_as_good_as_zero_stands_at_the_foot(ax, labels):
    target = np.random.default_rng(0).uniform(0.0, 5.0, (100, 2))
    source = apply(invert(transform(0.05, -0.02, 0.01)), target)
    result = icp(source, target)
    cost = np.array([each.cost for each in result.history])
    tiny = cost < 1e-7 * cost.max()
    assert tiny.any()
    plot_convergence(ax, result)
    line, foot = ax.lines
    np.testing.assert_array_equal(foot.get_xdata(), np.flatnonzero(tiny))
    assert np.ptp(foot.get_ydata()) == 0.0
    assert line.get_ydata().min() == foot.get_ydata()[0] > 0.0
    assert "cost below the scale" in labels(ax)


def test_a_run_that_failed_at_the_guess(ax):
    result = icp([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[90.0, 90.0]])
    plot_convergence(ax, result)
    assert ax.get_title().startswith("0 iterations\nfailed: fewer than 3")
    assert len(ax.figure.axes[1].get_yticks()) == 0
    ax.figure.draw_without_rendering()

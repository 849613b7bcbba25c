"""The curves of a run, its end in words, and what a log scale cannot hold."""

import numpy as np
import pytest

from labkit.icp import icp
from labkit.plotting import book_figure, plot_convergence
from labkit.se2 import apply, invert, transform


def draw(result):
    """Axes of the cost and of the steps, below one another."""
    cost_ax, step_ax = book_figure().subplots(2, 1, sharex=True)
    assert plot_convergence(cost_ax, result, step_ax) is cost_ax
    cost_ax.figure.draw_without_rendering()
    return cost_ax, step_ax


@pytest.fixture(scope="module")
def drawn(lesson):
    return draw(lesson.result)


@pytest.mark.parametrize(
    ("panel", "line", "name"),
    [(0, 0, "cost"), (1, 0, "translation_step"), (1, 1, "rotation_step")],
)
def test_the_curves_are_the_history(lesson, drawn, panel, line, name):
    history = lesson.result.history
    curve = drawn[panel].lines[line]

    np.testing.assert_array_equal(curve.get_xdata(), range(len(history)))
    np.testing.assert_array_equal(curve.get_ydata(), [getattr(step, name) for step in history])


def test_scales_are_logarithmic_and_steps_have_a_legend(drawn, labels):
    cost_ax, step_ax = drawn

    assert (cost_ax.get_yscale(), step_ax.get_yscale()) == ("log", "log")
    assert len(cost_ax.lines) == 1
    assert labels(step_ax) == ["translation step", "rotation step"]


def test_what_is_as_good_as_zero_does_not_stretch_the_scale():
    target = np.random.default_rng(0).uniform(0.0, 5.0, (100, 2))
    result = icp(apply(invert(transform(0.05, -0.02, 0.01)), target), target)
    cost = np.array([step.cost for step in result.history])

    cost_ax, _ = draw(result)

    assert cost.min() < 1e-7 * cost.max()
    assert cost_ax.get_ylim()[0] == 1e-7 * cost.max()


def test_a_run_that_failed_at_the_guess():
    result = icp([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[90.0, 90.0]])
    cost_ax, _ = draw(result)
    assert cost_ax.get_title().startswith("0 iterations\nfailed: fewer than 3")

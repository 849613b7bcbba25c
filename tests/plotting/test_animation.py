"""One frame for the guess and one for each iteration."""

import numpy as np
import pytest
from PIL import Image

from labkit.errors import InvalidParameterError
from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.plotting import animate_icp, animation_html, save_animation
from labkit.se2 import apply

SHORT = IcpParameters(max_iterations=3)


@pytest.fixture(scope="module")
def short(lesson):
    """Three iterations of the lesson's run: source, target, result."""
    experiment = lesson.experiment
    result = icp(experiment.source, experiment.target, experiment.T_init, SHORT)
    return experiment.source, experiment.target, result


@pytest.fixture
def animate(short):
    """A function that animates the short run, and ends what it began."""
    made = []

    def make(fates=False):
        made.append(animate_icp(short[2], fates=fates))
        return made[-1]

    yield make
    for animation in made:
        animation._draw_was_started = True  # else matplotlib warns that nobody looked


def test_each_frame_shows_the_source_at_its_iteration(short, animate):
    source, _, result = short
    animation = animate()
    plane, cost = animation._fig.axes
    for k, iteration in enumerate(result.history):
        animation._func(k)
        moved = apply(iteration.T_target_source, source.points)
        np.testing.assert_array_equal(plane.lines[1].get_xydata(), moved)
        assert len(cost.lines[1].get_xdata()) == k + 1
        at = f"iteration {k} of 3" if k else "initial guess"
        assert plane.get_title() == f"{at}: J = {iteration.cost:.3g} m²"
        assert (moved > [plane.get_xlim()[0], plane.get_ylim()[0]]).all()
        assert (moved < [plane.get_xlim()[1], plane.get_ylim()[1]]).all()


def test_with_fates_each_frame_counts_the_pairs(short, animate, labels):
    _, _, result = short
    animation = animate(fates=True)
    plane = animation._fig.axes[0]
    for k, iteration in enumerate(result.history):
        animation._func(k)
        count = dict(label.split(": ") for label in labels(plane)[1:])
        assert int(count["kept"]) + int(count["down-weighted"]) == iteration.inlier_count
        assert sum(map(int, count.values())) == len(short[0])


def test_with_fates_a_frame_from_afar_shows_what_was_looked_at(lesson, labels):
    experiment = lesson.experiment
    source, target, guess = experiment.source, experiment.target, experiment.T_init
    result = icp(source, target, guess, IcpParameters(approach=True, huber_delta=0.02))
    animation = animate_icp(result, fates=True)
    animation._draw_was_started = True
    assert result.history[0].far
    assert not result.history[-1].far
    for k, points in ((0, 150), (result.iterations, 597)):
        animation._func(k)
        counts = [label.split(": ")[1] for label in labels(animation._fig.axes[0])[1:]]
        assert sum(map(int, counts)) == points


def test_axes_have_units_and_are_equal(animate):
    plane, cost = animate()._fig.axes
    assert plane.get_aspect() == 1.0
    assert (plane.get_xlabel(), plane.get_ylabel()) == ("x [m]", "y [m]")
    assert (cost.get_xlabel(), cost.get_ylabel()) == ("iteration", "cost J [m²]")


def test_a_gif_has_a_frame_for_the_guess_and_each_iteration(short, animate, tmp_path):
    path = save_animation(animate(fates=True), tmp_path / "run.gif")
    assert path.read_bytes().startswith(b"GIF89a")
    with Image.open(path) as image:
        assert image.n_frames == short[2].iterations + 1 == 4
        assert image.size == (700, 640)
    assert list(tmp_path.iterdir()) == [path]


def test_html_has_every_frame_and_asks_nothing_of_the_network(animate, tmp_path):
    html = save_animation(animate(), tmp_path / "run.html").read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert html.count("data:image/png;base64") == 4
    assert "http" not in html
    assert "fa-" not in html
    assert "▶" in html


def test_a_piece_of_html_is_no_page(animate):
    assert "<!DOCTYPE" not in animation_html(animate())


def test_a_run_that_failed_shows_its_guess(tmp_path):
    source, target = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[90.0, 90.0]]
    animation = animate_icp(icp(source, target))
    with Image.open(save_animation(animation, tmp_path / "failed.gif")) as image:
        assert getattr(image, "n_frames", 1) == 1


def test_bad_input(short):
    with pytest.raises(InvalidParameterError, match=r"`interval` must be in \[1, inf\] ms, got 0"):
        animate_icp(short[2], interval=0)


@pytest.mark.parametrize("fps", [0, -1.0, 101.0])
def test_frames_per_second(animate, tmp_path, fps):
    with pytest.raises(InvalidParameterError, match=r"`fps` must be in \(0, 100\], got"):
        save_animation(animate(), tmp_path / "run.gif", fps=fps)
    assert not list(tmp_path.iterdir())

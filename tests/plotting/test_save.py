"""Files: valid, whole, and an error of labkit where there can be none."""

import pytest
from PIL import Image

from labkit.errors import InvalidParameterError
from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.plotting import animate_icp, book_figure, plot_scans, save_animation, save_figure

SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".pdf": b"%PDF-", ".svg": b"<?xml", ".PNG": b"\x89PNG"}


@pytest.fixture
def figure():
    figure = book_figure(3.0)
    plot_scans(figure.subplots(), [[0.0, 1.0], [4.0, 2.0]], [[0.0, 0.9], [4.1, 2.1]])
    return figure


@pytest.fixture(scope="module")
def run(lesson):
    """Three iterations of the lesson's run."""
    known = lesson.experiment
    return icp(known.source, known.target, known.T_init, IcpParameters(max_iterations=3))


@pytest.mark.parametrize(("suffix", "signature"), SIGNATURES.items())
def test_the_suffix_says_the_format(figure, tmp_path, suffix, signature):
    path = tmp_path / f"figure{suffix}"
    save_figure(figure, path)
    assert path.read_bytes().startswith(signature)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("save", "name", "known"),
    [
        (save_figure, "figure.bmp", r"a figure's name must end in \.png, \.pdf or \.svg"),
        (save_figure, ".png", r"a figure's name"),
        (save_animation, "run.mp4", r"an animation's name must end in \.gif or \.html"),
    ],
)
def test_an_unknown_suffix(tmp_path, save, name, known):
    with pytest.raises(InvalidParameterError, match=rf"{known}.* got '.*{name}'"):
        save(None, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_what_fails_leaves_the_older_file(figure, tmp_path):
    path = tmp_path / "figure.png"
    save_figure(figure, path)
    before = path.read_bytes()
    figure.axes[0].set_title(r"$\frac{broken$")
    with pytest.raises(ValueError, match="broken"):
        save_figure(figure, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_each_frame_shows_the_source_at_its_iteration(run, tmp_path):
    path = tmp_path / "run.gif"
    shown = []
    save_animation(animate_icp(run), path)
    with Image.open(path) as image:
        assert image.n_frames == run.iterations + 1 == 4
        for k in range(image.n_frames):
            image.seek(k)
            shown.append(image.convert("RGB").tobytes())
    assert len(set(shown)) == 4


def test_html_has_every_frame_and_asks_nothing_of_the_network(run, tmp_path):
    path = tmp_path / "run.html"
    save_animation(animate_icp(run), path)
    html = path.read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert html.count("data:image/png;base64") == 4
    assert "http" not in html
    assert "fa-" not in html
    assert "▶" in html


def test_a_run_that_failed_shows_its_guess(tmp_path):
    failed = icp([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[90.0, 90.0]])
    save_animation(animate_icp(failed), tmp_path / "failed.gif")
    with Image.open(tmp_path / "failed.gif") as image:
        assert getattr(image, "n_frames", 1) == 1

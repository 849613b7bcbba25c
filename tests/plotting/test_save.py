"""Files: valid, whole, and an error of labkit where there can be none."""

import pytest
from PIL import Image

from labkit.errors import InvalidParameterError, LabkitError
from labkit.plotting import book_figure, plot_scans, save_animation, save_figure

SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".pdf": b"%PDF-", ".svg": b"<?xml", ".PNG": b"\x89PNG"}


@pytest.fixture
def figure():
    figure = book_figure(3.0)
    plot_scans(figure.subplots(), [[0.0, 1.0], [4.0, 2.0]], [[0.0, 0.9], [4.1, 2.1]])
    return figure


@pytest.mark.parametrize(("suffix", "signature"), SIGNATURES.items())
def test_the_suffix_says_the_format(figure, tmp_path, suffix, signature):
    path = tmp_path / f"figure{suffix}"
    assert save_figure(figure, path) == path
    assert path.read_bytes().startswith(signature)
    assert list(tmp_path.iterdir()) == [path]


def test_a_png_has_the_dots_it_was_asked_for(figure, tmp_path):
    sizes = []
    for dpi in (50, 100):
        with Image.open(save_figure(figure, tmp_path / "figure.png", dpi=dpi)) as image:
            image.verify()
            sizes.append(image.width)
    assert sizes[1] == pytest.approx(2 * sizes[0], abs=2)


@pytest.mark.parametrize("name", ["figure.bmp", "figure", "figure.png.gif", ".png"])
def test_an_unknown_suffix(figure, tmp_path, name):
    message = r"a figure's name must end in \.png, \.pdf or \.svg, got '.*"
    with pytest.raises(InvalidParameterError, match=message + name):
        save_figure(figure, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_an_unknown_suffix_of_an_animation(tmp_path):
    message = r"an animation's name must end in \.gif or \.html, got '.*run\.mp4'"
    with pytest.raises(InvalidParameterError, match=message):
        save_animation(None, tmp_path / "run.mp4")


@pytest.mark.parametrize("dpi", [0.0, -1.0, float("nan"), 1e9])
def test_dots_per_inch(figure, tmp_path, dpi):
    with pytest.raises(InvalidParameterError, match=r"`dpi` must be in \(0, 2400\], got"):
        save_figure(figure, tmp_path / "figure.png", dpi=dpi)


def test_no_such_folder(figure, tmp_path):
    path = tmp_path / "nowhere" / "figure.png"
    with pytest.raises(LabkitError, match=r"cannot write .*figure\.png: the directory .* does not"):
        save_figure(figure, path)


def test_a_folder_in_the_way(figure, tmp_path):
    (tmp_path / "figure.png").mkdir()
    with pytest.raises(LabkitError, match="it is a directory; name a file in it"):
        save_figure(figure, tmp_path / "figure.png")


def test_what_fails_leaves_the_older_file(figure, tmp_path, monkeypatch):
    path = save_figure(figure, tmp_path / "figure.png")
    before = path.read_bytes()

    def break_off(file, **_):
        file.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(figure, "savefig", break_off)
    with pytest.raises(KeyboardInterrupt):
        save_figure(figure, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]

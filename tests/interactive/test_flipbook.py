"""Flip books: every value drawn, and the slider tied to its picture without Python."""

import base64
import io
import re

import pytest
from PIL import Image

from labkit.errors import InvalidParameterError

ipywidgets = pytest.importorskip("ipywidgets")

from labkit.interactive import flipbook  # noqa: E402


def bars(figure, height):
    figure.subplots().bar([0], [height])


def book(values=(1.0, 2.0, 3.0), **options):
    return flipbook(bars, values, label="height [m]", alt='one "bar"', **options)


def picture(page):
    encoded = re.search(r"base64,([^\"]+)", page.value)[1]
    return Image.open(io.BytesIO(base64.b64decode(encoded)))


def test_each_value_is_drawn_once_and_in_order():
    drawn = []
    flipbook(lambda figure, value: drawn.append(value), [3, 1, 2], label="n", alt="nothing")
    assert drawn == [3, 1, 2]


def test_the_values_may_come_from_a_generator():
    slider, pages = book(height / 2.0 for height in (1, 2, 3)).children
    assert (len(slider.options), len(pages.children)) == (3, 3)


def test_pictures_have_the_book_s_shape_and_differ():
    _, pages = book(height=2.0).children
    pictures = [picture(page) for page in pages.children]
    assert {each.size for each in pictures} == {(1050, 300)}
    assert len({each.convert("RGB").tobytes() for each in pictures}) == 3


def test_slider_and_pages_are_linked_in_the_browser():
    slider, pages = book(start=1).children
    assert (slider.index, pages.selected_index) == (1, 1)
    links = [w for w in ipywidgets.widgets.widget._instances.values() if hasattr(w, "source")]
    assert any(
        isinstance(link, ipywidgets.widgets.widget_link.Link)
        and link.source == (slider, "index")
        and link.target == (pages, "selected_index")
        for link in links
    )


def test_words_for_those_who_cannot_see():
    _, pages = book(readout="{:.0f} m".format).children
    assert 'alt="one &quot;bar&quot;; height [m]: 2 m"' in pages.children[1].value


def test_the_slider_shows_the_readout():
    slider, _ = book(readout="{:.1f}".format).children
    slider.index = 2
    assert slider.label == "3.0"


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 1.0]])
def test_values_that_make_no_slider_are_refused(values):
    with pytest.raises(InvalidParameterError, match="at least two that read differently, got"):
        book(values)


@pytest.mark.parametrize("start", [-1, 3])
def test_start_outside_the_values_is_refused(start):
    with pytest.raises(InvalidParameterError, match=f"index of the 3 values, got {start}"):
        book(start=start)

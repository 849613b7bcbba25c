"""Flip books: every value drawn once, and one slider over all of them."""

import base64
import io

import pytest
from PIL import Image

from labkit.support.errors import InvalidParameterError

pytest.importorskip("anywidget")

from labkit.interactive import flipbook


def bars(figure, height):
    figure.subplots().bar([0], [height])


def book(values=(1.0, 2.0, 3.0), **options):
    return flipbook(bars, values, label="height [m]", alt='one "bar"', **options)


def picture(encoded):
    return Image.open(io.BytesIO(base64.b64decode(encoded)))


def test_it_opens_at_its_start_and_says_its_values():
    made = book((height / 2.0 for height in (1, 2, 3)), start=1)
    assert (made.index, made.readouts, len(made.pictures)) == (1, ["0.5", "1.0", "1.5"], 3)
    assert (made.label, made.alt) == ("height [m]", 'one "bar"')
    with pytest.raises(InvalidParameterError, match="index of the 3 values, got -1"):
        book(start=-1)


def test_pictures_have_the_book_s_shape_and_differ():
    made = book(height=2.0)
    pictures = [picture(each) for each in made.pictures]
    assert {each.size for each in pictures} == {(1050, 300)}
    assert made.size == {"width": 1050, "height": 300}
    assert len({each.convert("RGB").tobytes() for each in pictures}) == 3
    with pytest.raises(InvalidParameterError, match="index of the 3 values, got 3"):
        made.index = 3


@pytest.mark.parametrize("values", [[], [1.0, 1.0]])
def test_values_that_make_no_slider_are_refused(values):
    with pytest.raises(InvalidParameterError, match="at least two that read differently, got"):
        book(values)

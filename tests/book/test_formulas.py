"""Formulas are drawn while the book is built."""

from __future__ import annotations

import re

import formulas
import pytest

BODY = (
    '<p>Near <span class="math notranslate nohighlight">\\(a &lt; b_k\\)</span>:</p>'
    '<div class="amsmath math notranslate nohighlight" id="equation-1">\n'
    "\\[{}\\]</div>\n"
)


@pytest.fixture(scope="module")
def pen():
    return formulas.Pen()


def test_a_formula_becomes_a_drawing_with_mathml_and_the_shapes_it_needs(pen):
    body = formulas.draw_all(BODY.format(r"b \tag{2.1}"), "page", pen)
    assert 'data-tex="a &lt; b_k"><svg' in body
    assert "<mi>a</mi><mo>&lt;</mo><msub><mi>b</mi><mi>k</mi></msub>" in body
    assert '<span class="eqno">(2.1)</span><svg' in body
    assert '<p>Near <span class="unbroken"><span class="math' in body
    assert "</span>:</span></p>" in body
    assert not re.search(r"\\[([]", body)
    shapes = set(re.findall(r'<path id="([^"]+)" d="M', body))
    assert shapes == set(formulas.USED.findall(body))
    assert len(shapes) == 4  # a < b k; the b is drawn twice, its number not at all


def test_an_unknown_macro_is_a_warning_that_names_page_and_formula(pen, monkeypatch):
    told = []
    monkeypatch.setattr(
        formulas.log, "warning", lambda *said, location: told.append([*said, location])
    )
    page, tex = "notebooks/02_alignment", r"\mathbff{T}"
    body = formulas.draw_all(BODY.format(tex), page, pen)
    ((text, error, formula, place),) = told
    assert text == "%s in the formula %s"
    assert (str(error), formula, place) == (r"Undefined control sequence \mathbff", tex, page)
    assert tex in re.sub("<[^>]*>", "", body)

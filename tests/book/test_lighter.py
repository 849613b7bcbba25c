"""The state of a page's widgets says each module once, and can stand in a script."""

import json

import pytest
from lighter import say_once, with_size
from PIL import Image

MODULE = "export const end = '</script>';"


def test_a_module_stands_once_and_ends_no_script():
    widgets = {name: {"state": {"_esm": MODULE, "_css": "p {}", "x": 1.5}} for name in "ab"}

    script = say_once(json.dumps({"state": widgets}))

    assert "</" not in script
    page_state = json.loads(script)
    assert sorted(page_state["texts"].values()) == sorted([MODULE, "p {}"])
    for widget in page_state["state"].values():
        assert page_state["texts"][widget["state"]["_esm"]] == MODULE
        assert widget["state"]["x"] == 1.5


def test_the_state_of_a_page_that_an_earlier_build_wrote_stays():
    script = say_once(json.dumps({"state": {"a": {"state": {"_esm": MODULE}}}}))

    assert say_once(script) == script


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("drawn.svg", '<img width="66" height="56" alt="a" src="../_images/drawn.svg">'),
        ("seen.webp", '<img width="4" height="3" alt="a" src="../_images/seen.webp">'),
        ("points.svg", '<img width="30" height="16" alt="a" src="../_images/points.svg">'),
        ("inches.svg", '<img alt="a" src="../_images/inches.svg">'),
    ],
)
def test_a_picture_says_its_size_where_its_file_does(tmp_path, name, expected):
    (tmp_path / "drawn.svg").write_text('<svg viewBox="0 0 9 9" width="66" height="56">', "utf-8")
    (tmp_path / "points.svg").write_text('<svg width="22.5pt" height="12pt">', "utf-8")
    (tmp_path / "inches.svg").write_text('<svg width="2in" height="1in">', "utf-8")
    Image.new("L", (4, 3)).save(tmp_path / "seen.webp")

    assert with_size(f'<img alt="a" src="../_images/{name}">', tmp_path / name) == expected
    assert with_size(expected, tmp_path / name) == expected


def test_a_picture_with_a_style_says_its_shape(tmp_path):
    Image.new("L", (4, 3)).save(tmp_path / "seen.webp")
    tag = '<img src="../_images/seen.webp" style="width: 8px; height: 6px;" />'

    assert with_size(tag, tmp_path / "seen.webp").startswith('<img width="4" height="3" ')

"""The state of a page's widgets says each module once, and can stand in a script."""

import json

from lighter import say_once

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

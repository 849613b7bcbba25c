"""What the tests do with the mouse, or a finger."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Locator, Page

Point = tuple[float, float]


def middle(node: Locator) -> Point:
    """Where the middle of a thing is on the screen, once it is scrolled there."""
    node.scroll_into_view_if_needed()
    box = node.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def drag(page: Page, start: Point, by: Point) -> None:
    """Press at a point, move, and let go."""
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + by[0], start[1] + by[1], steps=12)
    page.mouse.up()


def finger(page: Page) -> Callable[..., None]:
    """A function that lays a finger, or two, on the screen at x and y, moves and takes them off."""
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *places: float) -> None:
        pairs = zip(places[::2], places[1::2], strict=True)
        points = [] if kind == "End" else [{"x": x, "y": y} for x, y in pairs]
        event = {"type": f"touch{kind}", "touchPoints": points}
        devtools.send("Input.dispatchTouchEvent", event)

    return touch

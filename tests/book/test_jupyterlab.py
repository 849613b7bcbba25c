"""The students' notebooks as JupyterLab draws them, and each kind of widget there."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook
from playwright.sync_api import Browser, Locator, Page, expect

from tests.book.jupyterlab_page import (
    ERRORS,
    READY,
    RUN_ALL,
    RUN_LAST,
    SAVE,
    jupyterlab,
    notebook_read,
)
from tests.book.widget_page import PATIENCE, promised, repeat_until, settle

pytestmark = pytest.mark.pages

ROOT = Path(__file__).parents[2]
READ = sorted(path.stem for path in (ROOT / "notebooks").glob("*.ipynb"))
WIDGETS = """\
import labkit
from labkit.interactive import icp_explorer, icp_sliders, live_figure
scene = labkit.simulation.lesson_experiment()
---
explorer = icp_explorer()
explorer
---
icp_sliders(scene.source, scene.target, scene.T_init, sliders={})
---
points = {"source": scene.source.points, "target": scene.target.points}
limits = {"xlim": (-8.0, 8.0), "ylim": (-8.0, 8.0), "start": (0, 0, 0)}
steps = [k / 20 for k in range(-10, 11)]
values = {"turn [°]": range(-30, 31), "x [m]": steps, "y [m]": steps}
live_figure("turn", values, label="two scans", **limits, **points)
---
if explorer.max_correspondence_distance == 0.05:  # once a key has moved it
    run = explorer.run()
    told = {"iterations": run.iterations, "inlier_count": run.inlier_count}
    assert explorer.outcome.items() >= told.items(), explorer.outcome
    assert explorer.outcome["termination"] == run.termination.name
    assert (explorer.T_init != explorer.scenes[explorer.scene].T_init).any()
    explorer.overlap_ratio = 0.5"""

MAX_RELOADS = 5
OTHER_DRAWING = "([canvas, before]) => canvas.toDataURL() !== before"
# What a reader must not see: fences, roles and directives, formulas that could not be drawn.
RAW = re.compile(r".*(?::::|\{[a-z:]+\}`|```|\$\$|\\\(|Undefined control sequence).*")


def write_widgets(path: Path) -> None:
    """Write a notebook with each kind of widget."""
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [new_code_cell(code) for code in WIDGETS.split("---\n")]
    nbformat.write(new_notebook(cells=cells, metadata=kernel), path)


@pytest.fixture(scope="module")
def in_jupyterlab(
    browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[Path], AbstractContextManager[Page]]:
    """A function that starts JupyterLab over a folder and yields its page."""

    @contextmanager
    def started(root: Path) -> Iterator[Page]:
        with jupyterlab(root, tmp_path_factory.mktemp("home")) as address:
            page = browser.new_page(viewport={"width": 1300, "height": 1000})
            page.set_default_timeout(PATIENCE)
            enter_lab(page, address)
            yield page
            page.close()

    return started


@pytest.fixture(scope="module")
def page(in_jupyterlab, lab: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """JupyterLab over a copy of what students get; nothing is started without a browser."""
    root = tmp_path_factory.mktemp("work") / "lab"
    shutil.copytree(lab, root, ignore=shutil.ignore_patterns("labkit"))
    write_widgets(root / "widgets.ipynb")
    with in_jupyterlab(root) as page:
        yield page


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_text_is_drawn_as_in_the_book_and_answers_are_folded(page, lab, name):
    with notebook_read(page, f"notebooks/{name}.ipynb") as text:
        assert RAW.findall(text) == []
        cells = nbformat.read(lab / f"notebooks/{name}.ipynb", as_version=4).cells
        source = "".join(cell.source for cell in cells)
        answers = page.locator(".jp-MarkdownCell details")
        assert answers.count() >= source.count("<summary>")
        assert answers.locator("xpath=self::*[@open]").count() == 0


@pytest.mark.slow
def test_every_kind_of_widget_lives(page):
    """Buys what no kernel alone can show: messages, focus and mouse, all together."""
    with notebook_read(page, "widgets.ipynb"):
        promised(page, RUN_ALL)
        assert page.evaluate(ERRORS) == []
        explorers = page.locator(".icp-explorer:visible").all()
        assert len(explorers) == 3
        for explorer in explorers:
            move_each_slider(page, explorer)
        play_with(page, explorers[0])
        assert page.evaluate(ERRORS) == []


@pytest.mark.slow
def test_a_notebook_that_was_saved_shows_its_widgets_on_another_day(tmp_path, in_jupyterlab):
    """Buys the second day: another server, no kernel that knows the widgets, nothing run."""
    write_widgets(tmp_path / "widgets.ipynb")
    with in_jupyterlab(tmp_path) as page, notebook_read(page, "widgets.ipynb"):
        promised(page, RUN_ALL)
        page.locator(".icp-explorer:visible").nth(2).wait_for()
        promised(page, SAVE)

    with in_jupyterlab(tmp_path) as page, notebook_reread(page, "widgets.ipynb"):
        for explorer in page.locator(".icp-explorer:visible").all():
            move_each_slider(page, explorer)
        assert page.get_by_text("Error displaying widget").count() == 0


def enter_lab(page: Page, address: str) -> None:
    """Load JupyterLab without what was open before."""
    page.goto(f"{address}/lab?reset")
    page.wait_for_function(READY)


@contextmanager
def notebook_reread(page: Page, name: str) -> Iterator[None]:
    """Open a saved notebook with three widgets, as the students' page says.

    JupyterLab's widget manager may look for a model before it has read it, on a slow computer; the
    reader loads the page again. Nothing is run.
    """
    explorers = page.locator(".icp-explorer:visible")
    lost = page.get_by_text("Error displaying widget: model not found")
    for _ in range(MAX_RELOADS):
        with notebook_read(page, name):
            explorers.nth(2).or_(lost.first).first.wait_for()
            if not lost.count():
                yield
                return
        enter_lab(page, page.url.partition("/lab")[0])
    raise AssertionError(f"a widget's model is lost after {MAX_RELOADS} reloads")


def move_each_slider(page: Page, explorer: Locator) -> None:
    """At the guess or at the end, wherever each of them shows."""
    plane = explorer.locator("canvas").first
    for slider in explorer.locator(".icp-sliders input[type=range]").all():
        for reset in explorer.get_by_role("button", name="Reset").all():
            reset.click()
        settle(page)
        before = plane.evaluate("canvas => canvas.toDataURL()")
        is_high = 2 * float(slider.input_value()) > float(slider.get_attribute("max") or 1)
        size, share = slider.bounding_box(), 0.1 if is_high else 0.9
        slider.click(position={"x": share * size["width"], "y": size["height"] / 2})
        page.wait_for_function(OTHER_DRAWING, arg=[plane.element_handle(), before])


def play_with(page: Page, explorer: Locator) -> None:
    """Move the scan and the gate by keys, see them arrive in the kernel, and what it sets here."""
    explorer.locator(".icp-plane").focus()
    page.keyboard.press("ArrowRight")  # JupyterLab must not take it for a move between cells
    expect(explorer.locator("[data-readout='shown']")).to_contain_text("the guess")
    gate, overlap = explorer.get_by_label("gate"), explorer.get_by_label("overlap ρ")

    def move_the_gate() -> None:
        gate.press("Home")
        promised(page, RUN_LAST)

    repeat_until(
        lambda: overlap.get_attribute("aria-valuetext") == "0.50",
        move_the_gate,
        "an overlap that the kernel sets once it knows the gate and its result",
    )

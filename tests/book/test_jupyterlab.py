"""The notebooks' text in a real JupyterLab, and each kind of slider in one of them.

Of the code, the copy that is opened here holds what those sliders need. nbval runs all of it.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import nbformat
import pytest
from jupyterlab_page import ask, errors, jupyterlab, notebook_read, open_lab, run_all
from mouse import drag, thumb
from needed_cells import needed
from playwright.sync_api import Browser, Locator, Page, expect

ROOT = Path(__file__).parents[2]
WIDGETS = ("flipbook(", "icp_explorer(", "icp_sliders(", "live_figure(")

OTHER_PICTURE = "([image, before]) => image.src !== before"
OTHER_DRAWING = "([canvas, before]) => canvas.toDataURL() !== before"


def code_of(path: Path) -> str:
    """The code of a notebook of the book."""
    cells = nbformat.read(ROOT / path, as_version=4).cells
    return "\n".join(cell.source for cell in cells if cell.cell_type == "code")


def write_with_needed_code(path: Path, copy: Path) -> None:
    """The notebook, with the first widget of each kind and the code that it needs."""
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    wanted = {
        next(row for row, cell in enumerate(code) if word in cell.source)
        for word in WIDGETS
        if any(word in cell.source for cell in code)
    }
    kept = {code[row].id for row in needed([cell.source for cell in code], wanted)}
    notebook.cells = [
        cell for cell in notebook.cells if cell.cell_type != "code" or cell.id in kept
    ]
    nbformat.write(notebook, copy)


ALL = [path.relative_to(ROOT) for path in sorted((ROOT / "notebooks").glob("*.ipynb"))]
# The fewest notebooks that hold all kinds between them: a kernel's start costs most of the time.
RUN = next(
    some
    for count in range(1, len(ALL) + 1)
    for some in combinations(ALL, count)
    if all(word in "".join(map(code_of, some)) for word in WIDGETS)
)


def written(path: Path) -> set[str]:
    """The directives and roles of a notebook."""
    marks = r"(?<=:::|```)\{[a-z:-]+\}|\{[a-z:-]+\}(?=`)|(?<=:class: )\w+"
    return set(re.findall(marks, (ROOT / path).read_text("utf-8")))


def enough() -> list[Path]:
    """These two, and as many more as it takes to meet all that any notebook writes."""
    chosen = list(RUN)
    while missing := set().union(*map(written, ALL)) - set().union(*map(written, chosen)):
        chosen.append(max(ALL, key=lambda path: len(written(path) & missing)))
    return chosen


READ = enough()
# What a reader must not see: fences, roles and directives, formulas that could not be drawn.
RAW = re.compile(r".*(?::::|\{[a-z:]+\}`|```|\$\$|\\\(|Undefined control sequence).*")


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """JupyterLab over a copy of the notebooks; nothing is started without a browser."""
    root, home = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("home")
    shutil.copytree(ROOT / "notebooks", root / "notebooks")
    for path in READ:
        write_with_needed_code(ROOT / path, root / path)
    with jupyterlab(root, home) as address:
        page = browser.new_page(viewport={"width": 1300, "height": 1000})
        open_lab(page, address)
        yield page
        page.close()


@pytest.mark.slow
@pytest.mark.parametrize("path", READ, ids=[path.stem for path in READ])
def test_text_is_drawn_as_in_the_book_and_sliders_live(page, path):
    """Buys what no kernel alone can show: messages, focus and mouse, all together."""
    with notebook_read(page, path.as_posix()) as text:
        assert RAW.findall(text) == []
        answers_are_folded(page, path)
        if path in RUN:
            run_all(page)
            assert errors(page) == []
            sliders_live(page, path)
            assert errors(page) == []


def answers_are_folded(page: Page, path: Path) -> None:
    """All of them, and none that the notebook's source does not know."""
    cells = nbformat.read(ROOT / path, as_version=4).cells
    source = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    answers = page.locator(".jp-MarkdownCell details")
    assert answers.count() >= source.count(":::{dropdown}")
    assert answers.locator("xpath=self::*[@open]").count() == 0


def sliders_live(page: Page, path: Path) -> None:
    """Each moves a picture; an explorer tells the kernel, and the kernel tells it."""
    flipbooks = page.locator(".flipbook:visible").all()
    for flipbook in flipbooks:
        turn_a_page(page, flipbook)
    explorers = page.locator(".icp-explorer:visible").all()
    for explorer in explorers:
        move_each_slider(page, explorer)
    if "icp_explorer(" in (ROOT / path).read_text("utf-8"):
        play_with(page, explorers[0])
    assert flipbooks or explorers


def turn_a_page(page: Page, flipbook: Locator) -> None:
    """By mouse; one way, and the other if it stands at that end."""
    slider, picture = flipbook.locator("input"), flipbook.locator("img").element_handle()
    before = picture.get_attribute("src")
    dx = -180.0 if slider.input_value() != "0" else 180.0
    drag(page, thumb(slider), (dx, 0.0), steps=4)
    page.wait_for_function(OTHER_PICTURE, arg=[picture, before])


def move_each_slider(page: Page, explorer: Locator) -> None:
    """At the guess or at the end, wherever each of them shows."""
    plane = explorer.locator("canvas").first
    for slider in explorer.locator(".icp-sliders input[type=range]").all():
        for reset in explorer.get_by_role("button", name="Reset").all():
            reset.click()
        page.wait_for_timeout(100)
        before = plane.evaluate("canvas => canvas.toDataURL()")
        dx = -50.0 if slider.input_value() != "0" else 50.0
        drag(page, thumb(slider), (dx, 0.0), steps=4)
        page.wait_for_function(OTHER_DRAWING, arg=[plane.element_handle(), before])


def play_with(page: Page, explorer: Locator) -> None:
    """Keys, and what of them and of the sliders arrives in the kernel, as `explorer`."""
    plane, start = explorer.locator(".icp-plane"), ask(page, "explorer.T_init.tolist()")
    plane.focus()
    page.keyboard.press("ArrowRight")  # JupyterLab must not take it for a move between cells
    expect(explorer.locator("[data-readout='shown']")).to_contain_text("the guess")
    page.wait_for_timeout(500)  # until the sliders have been at rest

    gate = explorer.get_by_label("gate").get_attribute("aria-valuetext")
    assert f"{ask(page, 'explorer.max_correspondence_distance'):.2f} m" == gate
    assert ask(page, "explorer.T_init.tolist()") != start
    outcome = ask(page, "explorer.outcome")
    assert outcome["iterations"] == ask(page, "explorer.run().iterations")
    assert outcome["inlier_count"] == ask(page, "explorer.run().inlier_count")
    assert outcome["termination"] == ask(page, "explorer.run().termination.name")

    ask(page, "setattr(explorer, 'overlap_ratio', 0.5)")  # and back from Python to the page
    expect(explorer.get_by_label("overlap ρ")).to_have_attribute("aria-valuetext", "0.50")

"""What students get, the book built from it, and a browser that shows pages and widgets."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import handed_out
import killian_map
import pytest
import students_edition as edition
from anywidget import AnyWidget
from installed import program
from playwright.sync_api import Browser, Page, expect, sync_playwright
from widget_page import PATIENCE, opened, written_page

ROOT = Path(__file__).parents[2]
REPOSITORY = "https://github.com/some-school/some-course"
expect.set_options(timeout=PATIENCE)
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]


@pytest.fixture(scope="session")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository, as an instructor has it who named the students' repository."""
    root = tmp_path_factory.mktemp("course")
    for name in handed_out.tracked_files(ROOT):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    config = (ROOT / "_config.yml").read_text("utf-8").replace('url: ""', f"url: {REPOSITORY}")
    (root / "_config.yml").write_text(config, "utf-8")
    for command in (("init", "--quiet"), ("add", "--all")):
        subprocess.run([program("git", "git"), "-C", root, *command], check=True)
    return root


@pytest.fixture(scope="session")
def lab(course: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The students' edition of it, without its book."""
    to = tmp_path_factory.mktemp("student") / "edition"
    edition.write_edition(course, to, with_book=False)
    return to / "lab"


@pytest.fixture(scope="session")
def html(browser: Browser, lab: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages: those that BOOK_HTML names, or the students' book, built here.

    The latter leaves out the notebooks' results (nbval runs them), and adds a page of
    widgets. It is built only where there is a browser to look at it.
    """
    if "BOOK_HTML" in os.environ:
        return Path(os.environ["BOOK_HTML"]).resolve()
    source = tmp_path_factory.mktemp("book") / "source"
    shutil.copytree(lab, source)
    shutil.copy(Path(__file__).with_name("widgets.md"), source)
    unread = 'execute:\n  exclude_patterns: ["notebooks/*"]\n'
    config = (source / "_config.yml").read_text("utf-8").replace("execute:\n", unread)
    (source / "_config.yml").write_text(config, "utf-8")
    with (source / "_toc.yml").open("a", encoding="utf-8") as toc:
        toc.write("      - file: widgets\n")
    killian_map.provide()
    return edition.build_book(source, source.parent, killian_map.DATA.parents[1])


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The machine's own Chromium."""
    path = program("chromium", "chromium", "chromium-browser", "google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS, timeout=PATIENCE)
        yield browser
        browser.close()


@pytest.fixture
def show(browser: Browser, tmp_path: Path) -> Iterator[Callable[..., Page]]:
    """A function that shows a widget, once a sign is there, in a window as told."""
    with ExitStack() as pages:

        def shown(widget: AnyWidget, sign: str, hash: str = "", **window: object) -> Page:
            address = written_page(widget, tmp_path) + hash
            return pages.enter_context(opened(browser, address, sign, **window))

        yield shown

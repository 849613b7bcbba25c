"""What students get, the book built from it, and a browser that shows pages and widgets."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import handed_out
import pytest
import students_edition as edition
from anywidget import AnyWidget
from playwright.sync_api import Browser, Page, expect

from tests.book.widget_page import PATIENCE, opened, written_page
from tests.tools.installed import program

ROOT = Path(__file__).parents[2]
REPOSITORY = "https://github.com/some-school/some-course"
expect.set_options(timeout=PATIENCE)
TWO_PAGES = "format: jb-book\nroot: widgets\nchapters:\n  - file: notebooks/09_problems\n"


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Pages of the whole book are those of `make pages`."""
    if item.get_closest_marker("pages") and "BOOK_HTML" not in os.environ:
        pytest.skip("BOOK_HTML names no book; make pages does")


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
    """The pages: those that BOOK_HTML names, or a book of two that is built here.

    The latter holds a page of widgets and a students' notebook. It is built only where there is
    a browser to look at it.
    """
    if "BOOK_HTML" in os.environ:
        return Path(os.environ["BOOK_HTML"]).resolve()
    source = tmp_path_factory.mktemp("book") / "source"
    shutil.copytree(lab, source)
    shutil.copy(Path(__file__).with_name("widgets.md"), source)
    (source / "_toc.yml").write_text(TWO_PAGES, "utf-8")
    command = [str(Path(sys.executable).with_name("jupyter-book")), "build", "--all", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return source / "_build" / "html"


@pytest.fixture
def show(browser: Browser, tmp_path: Path) -> Iterator[Callable[..., Page]]:
    """A function that shows a widget, once a sign is there, in a window as told."""
    with ExitStack() as pages:

        def shown(widget: AnyWidget, sign: str, hash: str = "", **window: object) -> Page:
            address = written_page(widget, tmp_path) + hash
            return pages.enter_context(opened(browser, address, sign, **window))

        yield shown

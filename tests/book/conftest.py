"""A built book, a server that offers it, and a browser that looks at it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import yaml
from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).parents[2]
PATIENCE = 600.0  # seconds for another worker to build the book
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]


@pytest.fixture(scope="session")
def html(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages: those that BOOK_HTML names, or a book built here in seconds.

    The latter leaves out the notebooks' results (nbval runs them), and adds a page of
    widgets. It is built once, whatever the number of workers, and only where there is a
    browser to look at it.
    """
    if "BOOK_HTML" in os.environ:
        return Path(os.environ["BOOK_HTML"]).resolve()
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    source, ended, whole = (shared / name for name in ("book", "book-ended", "book-whole"))
    try:
        source.mkdir()
    except FileExistsError:  # by another worker
        until = time.monotonic() + PATIENCE
        while not ended.exists():
            assert time.monotonic() < until, f"no other worker built the book in {PATIENCE} s"
            time.sleep(0.2)
        assert whole.exists(), "another worker could not build the book, and says why"
    else:
        try:
            _build_into(source)
            whole.touch()
        finally:
            ended.touch()
    return source / "_build" / "html"


def _build_into(source: Path) -> None:
    for folder in ("book", "notebooks", "labkit", "tests/conformance"):  # pages include them
        shutil.copytree(ROOT / folder, source / folder)
    shutil.copy(Path(__file__).with_name("widgets.md"), source)
    config = yaml.safe_load((ROOT / "_config.yml").read_text("utf-8"))
    config["execute"]["exclude_patterns"] = ["notebooks/*"]
    (source / "_config.yml").write_text(yaml.safe_dump(config, sort_keys=False), "utf-8")
    toc = yaml.safe_load((ROOT / "_toc.yml").read_text("utf-8"))
    toc["parts"][-1]["chapters"].append({"file": "widgets"})
    (source / "_toc.yml").write_text(yaml.safe_dump(toc, sort_keys=False), "utf-8")
    jupyter_book = Path(sys.executable).with_name("jupyter-book")
    command = [str(jupyter_book), "build", str(source), "-W", "-n"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]


@pytest.fixture(scope="session")
def server(html: Path) -> Iterator[str]:
    """Address of a local web server over the pages."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(html))) as httpd:
        threading.Thread(target=httpd.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{httpd.server_port}"
        httpd.shutdown()


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The machine's own Chromium; in CI its absence is a failure, elsewhere a skip."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        missing = "no Chromium here; on Debian and Ubuntu: `sudo apt install chromium`"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(missing)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()

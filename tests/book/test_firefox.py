"""The book in a second engine: pages and their widgets in Debian's Firefox.

It is older than the ones that Playwright drives, so what is here speaks WebDriver BiDi itself.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websocket import create_connection

from tests.book.widget_page import UNDRAWN
from tests.tools.installed import program

pytestmark = pytest.mark.others

# Firefox draws a page while it comes, and complains of a formula that is only half there.
HALF_READ = "Invalid markup: Incorrect number of children"
UNFINISHED = """() => [...document.querySelectorAll("msubsup, munderover")]
    .filter(each => each.children.length !== 3).length"""


class Firefox:
    """A Firefox without a window, with a profile in a folder of the caller's."""

    def __init__(self, path: str, profile: Path) -> None:
        command = [path, "--headless", "--no-remote", "--remote-debugging-port", "0"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen([*command, "--profile", str(profile)], **quiet)
        address = f"{self._address(profile)}/session"
        self.socket = create_connection(address, suppress_origin=True)
        self.complaints: list[str] = []
        self.send("session.new", capabilities={})
        self.send("session.subscribe", events=["log.entryAdded", "network.fetchError"])
        self.tab = {"context": self.send("browsingContext.getTree")["contexts"][0]["context"]}

    def _address(self, profile: Path) -> str:
        """Where Firefox listens, as it notes in its profile."""
        note = profile / "WebDriverBiDiServer.json"
        while not (note.is_file() and (told := note.read_text("utf-8"))):
            assert self.process.poll() is None, "Firefox ended as soon as it was started"
            time.sleep(0.05)
        return "ws://{ws_host}:{ws_port}".format(**json.loads(told))

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer to a command; errors of scripts and files that come before it are kept."""
        self.socket.send(json.dumps({"id": 1, "method": method, "params": parameters}))
        while "id" not in (answer := json.loads(self.socket.recv())):
            if answer["method"] == "network.fetchError" or answer["params"]["level"] == "error":
                self.complaints.append(str(answer["params"]))
        assert answer["type"] == "success", f"{method}: {answer}"
        return dict(answer["result"])

    def evaluate(self, function: str) -> Any:
        """What a function of JavaScript, which may be asynchronous, returns in the page."""
        call = f"(async () => JSON.stringify(await ({function})()))()"
        told = self.send("script.evaluate", expression=call, target=self.tab, awaitPromise=True)
        assert told["type"] == "success", told["exceptionDetails"]["text"]
        return json.loads(told["result"]["value"])


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    path = program("firefox-esr", "firefox-esr", "firefox")
    firefox = Firefox(path, tmp_path_factory.mktemp("profile"))
    yield firefox
    firefox.send("browser.close")
    firefox.socket.close()
    firefox.process.wait()


@pytest.mark.parametrize(
    "name", ["book/intro", "book/explorer", "book/drive", "notebooks/02_alignment"]
)
def test_firefox_draws_a_page(firefox: Firefox, html: Path, name: str):
    address = f"{html.as_uri()}/{name}.html"
    firefox.send("browsingContext.navigate", **firefox.tab, url=address, wait="complete")
    assert firefox.evaluate(UNDRAWN) == []
    assert firefox.evaluate(UNFINISHED) == 0  # what Firefox says of a formula half read is past
    assert [said for said in firefox.complaints if HALF_READ not in said] == []

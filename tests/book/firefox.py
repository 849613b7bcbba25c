"""Debian's Firefox over WebDriver BiDi; Playwright would need a build of its own."""

from __future__ import annotations

import json
import subprocess
import time
from itertools import count
from pathlib import Path
from typing import Any

from websocket import create_connection

PATIENCE = 60.0  # seconds for one answer
COMPLAINTS = ["log.entryAdded", "network.fetchError"]


class Firefox:
    """A Firefox without a window, with a profile in a folder of the caller's."""

    def __init__(self, program: str, profile: Path) -> None:
        options = ["--headless", "--no-remote", "--remote-debugging-port", "0"]
        self._process = subprocess.Popen(
            [program, *options, "--profile", str(profile), "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._socket = create_connection(
            f"{self._address(profile)}/session", timeout=PATIENCE, suppress_origin=True
        )
        self._numbers = count(1)
        self._complaints: list[str] = []
        self._send("session.new", capabilities={})
        self._send("session.subscribe", events=COMPLAINTS)
        tree = self._send("browsingContext.getTree")
        self._tab = {"context": tree["contexts"][0]["context"]}

    def open(self, address: str) -> None:
        """Load a page whole."""
        self._send("browsingContext.navigate", **self._tab, url=address, wait="complete")

    def evaluate(self, function: str) -> Any:
        """What a function of JavaScript, which may be asynchronous, returns in the page."""
        told = self._send(
            "script.evaluate",
            expression=f"(async () => JSON.stringify(await ({function})()))()",
            target=self._tab, awaitPromise=True,
        )  # fmt: skip
        assert told["type"] == "success", told["exceptionDetails"]["text"]
        return json.loads(told["result"].get("value", "null"))

    def complaints(self) -> list[str]:
        """Errors since the last call: of scripts, and of files that could not be had."""
        self._send("session.status")  # what came before its answer is heard
        heard, self._complaints = self._complaints, []
        return heard

    def close(self) -> None:
        """End the program."""
        self._send("browser.close")
        self._socket.close()
        self._process.wait(PATIENCE)

    def _address(self, profile: Path) -> str:
        """Where Firefox listens, as it notes in its profile."""
        note, until = profile / "WebDriverBiDiServer.json", time.monotonic() + PATIENCE
        while time.monotonic() < until:
            assert self._process.poll() is None, "Firefox ended as soon as it was started"
            if note.is_file() and (told := note.read_text("utf-8")):
                server = json.loads(told)
                return f"ws://{server['ws_host']}:{server['ws_port']}"
            time.sleep(0.05)
        raise AssertionError(f"Firefox listens nowhere after {PATIENCE} s")

    def _send(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == number:
                assert answer["type"] == "success", f"{method}: {answer}"
                return dict(answer["result"])
            event = answer.get("params", {})
            if answer.get("method") == "network.fetchError":
                self._complaints.append(f"{event['request']['url']}: {event['errorText']}")
            elif event.get("level") == "error":
                self._complaints.append(str(event["text"]))

"""A real JupyterLab, started for the tests, and what they do in it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

from tests.book.widget_page import promised

READY = "() => window.jupyterapp?.restored.then(() => true)"
OPEN = """async path => {
    const app = window.jupyterapp;
    const panel = await app.commands.execute("docmanager:open", { path, factory: "Notebook" });
    app.shell.activateById(panel.id);
    await panel.context.ready;
    await panel.sessionContext.ready;
}"""
RUN_ALL = "() => window.jupyterapp.commands.execute('notebook:run-all-cells')"
# What a reader sees of each cell of text.
TEXTS = """() => window.jupyterapp.shell.currentWidget.content.widgets
    .filter(cell => cell.model.type === "markdown")
    .map(cell => {
        const copy = cell.node.cloneNode(true);
        const unseen = cell.rendered ? ".jp-InputArea-editor, jp-toolbar, math, style" : "*";
        copy.querySelectorAll(unseen).forEach(each => each.remove());
        return copy.textContent.trim();
    })"""
DRAWN = f"() => ({TEXTS})().every(text => text)"
CLOSE = """async () => {
    const panel = window.jupyterapp.shell.currentWidget;
    await panel.sessionContext.shutdown();
    panel.context.model.dirty = false;
    panel.close();
}"""
ERRORS = """() => [...window.jupyterapp.shell.currentWidget.content.model.cells]
    .filter(cell => cell.type === "code")
    .flatMap(cell => cell.toJSON().outputs)
    .filter(output => output.output_type === "error")
    .map(output => `${output.ename}: ${output.evalue}`)"""
SAVE = "() => window.jupyterapp.shell.currentWidget.context.save()"
# Run the last cell alone, and wait for its end.
RUN_LAST = """() => {
    const { content } = window.jupyterapp.shell.currentWidget;
    content.activeCellIndex = content.model.cells.length - 1;
    return window.jupyterapp.commands.execute("notebook:run-cell");
}"""
SETTINGS: dict[str, dict[str, Any]] = {
    "notebook-extension/tracker": {"windowingMode": "none"},
    "apputils-extension/notification": {"fetchNews": "false", "checkForUpdates": False},
}


@contextmanager
def jupyterlab(root: Path, home: Path) -> Iterator[str]:
    """Start JupyterLab over `root`, with settings of its own; yield its address.

    Notebooks are drawn whole there, not only where one looks.
    """
    for name, values in SETTINGS.items():
        file = home / "lab" / "user-settings" / "@jupyterlab" / f"{name}.jupyterlab-settings"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(values), "utf-8")
    off = home / "labconfig" / "page_config.json"  # students have no jupyterlab-myst
    off.parent.mkdir(parents=True)
    off.write_text('{"disabledExtensions": {"jupyterlab-myst": true}}', "utf-8")
    options = {
        "ServerApp.ip": "127.0.0.1",
        "ServerApp.port": 0,  # any that is free
        "ServerApp.root_dir": root,
        "IdentityProvider.token": "",
        "LabApp.expose_app_in_browser": True,
    }
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root"]
    command += [f"--{name}={value}" for name, value in options.items()]
    folders = {name: str(home) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR")}
    log = home / "log.txt"
    with log.open("wb") as stream:
        server = subprocess.Popen(command, env=os.environ | folders, stdout=stream, stderr=stream)
    try:
        yield _address(home, server, log)
    finally:
        server.kill()  # kernels that are left end with it
        server.wait()


def _address(folder: Path, server: subprocess.Popen[bytes], log: Path) -> str:
    """Where it listens, as it notes once it does, whole when the brace is closed."""
    note = ""
    while not note.rstrip().endswith("}"):
        note = "".join(file.read_text("utf-8") for file in folder.glob("jpserver-*.json"))
        assert server.poll() is None, log.read_text("utf-8", errors="replace")[-2000:]
        time.sleep(0.2)
    return str(json.loads(note)["url"]).rstrip("/")


@contextmanager
def notebook_read(page: Page, name: str) -> Iterator[str]:
    """Open a notebook; yield its text as drawn, which needs a kernel; close it in the end."""
    promised(page, OPEN, name)
    page.wait_for_function(DRAWN, polling=200)
    try:
        yield "\n".join(page.evaluate(TEXTS))
    finally:
        promised(page, CLOSE)

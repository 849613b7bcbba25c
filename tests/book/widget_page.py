"""A page that holds one widget, as a page of the book does."""

from __future__ import annotations

import json
from pathlib import Path

import browser_files
from anywidget import AnyWidget
from ipywidgets.embed import embed_data


def written_page(widget: AnyWidget, folder: Path) -> str:
    """A page that shows the widget as it is now; it loads the book's own files for widgets."""
    browser_files.provide()
    book = browser_files.VENDOR.parent.as_uri()
    data = embed_data(views=[widget], drop_defaults=False)
    state, view = json.dumps(data["manager_state"]), json.dumps(data["view_specs"][0])
    kinds = "application/vnd.jupyter.widget-state+json", "application/vnd.jupyter.widget-view+json"
    page = folder / "page.html"
    page.write_text(
        '<!doctype html><html lang="en" data-content_root="./"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>page</title>'
        f'<script src="{book}/widgets.js"></script><body><main style="max-width: 720px">'
        + f'<script type="{kinds[0]}">{state}</script><script type="{kinds[1]}">{view}</script>',
        "utf-8",
    )
    return page.as_uri()

"""The pictures that a report's text names, as parts of its page."""

from __future__ import annotations

import base64
import html
import mimetypes
import os
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote

from labkit.report.needs import ReportError

PREFERRED = ("image/svg+xml", "image/png", "image/jpeg")  # sharp before small


def embedded(address: str, folder: str | Path, attachments: Mapping[str, Mapping[str, str]]) -> str:
    """A picture's address as a data URL, which holds the picture itself.

    Parameters
    ----------
    address : str
        As the text has it: a path in the folder, ``attachment:name``, or a data URL.
    folder : path-like
        Where the report lies.
    attachments : mapping
        What was pasted into the cell: base64 by kind ("image/png") by name.

    Raises
    ------
    ReportError
        For a picture that is not there, or would have to come from the network.
    """
    if address.startswith("data:"):
        return address
    name = unquote(address)
    if name.startswith("attachment:"):
        return _attached(name.removeprefix("attachment:"), attachments)
    if re.match(r"[A-Za-z][\w+.-]+:|//", name):
        raise ReportError(
            f"the picture {name!r} lies on the network; save it beside the report and name the file"
        )
    base = os.path.abspath(folder)
    path = Path(os.path.abspath(os.path.join(base, name)))
    if not path.is_relative_to(base):
        raise ReportError(f"the picture {name!r} lies outside of {base}; copy it beside the report")
    kind = mimetypes.guess_type(path.name, strict=False)[0] or ""
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # a name may hold a NUL
        reason = getattr(error, "strerror", None) or error
        raise ReportError(f"the picture {name!r} cannot be read: {reason} ({path})") from error
    if not kind.startswith("image/"):
        raise ReportError(f"{name!r} is no picture that a page can show; use .png, .jpg or .svg")
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def embed_in_html(text: str, folder: str | Path) -> str:
    """HTML that a cell displays, with the pictures that it names as data URLs."""

    def replace(found: re.Match[str]) -> str:
        start, quote, address = found.groups()
        return f"{start}{quote}{embedded(html.unescape(address), folder, {})}{quote}"

    return re.sub(r"""(<img\b[^>]*?\ssrc=)(["'])(.*?)\2""", replace, text, flags=re.I | re.S)


def _attached(name: str, attachments: Mapping[str, Mapping[str, str]]) -> str:
    pictures = attachments.get(name)
    if not pictures:
        known = ", ".join(sorted(attachments)) or "nothing"
        raise ReportError(
            f"the picture {name!r} is not attached to the cell, which has {known}; paste it again"
        )
    kind = next((each for each in PREFERRED if each in pictures), next(iter(pictures)))
    return f"data:{kind};base64,{pictures[kind]}"

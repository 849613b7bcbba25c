"""MyST as Markdown that every program draws: GitHub, VS Code, Colab, nbconvert, JupyterLab.

A box that unfolds becomes `<details>`, a prediction a quotation, an exercise a paragraph with the
number that it has in the book, and a label a place that links reach.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

LABEL = re.compile(r"\(([\w-]+)\)=")
FENCE = re.compile(r"( *)(:{3,}|`{3,})\{(\w+)\} *(.*)")
OPTION = re.compile(r" *:(\w+): *(.*)")


class UnknownBoxError(ValueError):
    """A directive for which there is no plain form; the message names it."""


def plain(text: str, exercises: Iterator[str]) -> str:
    r"""Markdown for a cell; an exercise takes the next of the numbers.

    Examples
    --------
    >>> print(plain(":::{exercise} A loop\n:label: ex-a\n\nWrite it.\n:::", iter(["4.1"])))
    <a id="ex-a"></a>
    **Exercise 4.1. A loop**
    <BLANKLINE>
    Write it.
    >>> print(plain(":::{dropdown} Hint\nHalf.\n:::", iter([])))
    <details>
    <summary>Hint</summary>
    <BLANKLINE>
    Half.
    <BLANKLINE>
    </details>
    """
    return "\n".join(_plain_lines(text.split("\n"), exercises))


def _plain_lines(lines: list[str], exercises: Iterator[str]) -> list[str]:
    written: list[str] = []
    rest = iter(lines)
    for line in rest:
        fence = FENCE.fullmatch(line)
        label = LABEL.fullmatch(line)
        if fence:
            indent, colons, name, title = fence.groups()
            body = _until(rest, indent + colons)
            box = _box(name, title, [each.removeprefix(indent) for each in body], exercises)
            written += [indent + each if each else "" for each in box]
        else:
            written.append(_anchor(label[1]) if label else line)
    return written


def _until(lines: Iterator[str], end: str) -> list[str]:
    body = []
    for line in lines:
        if line == end:
            return body
        body.append(line)
    raise UnknownBoxError(f"a box that {end!r} has to close stays open")


def _box(name: str, title: str, body: list[str], exercises: Iterator[str]) -> list[str]:
    options = {}
    while body and (option := OPTION.fullmatch(body[0])):
        options[option[1]] = option[2]
        body = body[1:]
    inside = _plain_lines("\n".join(body).strip("\n").split("\n"), exercises)
    if name == "dropdown":
        return ["<details>", f"<summary>{title}</summary>", "", *inside, "", "</details>"]
    if name == "admonition":
        return [f"> {line}".rstrip() for line in (f"**{title}**", "", *inside)]
    if name == "exercise":
        head = f"**Exercise {next(exercises)}. {title}**"
        return [*map(_anchor, filter(None, [options.get("label")])), head, "", *inside]
    raise UnknownBoxError(f"a box {name!r} has no form in plain Markdown")


def _anchor(label: str) -> str:
    return f'<a id="{label}"></a>'

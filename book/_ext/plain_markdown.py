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


def plain(markdown: str, exercises: Iterator[str]) -> str:
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
    return "\n".join(_plain_lines(markdown.split("\n"), exercises))


def _plain_lines(lines: list[str], exercises: Iterator[str]) -> list[str]:
    plain_lines: list[str] = []
    remaining = iter(lines)
    for line in remaining:
        fence = FENCE.fullmatch(line)
        label = LABEL.fullmatch(line)
        if fence:
            indent, colons, name, title = fence.groups()
            body = _take_until(indent + colons, remaining)
            box = _box(name, title, [row.removeprefix(indent) for row in body], exercises)
            plain_lines += [indent + row if row else "" for row in box]
        else:
            plain_lines.append(_anchor(label[1]) if label else line)
    return plain_lines


def _take_until(fence: str, lines: Iterator[str]) -> list[str]:
    body = []
    for line in lines:
        if line == fence:
            return body
        body.append(line)
    raise UnknownBoxError(f"a box that {fence!r} has to close stays open")


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
        anchors = [_anchor(options["label"])] if options.get("label") else []
        heading = f"**Exercise {next(exercises)}. {title}**"
        return [*anchors, heading, "", *inside]
    raise UnknownBoxError(f"a box {name!r} has no form in plain Markdown")


def _anchor(label: str) -> str:
    return f'<a id="{label}"></a>'

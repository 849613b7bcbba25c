"""Lighter pages: only the icons that are used, and pictures as WebP."""

from __future__ import annotations

import base64
import io
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont
from PIL import Image
from sphinx.application import Sphinx

ICONS = "icons.css"
FONTS = {"solid-900": ("Font Awesome 6 Free", 900), "brands-400": ("Font Awesome 6 Brands", 400)}
BASE = """:root { --fa-font-solid: normal 900 1em/1 "Font Awesome 6 Free"; } /* of titles */
.fa-solid, .fas, .fa-brands, .fab { display: inline-block; line-height: 1; text-rendering: auto; }
.fa-solid, .fas { font-weight: 900; font-family: "Font Awesome 6 Free"; }
.fa-brands, .fab { font-weight: 400; font-family: "Font Awesome 6 Brands"; }
.fa-lg { font-size: 1.25em; line-height: 0.05em; vertical-align: -0.075em; }
"""


def lighten(app: Sphinx, error: Exception | None) -> None:
    """Write the icons' style sheet and smaller pictures."""
    if error is None and app.builder.name == "html":
        out = Path(app.outdir)
        pages = {path: path.read_text("utf-8") for path in out.rglob("*.html")}
        write_icons(out, "".join(pages.values()))
        change_pictures(out, pages)


def write_icons(out: Path, html: str) -> None:
    """A style sheet with the icons that the pages and the other style sheets name."""
    (vendor,) = (out / "_static" / "vendor" / "fontawesome").iterdir()
    code_of = dict(
        re.findall(
            r'\.fa-([a-z0-9-]+):before\{content:"\\([0-9a-f]+)"',
            _spread(vendor / "css/all.min.css"),
        )
    )
    used = {
        name for name in re.findall(r"\bfa-([a-z0-9-]+)", html + _scripts(out)) if name in code_of
    }
    sheets = "".join(
        each.read_text("utf-8")
        for each in (out / "_static").rglob("*.css")
        if vendor not in each.parents
    )
    codes = {code_of[name] for name in used} | set(re.findall(r"\\(f[0-9a-f]{3})\b", sheets))
    codes |= {f"{ord(sign):x}" for sign in set(sheets) if "\ue000" <= sign <= "\uf8ff"}
    rules = [
        BASE,
        *(f'.fa-{name}:before {{ content: "\\{code_of[name]}"; }}' for name in sorted(used)),
    ]
    for file, (family, weight) in FONTS.items():
        font = TTFont(vendor / "webfonts" / f"fa-{file}.ttf")
        subsetter = subset.Subsetter()
        subsetter.populate(unicodes=[int(code, 16) for code in codes])
        subsetter.subset(font)
        font.flavor = "woff"
        packed = io.BytesIO()
        font.save(packed)
        told = base64.b64encode(packed.getvalue()).decode("ascii")
        source = f"url(data:font/woff;base64,{told})"
        rules.append(
            f'@font-face {{ font-family: "{family}"; font-weight: {weight}; src: {source}; }}'
        )
    (out / "_static" / ICONS).write_text("\n".join(rules), "utf-8")


def _spread(sheet: Path) -> str:
    """The rules of the icons, each with one name."""
    spread = lambda rule: "".join(f"{name}{rule[2]}" for name in rule[1].split(","))  # noqa: E731
    return re.sub(r"((?:\.fa-[a-z0-9-]+:before,?)+)(\{[^}]*\})", spread, sheet.read_text("utf-8"))


def _scripts(out: Path) -> str:
    return "".join(each.read_text("utf-8") for each in (out / "_static" / "scripts").glob("*.js"))


def change_pictures(out: Path, pages: dict[Path, str]) -> None:
    """Turn each PNG that pages show into a WebP without loss, where that is smaller."""
    drawn = sorted((out / "_images").glob("*.png"))
    with ThreadPoolExecutor() as pool:
        smaller = {name for name in pool.map(_as_webp, drawn) if name}
    for path, html in pages.items():
        changed = re.sub(
            r"(_images/[\w.-]+)\.png",
            lambda m: m[1] + (".webp" if Path(m[1]).name in smaller else ".png"),
            html,
        )
        if changed != html:
            path.write_text(changed, "utf-8")


def _as_webp(picture: Path) -> str | None:
    webp = picture.with_suffix(".webp")
    Image.open(picture).save(webp, lossless=True, method=2)
    (picture if webp.stat().st_size < picture.stat().st_size else webp).unlink()
    return picture.stem if webp.exists() else None

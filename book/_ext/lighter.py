"""Lighter pages: the icons that are used, pictures as WebP, a widget's module once a page.

Each picture says its size, so that what stands below it does not move when it comes.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont
from PIL import Image
from sphinx.application import Sphinx

ICONS = "icons.css"
STATE = re.compile(
    r'(<script type="application/vnd.jupyter.widget-state\+json">)(.*?)(?=</script>)', re.S
)
IMAGE = re.compile(r'<img [^>]*\bsrc="[^"]*_images/([^"/]+)"[^>]*>')
SVG_SIZE = re.compile(r'<svg [^>]*?\bwidth="([\d.]+)(pt)?"[^>]*?\bheight="([\d.]+)(?:pt)?"')
POINT_PX = 4 / 3  # of CSS
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
        write_icons(out / "_static", "".join(pages.values()))
        change_pictures(out / "_images", pages)


def write_icons(static: Path, html: str) -> None:
    """A style sheet with the icons that pages, scripts and the other style sheets name."""
    (vendor,) = (static / "vendor" / "fontawesome").iterdir()
    groups = re.findall(
        r'((?:\.fa-[\w-]+:before,?)+)\{content:"\\(\w+)"',
        (vendor / "css/all.min.css").read_text("utf-8"),
    )
    code_of = {name: code for names, code in groups for name in re.findall(r"fa-([\w-]+)", names)}
    sheets = set(static.rglob("*.css")) - set(vendor.rglob("*.css"))
    files = [*static.glob("scripts/*.js"), *sheets]
    sources = "".join([html, *(file.read_text("utf-8") for file in files)])
    used = sorted(set(re.findall(r"\bfa-([\w-]+)", sources)) & code_of.keys())
    letters = {int(code_of[name], 16) for name in used}
    letters |= {int(code, 16) for code in re.findall(r"\\(f[0-9a-f]{3})\b", sources)}
    letters |= {ord(sign) for sign in set(sources) if "\ue000" <= sign <= "\uf8ff"}
    rules = [BASE, *(f'.fa-{name}:before {{ content: "\\{code_of[name]}"; }}' for name in used)]
    for name, (family, weight) in FONTS.items():
        font = TTFont(vendor / "webfonts" / f"fa-{name}.ttf")
        subsetter = subset.Subsetter()
        subsetter.populate(unicodes=letters)
        subsetter.subset(font)
        font.flavor = "woff"
        file = io.BytesIO()
        font.save(file)
        letters_in_page = base64.b64encode(file.getvalue()).decode("ascii")
        source = f"url(data:font/woff;base64,{letters_in_page})"
        rules.append(
            f'@font-face {{ font-family: "{family}"; font-weight: {weight}; src: {source}; }}'
        )
    (static / ICONS).write_text("\n".join(rules), "utf-8")


def change_pictures(folder: Path, pages: dict[Path, str]) -> None:
    """Turn each PNG that pages show into a WebP without loss, and say a module once."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(_as_webp, folder.glob("*.png")))
    for path, html in pages.items():
        page = re.sub(rf"({folder.name}/[\w.-]+)\.png", r"\1.webp", html)
        page = IMAGE.sub(lambda tag: with_size(tag[0], folder / tag[1]), page)
        path.write_text(STATE.sub(lambda match: match[1] + say_once(match[2]), page), "utf-8")


def with_size(tag: str, picture: Path) -> str:
    """The tag of an image with its size in pixels, unless it has one or the file tells none.

    A style says how wide it is on a wide page; on a narrow one only these tell its shape.
    """
    if ' width="' in tag:
        return tag
    if picture.suffix == ".svg":
        told = SVG_SIZE.search(picture.read_text("utf-8"))
        if told is None:
            return tag
        scale = POINT_PX if told[2] else 1
        width, height = (round(scale * float(side)) for side in (told[1], told[3]))
    else:
        with Image.open(picture) as image:
            width, height = image.size
    return tag.replace("<img ", f'<img width="{width}" height="{height}" ', 1)


def say_once(script: str) -> str:
    """The state of a page's widgets with each text of a module once, by a name (`widgets.js`)."""
    page_state = json.loads(script)
    if "texts" in page_state:  # of a page that an earlier build wrote
        return script
    modules = {}
    for widget in page_state["state"].values():
        for key in {"_esm", "_css"} & widget["state"].keys():
            module = widget["state"][key]
            name = hashlib.sha256(module.encode()).hexdigest()[:12]
            modules[name] = module
            widget["state"][key] = name
    page_state["texts"] = modules
    return json.dumps(page_state, separators=(",", ":")).replace("</", "<\\/")


def _as_webp(picture: Path) -> None:
    Image.open(picture).save(picture.with_suffix(".webp"), lossless=True, method=2)
    picture.unlink()

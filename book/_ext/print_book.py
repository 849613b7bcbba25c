"""The whole book as one PDF, printed by Chromium from the pages that were built.

Run as a script, `make pdf` does, it puts the pages of `_toc.yml` behind one another into a
single long page, so that links lead from chapter to chapter and page numbers run on, and
prints that. A title and the contents with their page numbers come first.
"""

from __future__ import annotations

import argparse
import html
import io
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from posixpath import dirname, join, normpath
from typing import Any
from urllib.parse import urlsplit

import yaml
from bs4 import BeautifulSoup, Tag
from playwright.sync_api import Error, Page, sync_playwright
from pypdf import PdfReader, PdfWriter

from labkit.course.report.pages import QUIET, find_browser
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write

ROOT = Path(__file__).parents[2]
WHOLE = "whole-book.html"
PATIENCE = 180  # seconds until all widgets must be drawn
WIDTH = 680  # pixels between the margins of A4
SCRIPT = "widgets.js"  # what draws; the rest is for readers at a screen
REFERENCES = ("for", "aria-labelledby", "aria-describedby", "name")
DRAW = """async patience => {
    const fail = fails => setTimeout(() => fails(new Error("something is not drawn")), patience);
    const late = new Promise((_, fails) => fail(fails));
    const drawn = async () => {
        await window.drawWidgets?.();
        await document.fonts.ready;
        await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
    };
    await Promise.race([drawn(), late]);
}"""
STYLE = """
    @page { size: A4; margin: 17mm 15mm 18mm; }
    body { margin: 0; background: white; font-size: 10.5pt; }
    article { padding: 0 !important; }
    article + article { break-before: page; }
    h1, h2, h3 { white-space: pre-wrap; } /* or a bookmark lacks the space where a title wraps */
"""
FOOTER = (
    '<div style="font: 8pt sans-serif; width: 100%; text-align: center; color: #555">'
    '<span class="pageNumber"></span></div>'
)
FRONT = """<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>
    @page {{ size: A4; margin: 30mm 25mm; }}
    body {{ font: 11pt/1.7 sans-serif; }}
    h1 {{ font-size: 26pt; line-height: 1.2; margin: 40mm 0 5mm; }}
    h2 {{ break-before: page; }}
    p {{ display: flex; justify-content: space-between; margin: 0; }}
    </style><h1>{title}</h1><div>{author}</div>
    <div>Code that only prepares or draws is left out on paper. The notebooks have it.</div>
    <h2>Contents</h2>{entries}"""


def files(entry: dict[str, Any]) -> Iterator[str]:
    """Names of the pages in a part of the table of contents, in its order."""
    yield from filter(None, [entry.get("root"), entry.get("file")])
    for group in ("parts", "chapters", "sections"):
        for child in entry.get(group, []):
            yield from files(child)


def print_book(pages: Path, names: Sequence[str], title: str, author: str) -> bytes:
    """The named pages of a built book, printed.

    Raises
    ------
    LabkitError
        Where a page is missing, a browser is, or a widget cannot be drawn.
    """
    for name in names:
        if not pages.joinpath(f"{name}.html").is_file():
            raise LabkitError(f"{pages} has no page {name}.html; run `make book` first")
    whole = pages / WHOLE
    try:
        whole.write_text(one_page(pages, names), "utf-8")
        with ThreadPoolExecutor(1) as own:  # a caller's thread may have a browser of its own
            return own.submit(_printed, whole, len(names), title, author).result()
    finally:
        whole.unlink(missing_ok=True)


def one_page(pages: Path, names: Sequence[str]) -> str:
    """The articles of the pages behind one another, with links among them."""
    head: dict[str, None] = {}
    articles, states = [], []
    for name in names:
        soup = BeautifulSoup(pages.joinpath(f"{name}.html").read_text("utf-8"), "html.parser")
        for each in soup.select("script"):
            if not _is_needed(each):
                each.decompose()
        _rewrite(soup, name, names)
        article = soup.select_one("article.bd-article")
        if article is None:
            raise LabkitError(f"{pages / name}.html has no article")
        states += map(str, soup.select('script[type$="widget-state+json"]'))
        article["id"] = _slug(name)
        wanted = 'link[rel="stylesheet"], script:not([type^="application/"])'
        head |= dict.fromkeys(str(each.extract()) for each in soup.select(wanted))
        articles.append(str(article))
    return (
        '<!doctype html><html lang="en" data-theme="light" data-content_root="./">'
        f'<head><meta charset="utf-8">{"".join(head)}<style>{STYLE}</style></head>'
        f'<body><div class="bd-content"><main>{"".join(articles)}</main></div>'
        f"{''.join(states)}</body></html>"
    )


def _is_needed(script: Tag) -> bool:
    if str(script.get("type")).startswith("application/vnd.jupyter.widget"):
        return True
    if "src" in script.attrs:
        return SCRIPT in str(script["src"])
    return False


def _slug(name: str) -> str:
    return name.replace("/", "-")


def _rewrite(soup: BeautifulSoup, name: str, names: Sequence[str]) -> None:
    """Make ids the whole book's, links lead within it, and addresses start at its folder."""
    _rename_ids(soup, _slug(name))
    for attribute in ("src", "href"):
        for each in soup.select(f"img[{attribute}], script[{attribute}], link[{attribute}]"):
            address = urlsplit(str(each[attribute]))
            if not address.scheme:
                each[attribute] = normpath(join(dirname(name), address.path))
    for link in soup.select("a[href]"):
        address = urlsplit(str(link["href"]))
        if address.scheme:
            continue
        path = join(dirname(name), address.path) if address.path else f"{name}.html"
        page = normpath(path).removesuffix(".html")
        if page in names:
            link["href"] = "#" + "--".join(filter(None, (_slug(page), address.fragment)))
        else:
            del link["href"]  # a file to download, or a page beside the book
    for details in soup.select("details"):
        details["open"] = ""


def _rename_ids(soup: BeautifulSoup, prefix: str) -> None:
    """Put the page's name before all ids but those of drawings, which are nobody else's."""
    for each in soup.select("[id]"):
        if not each.find_parent("svg") and each.name != "svg":
            each["id"] = f"{prefix}--{each['id']}"
    for attribute in REFERENCES:
        for each in soup.select(f"article [{attribute}]"):
            each[attribute] = f"{prefix}--{each[attribute]}"


def _printed(whole: Path, count: int, title: str, author: str) -> bytes:
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=find_browser(), args=QUIET)
        try:
            page = browser.new_page(
                viewport={"width": WIDTH, "height": 960}, device_scale_factor=2, offline=True
            )
            page.emulate_media(media="print", color_scheme="light", reduced_motion="reduce")
            page.goto(whole.as_uri(), timeout=1000 * PATIENCE)
            try:
                page.evaluate(DRAW, 1000 * PATIENCE)
            except Error as error:
                raise LabkitError(f"the book, within {PATIENCE} s: {error}") from error
            body = _pdf(page, display_header_footer=True, footer_template=FOOTER, outline=True)
            front = _front(body, count, title, author)
            page.set_content(front)
            return _joined([_pdf(page), body], title, author)
        finally:
            browser.close()


def _pdf(page: Page, **options: Any) -> bytes:
    return page.pdf(
        prefer_css_page_size=True, print_background=True, header_template="<span></span>",
        tagged=True, **options,
    )  # fmt: skip


def _front(body: bytes, count: int, title: str, author: str) -> str:
    """The title, and the first page of each chapter as the book's bookmarks have it."""
    reader = PdfReader(io.BytesIO(body))
    chapters = [each for each in reader.outline if not isinstance(each, list)]
    if len(chapters) != count:
        raise LabkitError(f"the PDF has {len(chapters)} titles, not {count}")
    entries = (
        f"<p><span>{html.escape(str(each.title))}</span>"
        f"<span>{(reader.get_destination_page_number(each) or 0) + 1}</span></p>"
        for each in chapters
    )
    return FRONT.format(
        title=html.escape(title), author=html.escape(author), entries="".join(entries)
    )


def _joined(parts: Sequence[bytes], title: str, author: str) -> bytes:
    writer, content = PdfWriter(), io.BytesIO()
    for part in parts:
        writer.append(io.BytesIO(part))
    writer.add_metadata({"/Title": title, "/Author": author})
    writer.write(content)
    return content.getvalue()


def main() -> None:
    """Print the book that `make book` built."""
    parser = argparse.ArgumentParser(description=print_book.__doc__)
    parser.add_argument("--pages", type=Path, default=ROOT / "_build" / "html", metavar="FOLDER")
    parser.add_argument("--out", type=Path, default=ROOT / "_build" / "book.pdf", metavar="FILE")
    options = parser.parse_args()
    config = yaml.safe_load(ROOT.joinpath("_config.yml").read_text("utf-8"))
    names = list(files(yaml.safe_load(ROOT.joinpath("_toc.yml").read_text("utf-8"))))
    names.remove("book/api")  # 40 pages to look things up in at a screen
    try:
        content = print_book(options.pages.resolve(), names, config["title"], config["author"])
    except LabkitError as problem:
        sys.exit(str(problem))
    with atomic_write(options.out, "wb") as file:
        file.write(content)
    print(f"{options.out}: {len(PdfReader(io.BytesIO(content)).pages)} pages of A4")


if __name__ == "__main__":
    main()

"""Every page of the book in a real browser: offline, without errors, with its formulas drawn."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from importlib import resources
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from students_edition import without_staff_pages

import labkit
from tests.book.test_labels_page import RECORD
from tests.book.widget_page import UNDRAWN, come_back, opened, promised
from tests.book.widths import MAX_SHIFT, WATCH_SHIFTS, shift_of

WRITTEN_HERE = "BOOK_HTML" not in os.environ
DOCUMENTED = labkit.logs, labkit.odometry, labkit.evaluation, labkit.simulation, labkit.plotting
_TOC = (Path(__file__).parents[2] / "_toc.yml").read_text("utf-8")
NAMES = re.findall(r"(?:root|file): (\S+)", without_staff_pages(_TOC) if WRITTEN_HERE else _TOC)

PROSE = """main => {
    const copy = main.cloneNode(true);
    copy.querySelectorAll("pre, code, script, style").forEach(other => other.remove());
    return copy.textContent;
}"""

AXE = resources.files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
BARRIERS = """async rules => {
    for (const change of document.getAnimations()) change.finish();
    const options = { preload: false, resultTypes: ["violations"], selectors: false };
    if (rules) options.runOnly = rules;
    const { violations } = await axe.run(document, options);
    return violations.map(({ id, nodes }) => [id, nodes.length, nodes[0].html]);
}"""
# What another theme may change: colours, and which of two pictures is shown.
OF_A_THEME = ["color-contrast", "link-in-text-block", "image-alt"]
# Keeps one word of each colour in the code: thousands of the same tell nothing more.
ONE_OF_A_COLOUR = """() => {
    const seen = new Set();
    for (const word of document.querySelectorAll(".highlight pre span[class]")) {
        if (seen.has(word.className)) word.replaceWith(...word.childNodes);
        seen.add(word.className);
    }
}"""
COPIED = """paragraph => {
    const clipboardData = new DataTransfer();
    getSelection().selectAllChildren(paragraph);
    paragraph.dispatchEvent(new ClipboardEvent("copy", { clipboardData, bubbles: true }));
    return ["text/plain", "text/html"].map(kind => clipboardData.getData(kind));
}"""
IN_THE_DARK = [NAMES[0], "notebooks/04_icp_loop", "book/languages"]
WIDE = "all => all.filter(t => t.scrollWidth > t.clientWidth + 1).map(t => t.innerText)"
HELD = """node => {
    const held = node.closest(".predict-held");
    const shown = held?.querySelector(":scope > .cell_output") ?? held ?? node;
    const isStill = held?.classList.contains("predict-still");
    const isUnread = isStill || getComputedStyle(shown).filter !== "none";
    return Boolean(held?.inert && isUnread && node.checkVisibility());
}"""
WORDS = """all => all.map(each =>
    each.textContent.replaceAll("Copy to clipboard", "").split(/\\s+/).join(" ").trim())"""
CUT_FORMULAS = """all => all
    .filter(f => f.scrollWidth > f.clientWidth && getComputedStyle(f).overflowX == "hidden")
    .map(f => f.textContent)
"""


# Waits until thirty frames of the toy are alike.
AT_REST = """() => new Promise(told => {
    let [last, alike] = ["", 0];
    const look = () => {
        const now = document.querySelector(".icp-plane").toDataURL();
        alike = now === last ? alike + 1 : 0;
        last = now;
        if (alike === 30) told();
        else requestAnimationFrame(look);
    };
    look();
})"""


def visit(browser: Browser, base: str, name: str) -> AbstractContextManager[Page]:
    """A page of the book, at rest."""
    at_rest = {"color_scheme": "light", "reduced_motion": "reduce"}
    return opened(browser, f"{base}/{name}.html", own=base, **at_rest)


@pytest.fixture
def page(browser: Browser, html: Path) -> Iterator[Page]:
    """The page that the fixture adds to the book that it writes."""
    if not WRITTEN_HERE:
        pytest.skip("another book has no such page")
    with visit(browser, html.as_uri(), "widgets") as page:
        yield page


@pytest.mark.pages
@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, "genindex"])
def test_a_page_needs_no_network_draws_all_it_holds_and_has_no_barrier(browser, html, name):
    """Buys what only a browser tells; each page is opened once, from a folder."""
    with visit(browser, html.as_uri(), name) as page:
        assert promised(page, UNDRAWN) == []
        page.evaluate(ONE_OF_A_COLOUR)
        page.evaluate(AXE)
        assert promised(page, BARRIERS) == []
        if name in IN_THE_DARK:
            page.emulate_media(color_scheme="dark", reduced_motion="reduce")
            expect(page.locator("html")).to_have_attribute("data-theme", "dark")
            assert promised(page, BARRIERS, OF_A_THEME) == []
        draws_all_it_holds(page)
        fits_a_telephone(page)


def draws_all_it_holds(page: Page) -> None:
    """One heading, and formulas, diagrams and pictures instead of their source."""
    assert page.locator("article h1").count() == 1
    assert page.locator(".math math").count() == page.locator(".math").count()
    text = page.locator("main").evaluate(PROSE)
    assert not [raw for raw in (r"\[", r"\(", "$$") if raw in text]


def fits_a_telephone(page: Page) -> None:
    """Only figures scroll sideways, so that a reader sees their letters; no table does.

    Answers are unfolded first: a browser lays a folded one out at some later time.
    """
    page.set_viewport_size({"width": 390, "height": 844})
    page.locator("details").evaluate_all("all => all.forEach(fold => fold.open = true)")
    figure = page.locator("article figure:not(.killian-map):has(img)")
    assert figure.evaluate_all("all => all.filter(node => node.scrollWidth < 450).length") == 0
    page.evaluate("() => new Promise(drawn => requestAnimationFrame(() => setTimeout(drawn)))")
    assert page.locator(".pst-scrollable-table-container").evaluate_all(WIDE) == []
    assert page.locator("div.math").evaluate_all(CUT_FORMULAS) == []


# What readers ask, and the page where the answer stands: among the first three.
QUESTIONS = {
    "why left composition": "glossary.html#term-Composition",
    "install on windows": "students.html#install",
    "kd-tree": "appendix_search.html",
    "cite": "references.html",
    "too few correspondences": "students.html#when-something-goes-wrong",
    "matmul mismatch": "students.html#when-something-goes-wrong",
    "no module named labkit": "students.html#when-something-goes-wrong",
    "trajectory is mirrored": "students.html#when-something-goes-wrong",
    "how do I submit": "students.html#submit-what",
    "atan2": "02_alignment.html#in-the-plane",
    "mirror image determinant": "02_alignment.html#",
    "ATE": "glossary.html#term-ATE",
    "when does icp fail": "07_failures.html",
    "does it run in c++": "languages.html",
    "what is a pose graph": "10_closing.html#a-pose-graph",
    "how long does the course take": "intro.html#the-way-through",
    "corespondences": "03_correspondences.html",
    "δ": "glossary.html",
}


@pytest.mark.pages
def test_the_search_finds_the_place_that_answers(browser, html):
    """From a folder, where no page may read another one."""
    with visit(browser, html.as_uri(), "search") as page:
        links, address = page.locator("#search-results li a"), page.url
        page.goto(f"{address}?q=gate")
        for question, place in QUESTIONS.items():
            page.locator("input[name=q]").last.fill(question)
            expect(page.locator("#search-results h2")).to_contain_text(f"“{question}”")
            first = links.evaluate_all("all => all.slice(0, 3).map(each => each.href)")
            assert any(place in each for each in first), question
            assert sum("glossary" in each for each in first[:2]) < 2, question
        assert page.locator("[id=search-input]").count() == 1
        page.evaluate(AXE)
        assert promised(page, BARRIERS) == []
    with visit(browser, html.as_uri(), "notebooks/02_alignment") as page:
        page.keyboard.press("Control+k")
        page.locator(".search-button__search-container input").fill("how do I submit")
        found = page.locator(".search-below a")  # below the field, while one types
        expect(found.first).to_have_attribute("href", re.compile("students.html#submit-what"))
        assert found.first.bounding_box()["height"] > 10
        page.keyboard.press("Tab")
        expect(found.first).to_be_focused()


@pytest.mark.pages
def test_a_term_tells_its_meaning_under_the_focus(browser, html):
    with visit(browser, html.as_uri(), "notebooks/03_correspondences") as page:
        note = page.locator(".term-note")
        page.locator("a:has(.std-term)", has_text="Gate").first.focus()
        expect(note).to_contain_text("The distance beyond which a pair is rejected")
        page.keyboard.press("Escape")
        expect(note).to_be_hidden()


PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


@pytest.mark.pages
def test_a_finger_sees_what_a_term_means_before_it_goes_there(browser, html):
    address = f"{html.as_uri()}/notebooks/03_correspondences.html"
    with opened(browser, address, **PHONE) as page:
        term, note = (
            page.locator("a:has(.std-term)", has_text="Gate").first,
            page.locator(".term-note"),
        )

        term.tap()

        expect(note).to_contain_text("The distance beyond which a pair is rejected")
        assert page.url == address
        term.tap()
        page.wait_for_url(re.compile("glossary.html#term-Gate"))


# Each cell of a stacked table: the name before it, and the head of its column.
NAMES_OF_CELLS = """tables => tables.flatMap(table => {
    const heads = [...table.rows[0].cells].map(cell => cell.textContent.trim());
    const cells = [...table.tBodies].flatMap(body => [...body.rows].flatMap(row => [...row.cells]));
    const headOf = ({ cellIndex }) => (cellIndex ? heads[cellIndex] : "");
    return cells.map(cell => [cell.dataset.name ?? "", headOf(cell)]);
})"""


@pytest.mark.pages
def test_a_cell_of_a_stacked_table_has_the_name_of_its_column(browser, html):
    with opened(browser, f"{html.as_uri()}/book/notation.html", **PHONE) as page:
        page.locator(".stacked table").first.wait_for()

        names = page.locator(".stacked table").evaluate_all(NAMES_OF_CELLS)

    assert ["unit", "unit"] in names
    assert [name for name, _ in names] == [head for _, head in names]


LOW = {"width": 1366, "height": 100}
SIZES = [(1366, 768), (1920, 1080), (390, 844)]


@pytest.mark.pages
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_the_first_page_stands_still_and_its_first_screen_holds_the_toy(
    browser, html, width, height
):
    address, size = f"{html.as_uri()}/{NAMES[0]}.html", {"width": width, "height": height}
    with opened(browser, address, ".icp-distance:has-text('m')", viewport=size) as page:
        for part in (".icp-by-hand .icp-plane", ".icp-verdict", ".icp-by-hand button >> nth=0"):
            box = page.locator(part).bounding_box()
            assert box["y"] + box["height"] < height, part
        page.evaluate(WATCH_SHIFTS)
        page.locator(".map-live canvas").wait_for()
        promised(page, AT_REST)  # the scan has beckoned
        assert shift_of(page) < MAX_SHIFT


@pytest.mark.pages
def test_a_step_of_the_map_comes_into_the_toy_and_what_is_found_plays_the_map(browser, html):
    with visit(browser, html.as_uri(), NAMES[0]) as page:
        verdict, canvas = page.locator(".icp-verdict"), page.locator(".map-live canvas")
        finish = page.get_by_role("button", name="Let ICP finish")
        page.locator(".icp-by-hand .icp-plane").focus()
        for key, count in {"ArrowLeft": 12, "ArrowUp": 8, "PageDown": 10}.items():
            for _ in range(count):
                page.keyboard.press(key)
        expect(verdict).to_contain_text(re.compile("Warmer|Near"))
        finish.click()
        page.get_by_role("button", name="Now 3,872 times").click()
        expect(canvas).to_be_in_viewport()
        page.evaluate(RECORD)
        page.get_by_role("slider", name="Poses from").press("Home")
        marks = page.evaluate("() => window.marks")
        lies = [{"x": u, "y": v} for *_, radius, u, v in marks if radius == "6"]
        for number, place in zip(["1732", "2222", "2225", "2436"], lies, strict=True):
            canvas.click(position=place)  # of two dots in one place, either
            expect(verdict).to_contain_text(
                re.compile("Step 222" if number[:3] == "222" else number)
            )
        page.get_by_role("button", name="1732").click()
        expect(verdict).to_contain_text("Step 1732: ICP says that the robot stood still")
        finish.click()
        expect(verdict).to_contain_text("Stuck: 0.7")  # the step that lied


@pytest.mark.pages
def test_the_map_unfolds_from_the_wheels_to_the_places_recognised(browser, html):
    with visit(browser, html.as_uri(), NAMES[0]) as page:
        slider = page.get_by_role("slider", name="Poses from")
        canvas = page.locator(".map-live canvas")
        expect(page.locator(".killian-map img")).to_be_hidden()
        shown = set()
        for key, off in (("Home", r"\d\d m"), ("End", r"1\.\d m")):
            slider.press(key)
            expect(slider).to_have_attribute("aria-valuetext", re.compile(rf": {off} off"))
            shown.add(canvas.evaluate("canvas => canvas.toDataURL()"))
        assert len(shown) == 2
        slider.fill("0.6")  # between two sets of poses the nearer one is named
        expect(slider).to_have_attribute("aria-valuetext", re.compile("What scan matching finds"))
        page.emulate_media(media="print")
        expect(page.locator(".killian-map img")).to_be_visible()
        expect(canvas).to_be_hidden()


@pytest.mark.pages
def test_a_telephone_folds_the_api_and_a_link_opens_its_own_fold(browser, html):
    place = "labkit.IcpResult.covariance"
    address = f"{html.as_uri()}/book/api.html#{place}"

    with opened(browser, address, viewport={"width": 390, "height": 844}) as page:
        page.evaluate(AXE)

        assert promised(page, BARRIERS) == []
        assert page.locator("dl.py details").count() > 50
        expect(page.locator("dl.py details[open]")).to_have_count(1)
        expect(page.locator(f"[id='{place}']")).to_be_in_viewport()


@pytest.mark.pages
def test_what_a_copy_button_copies_runs(browser, html):
    """No prompt and no result is in it."""
    with visit(browser, html.as_uri(), "book/api") as page:
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        example = page.locator(".highlight", has_text=">>> ").first
        example.hover()
        example.locator("button.copybtn").click()
        copied = page.evaluate("() => navigator.clipboard.readText()")
    compile(copied, "copied", "exec")
    assert ">>>" not in copied


def test_a_page_holds_the_module_of_its_widgets_once(page, html):
    written = (html / "widgets.html").read_text("utf-8")

    page.evaluate("() => window.drawWidgets()")  # those below, too

    assert page.locator(".icp-explorer").count() > 1
    assert written.count("class LiveFigure") == 1


@pytest.mark.skipif(not WRITTEN_HERE, reason="another book has no such page")
def test_where_no_script_runs_each_widget_is_a_picture(browser, html):
    page = browser.new_page(java_script_enabled=False)

    page.goto(f"{html.as_uri()}/widgets.html")

    stills = page.locator(".still img")
    assert stills.count() > 1
    expect(stills.filter(visible=True)).to_have_count(stills.count())
    page.close()


def test_paper_shows_a_widget_that_was_drawn_or_its_picture(browser, html):
    """A canvas that is made for the printer is still empty when it prints."""
    if not WRITTEN_HERE:
        pytest.skip("another book has no such page")
    with opened(browser, f"{html.as_uri()}/widgets.html", viewport=LOW) as page:
        page.locator(".icp-explorer canvas").first.wait_for()
        drawn = page.locator(".icp-explorer").count()

        page.emulate_media(media="print")
        page.evaluate("() => dispatchEvent(new Event('beforeprint'))")

        stills = page.locator(".still")
        expect(page.locator(".icp-explorer").filter(visible=True)).to_have_count(drawn)
        expect(stills.filter(visible=True)).to_have_count(stills.count() - drawn)


def test_paper_is_light_and_the_screen_has_its_shade_again(page):
    page.emulate_media(color_scheme="dark")
    shade = page.locator("html")
    expect(shade).to_have_attribute("data-theme", "dark")
    for event, theme in (("beforeprint", "light"), ("afterprint", "dark")):
        page.evaluate("name => dispatchEvent(new Event(name))", event)
        expect(shade).to_have_attribute("data-theme", theme)


def test_a_formula_is_copied_and_tab_leads_to_the_widgets(page):
    plain, formatted = page.locator("p", has_text="A slider for").evaluate(COPIED)
    assert plain == r"A slider for the gate $d_{\max}$."
    assert "<msub><mi>d</mi>" in formatted
    page.reload(wait_until="networkidle")
    page.get_by_text("Skip to widget 1").wait_for(state="attached")
    for _ in range(2):  # the text comes first
        page.keyboard.press("Tab")
    expect(page.get_by_text("Skip to widget 1")).to_be_focused()


def test_a_prediction_holds_the_answer_back_until_the_reader_commits(page):
    box, switch = page.locator(".admonition.predict").first, page.locator(".predict-switch")
    held = [page.get_by_text(each) for each in ("[0, 1, 2, 3", "Ten numbers.", "And how long")]
    assert all(each.evaluate(HELD) for each in held)  # to the next heading or box
    expect(box.get_by_text("The cell below")).to_be_hidden()
    expect(switch).to_contain_text("3 predictions, 0 answered.")
    box.get_by_role("radio", name="None").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(box.get_by_text("The cell below")).to_be_visible()
    expect(switch).to_contain_text("3 predictions, 1 answered.")
    assert not any(each.evaluate(HELD) for each in held)
    come_back(page)
    assert not held[0].evaluate(HELD)
    box.get_by_role("button", name="Ask me again").click()
    assert held[0].evaluate(HELD)
    box.locator("summary").click()  # not to answer is allowed
    page.wait_for_function(f"node => !({HELD})(node)", arg=held[0].element_handle())


def test_a_choice_a_number_and_a_place_are_told_kept_and_asked_again(page):
    choice, number, place = page.locator(".admonition.predict").all()
    field, (left, bottom) = number.get_by_role("textbox"), place.get_by_role("spinbutton").all()
    picture, marks = page.locator(".predict-picture img"), page.locator(".predict-picture span")
    expect(marks.filter(visible=True)).to_have_count(0)
    size = picture.bounding_box()
    picture.click(position={"x": 0.5 * size["width"], "y": 0.8 * size["height"]})
    expect(left).to_have_value("50")
    expect(bottom).to_have_value("20")
    for box, entry, wrong in ((number, field, "long"), (place, left, "101")):
        entry.fill(wrong)
        expect(box.get_by_role("button", name="Commit")).to_be_disabled()
    expect(choice.get_by_role("button", name="Commit")).to_be_disabled()
    field.fill("−0,5")  # with the sign and the comma of a text
    expect(number.get_by_role("button", name="Commit")).to_be_enabled()
    field.fill("0.5")
    left.fill("39")
    left.press("ArrowUp")  # by keyboard alone
    field.press("Enter")
    left.press("Enter")
    choice.get_by_role("radio", name="Half of them").check()
    choice.get_by_role("button", name="Commit").click()
    for visit_again in (True, False):
        expect(choice.get_by_role("status")).to_have_text("You said 2; it is 3.")
        expect(number.get_by_role("status")).to_have_text("You said 0.5 m; it is 1.00 m.")
        off = "Your place is 10 % of the picture's width from the ring."
        expect(place.get_by_role("status")).to_have_text(off)
        expect(marks.filter(visible=True)).to_have_count(2)
        if visit_again:
            come_back(page)
    page.emulate_media(media="print")
    expect(page.get_by_role("button", name="Ask me again")).to_have_count(0)
    page.emulate_media(media="screen")
    place.get_by_role("button", name="Ask me again").click()
    expect(left).to_have_value("")
    expect(marks.filter(visible=True)).to_have_count(0)


def test_what_is_held_back_is_shown_by_the_switch_the_address_and_a_link(page):
    answer, address = page.get_by_text("[0, 1, 2, 3"), page.url
    still = page.locator(".predict-still")
    page.evaluate("() => window.drawWidgets()")
    assert still.evaluate(HELD)  # a widget stands there, and does not move
    assert still.locator("canvas").first.bounding_box()["height"] > 100
    page.evaluate("() => { location.hash = 'widget-2'; }")
    page.wait_for_function(f"node => !({HELD})(node)", arg=still.element_handle())
    assert answer.evaluate(HELD)
    page.get_by_role("button", name="shown").click()
    come_back(page)  # the switch is remembered
    assert not answer.evaluate(HELD)
    page.get_by_role("button", name="held back").click()
    assert answer.evaluate(HELD)
    page.goto(f"{address}?answers")
    assert not answer.evaluate(HELD)


def test_a_picture_with_italic_words_below_is_a_figure_with_a_number(page):
    """No text and no picture of a widget is one, and words that stand apart are no caption."""
    figures = page.locator("article figure")
    assert figures.locator(".caption-text").all_inner_texts() == ["One.", "Two."]
    assert figures.evaluate_all("all => all.map(each => each.id)") == ["figure-1", "figure-2"]
    expect(page.locator(".cell_output > #figure-2 img")).to_be_visible()
    expect(page.get_by_text("It is proven.", exact=True)).to_be_visible()


def test_cells_of_a_picture_share_a_fold_and_those_of_a_solution_a_dropdown(page):
    """Over text, too; what the check of an unsolved exercise says is left out."""
    folded = page.locator("#figures details pre").all_text_contents()
    joined = "figure = book_figure(1.0)\n\n\nfigure.subplots()\nfigure"
    assert [each.strip() for each in folded] == [joined, "figure"]
    assert page.locator("#exercises details").evaluate_all(WORDS) == [
        "Solution Because. x = 1 x + 1 2", "Hint Count.", "Solution in code x + 2 3"
    ]  # fmt: skip
    told = page.locator("#exercises > .cell > .cell_output").evaluate_all(WORDS)
    assert told == ["✗ is told where nothing is asked."]


@pytest.mark.skipif(not WRITTEN_HERE, reason="another book has no such address")
def test_one_line_of_the_configuration_brings_the_launch_buttons(html):
    page = (html / "notebooks/09_problems.html").read_text("utf-8")
    name = "some-school/some-course"  # of the fixture
    at = "notebooks/09_problems.ipynb"
    assert f"https://mybinder.org/v2/gh/{name}/main?urlpath=lab/tree/{at}" in page
    assert f"https://colab.research.google.com/github/{name}/blob/main/{at}" in page
    assert 'href="../_sources/notebooks/09_problems.ipynb"' in page
    assert "install-labkit" not in page


@pytest.mark.pages
def test_all_that_labkit_exports_is_on_the_api_page_to_which_chapters_lead(html: Path):
    page = (html / "book/api.html").read_text("utf-8")
    told = set(re.findall(r'id="labkit\.(?:\w+\.)*(\w+)"', page))
    assert not {name for package in (labkit, *DOCUMENTED) for name in package.__all__} - told
    chapter = (html / "notebooks/02_alignment.html").read_text("utf-8")
    assert 'href="../book/api.html#labkit.align"' in chapter

"""The students' edition: no line of a solution in it, and a search that would find one."""

from __future__ import annotations

import doctest
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import excerpts
import for_lab
import launch
import leaks
import nbformat
import plain_markdown
import pytest
import solutions
import students_edition as edition
from bs4 import BeautifulSoup
from leaks import find_leaks, only_secret
from nbconvert import HTMLExporter
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from packaging.requirements import Requirement
from solutions import SolutionMarkError, strip_notebook

ROOT = Path(__file__).parents[2]
CODE = "def f(x):\n    '''Twice.'''\n    ### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION"
STUB = "def f(x):\n    '''Twice.'''\n    # YOUR CODE HERE\n    raise NotImplementedError()"
NBGRADER = {"schema_version": 3, "grade_id": "f", "grade": False, "solution": True}
SECRET = "the derivative of the cost vanishes where the centroids coincide"
PUBLIC = "the derivative of the cost is a vector"


@pytest.mark.parametrize("module", [excerpts, solutions, leaks, launch, plain_markdown])
def test_the_examples_in_the_docstrings(module):
    assert doctest.testmod(module).failed == 0


# What is taken out


def test_each_mark_of_a_solution_leaves_its_stub_and_all_else_stays():
    """Nothing of an output stays, and a folded cell with a stub is open."""
    output, tagged = nbformat.v4.new_output("stream", text=SECRET), {"tags": ["solution"]}
    folded = {"tags": ["hide-input", "raises"], "jupyter": {"source_hidden": True}}
    cells = [
        new_code_cell(CODE, metadata={"nbgrader": dict(NBGRADER)} | folded),
        new_markdown_cell(SECRET, metadata=tagged),
        new_code_cell("f(3)", metadata=tagged, outputs=[output]),
        new_code_cell("assert f(3) == 6", metadata={"tags": ["remove-cell"]}),
        new_markdown_cell(SECRET, metadata={"nbgrader": dict(NBGRADER)}),
        new_code_cell("f(4)", outputs=[output], execution_count=3),
        new_markdown_cell("Go on."),
    ]
    left, taken = strip_notebook(new_notebook(cells=cells), "a.ipynb")
    sources = [cell.source for cell in left.cells]
    assert sources == [STUB, "YOUR ANSWER HERE", "f(4)", "Go on."]
    assert taken == ["    return 2 * x\n", SECRET, "f(3)", SECRET]
    assert SECRET not in nbformat.writes(left)
    assert left.cells[0].metadata == {"nbgrader": NBGRADER, "tags": ["raises"], "jupyter": {}}
    assert left.metadata["mystnb"]["execution_mode"] == "off"


UNTAGGED = "a.ipynb, cell 1: .* with the tag `solution`"


@pytest.mark.parametrize(
    ("made", "source", "message"),
    [
        (new_markdown_cell, f"Why?\n\n:::{{solution}} ex-a\n{SECRET}\n:::", UNTAGGED),
        (new_markdown_cell, f":::{{dropdown}} Solution to the first part\n{SECRET}\n:::", UNTAGGED),
        (new_markdown_cell, f"- one\n\n  ```{{admonition}} Solution\n  {SECRET}\n  ```", UNTAGGED),
        (new_code_cell, "### BEGIN SOLUTION\nx = 1", "cell 1: '### BEGIN SOLUTION' stands without"),
        (new_code_cell, "x = 1\n### END SOLUTION", "cell 1: '### END SOLUTION' stands without"),
        (new_code_cell, f"### BEGIN SOLUTION\n{CODE}", "cell 1: '### BEGIN SOLUTION' stands"),
    ],
)
def test_a_solution_without_the_tag_and_a_mark_without_its_partner_are_refused(
    made, source, message
):
    with pytest.raises(SolutionMarkError, match=message):
        strip_notebook(new_notebook(cells=[made(source)]), "a.ipynb")


# The search finds what is there


MARKED = SECRET.replace(" ", "</em> <b class='k'>")
CELL = new_markdown_cell("\n".join(SECRET.split()))
DRAWN = '<b data-tex="{}"><svg></svg><span class="read-aloud"><math>{}</math></span></b>'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("page.html", f"<p>So {MARKED} &amp; on.</p>"),
        ("cells.ipynb", nbformat.writes(new_notebook(cells=[CELL]))),
        ("loud", SECRET.upper()),
        ("drawn.html", "so " + DRAWN.format("2 x y z", "…") + " is r"),  # counts by its source
    ],
)
def test_a_planted_leak_is_found(tmp_path, name, text):
    secrets = only_secret([SECRET, "so 2 x y z is r"], [PUBLIC])
    other = "so " + DRAWN.format("2xyz", "2 x y z") + " is r"
    (tmp_path / "clean.html").write_text(f"<p>{PUBLIC}</p>{other}", "utf-8")
    assert find_leaks(tmp_path, secrets) == []
    (tmp_path / name).write_text(text, "utf-8")
    (leak,) = find_leaks(tmp_path, secrets)
    assert leak.startswith(f"{name}: '")


# The edition


def solution_lines() -> set[str]:
    """Every line that can be told apart, found by a simpler way than the edition's own."""
    secret, public = "", ""
    for path in ROOT.glob("notebooks/**/*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            parts = re.split(r"(?s)### BEGIN SOLUTION\n(.*?)### END SOLUTION", cell.source)
            if "solution" in cell.metadata.get("tags", []):
                parts = ["", cell.source]
            public, secret = public + "\n".join(parts[::2]), secret + "\n".join(parts[1::2]) + "\n"
    lines = {line.strip() for line in secret.split("\n")}
    return {each for each in lines if len(each) >= 20 and each not in public and each[:3] != ":::"}


def test_no_line_of_a_solution_is_in_the_edition(lab):
    """Nor in its book: that is built from it."""
    lines = solution_lines()
    assert len(lines) >= 100
    spellings = {each for line in lines for each in (line, json.dumps(line)[1:-1])}
    for file in sorted(lab.rglob("*")):
        if file.suffix in (".ipynb", ".md", ".py", ".json", ".toml"):
            text = file.read_text("utf-8")
            found = [line for line in spellings if line in text]
            assert not found, f"{file.relative_to(lab)}: {found[0]}"


def test_a_solution_that_stays_stops_the_edition(course, tmp_path, monkeypatch):
    """The search does not trust what takes the solutions out."""
    strip = edition.strip_notebook

    def forget_to_strip(notebook, name):
        _, taken = strip(nbformat.from_dict(json.loads(json.dumps(notebook))), name)
        return notebook, taken

    monkeypatch.setattr(edition, "strip_notebook", forget_to_strip)
    with pytest.raises(edition.EditionError, match=r"traces of solutions[^$]*09_problems\.ipynb"):
        edition.write_edition(course, tmp_path / "student", with_book=False)
    assert list(tmp_path.iterdir()) == []


def test_another_folder_is_not_replaced(course, tmp_path):
    (tmp_path / "thesis.tex").write_text("precious", "utf-8")
    with pytest.raises(edition.EditionError, match="something else than a students' edition"):
        edition.write_edition(course, tmp_path, with_book=False)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


EACH = pytest.mark.parametrize(
    "name", [path.name for path in sorted(ROOT.glob("notebooks/*.ipynb"))]
)
# What no renderer may leave: fences, roles, labels, emphasis and links as they are typed.
RAW = re.compile(
    r".*(?::::|\{[\w:]+\}`|```|^\([\w-]+\)=|</?\w+>|\*\*|\]\(|numbering:).*", re.MULTILINE
)


def markdown(notebook):
    return "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")


@EACH
def test_a_notebook_is_drawn_without_the_book_and_its_answers_are_folded(course, lab, name):
    """As by GitHub, VS Code and Colab: none of them knows MyST."""
    notebook = nbformat.read(lab / "notebooks" / name, as_version=4)
    nbformat.validate(notebook)

    notebook.cells = [cell for cell in notebook.cells if cell.cell_type == "markdown"]

    html, _ = HTMLExporter().from_notebook_node(notebook)

    page = BeautifulSoup(html, "html.parser")
    for code in page.select("code, pre"):
        code.decompose()
    cells = page.select(".jp-RenderedMarkdown")
    assert RAW.findall("\n".join(cell.get_text() for cell in cells)) == []
    stripped, _ = strip_notebook(nbformat.read(course / "notebooks" / name, as_version=4), name)
    assert len(page.select("details > summary")) == markdown(stripped).count("{dropdown}")


@EACH
def test_every_link_of_a_students_notebook_leads_somewhere(lab, name):
    text = markdown(nbformat.read(lab / "notebooks" / name, as_version=4))

    links = re.findall(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]*))?\)", text)

    assert not [file for file, _ in links if file and not (lab / "notebooks" / file).is_file()]
    anchors = set(re.findall(r'<a id="([\w-]+)">', text))
    assert {place for file, place in links if not file} <= anchors


@EACH
def test_the_book_gets_back_what_its_author_wrote_but_in_changed_cells(lab, name):
    notebook = nbformat.read(lab / "notebooks" / name, as_version=4)
    notebook.cells[-1].source = "My own words."

    for_lab.restore(None, "", source := [nbformat.writes(notebook)])

    cells = nbformat.reads(source[0], as_version=4).cells
    written, _ = strip_notebook(nbformat.read(ROOT / "notebooks" / name, as_version=4), name)
    own = [cell.source for cell in written.cells]
    kept = [cell.source for cell in cells if cell.id != launch.CELL_ID]
    assert kept == [*own[:-1], "My own words."]


def test_a_box_in_a_list_stays_in_its_item():
    item = "1. Why?\n\n   :::{dropdown} Hint\n   Half.\n   :::"

    lines = plain_markdown.plain(item, iter([])).split("\n")

    box = ["   <details>", "   <summary>Hint</summary>", "", "   Half.", "", "   </details>"]
    assert lines == ["1. Why?", "", *box]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (":::{tip} So\nDo.\n:::", "a box 'tip' has no form in plain Markdown"),
        (":::{dropdown} Hint\nHalf.", "a box that ':::' has to close stays open"),
    ],
)
def test_a_box_that_has_no_plain_form_is_refused(text, message):
    with pytest.raises(plain_markdown.UnknownBoxError, match=message):
        plain_markdown.plain(text, iter([]))


def test_the_students_packages_have_no_tools_of_the_tests(lab):
    pins = re.findall(r"(?m)^([\w.-]+)(?:\[.*\])?==", (lab / "requirements.txt").read_text("utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    tools = {Requirement(text).name for text in project["dependency-groups"]["test"]}

    assert set(pins) & tools == {"websocket-client"}  # which JupyterLab's server needs, too
    assert {"jupyterlab", "numba", "jupyter-book"} <= set(pins)


def test_students_get_the_commands_that_work_for_them():
    makefile = edition.without_commands((edition.ROOT / "Makefile").read_text("utf-8"))
    assert re.findall(r"(?m)^(\w+):.*##", makefile) == ["help", "book", "lab", "clean"]
    assert ".PHONY: help book lab clean\n" in makefile
    assert "bin/pytest" not in makefile


def test_the_package_works_without_the_files_that_are_kept_back(lab):
    names = [path.relative_to(lab).as_posix() for path in lab.rglob("*")]
    assert not [name for name in names if re.search(r"authoring|hidden|__pycache__|vendor", name)]
    code = "import labkit.cli as cli, labkit.course.exercises.checking as c; print(c.__file__); "
    command = [sys.executable, "-c", code + "cli.main(['-h'])"]
    told = {**os.environ, "PYTHONPATH": str(lab)}
    said = subprocess.run(command, cwd=lab, env=told, stdout=subprocess.PIPE, text=True, check=True)
    assert said.stdout.startswith(str(lab))
    assert "odometry" in said.stdout


# Launch


def test_a_notebook_fetches_labkit_where_it_is_missing(course, lab):
    notebook = nbformat.read(lab / "notebooks/09_problems.ipynb", as_version=4)
    first = next(cell for cell in notebook.cells if cell.cell_type == "code")
    assert first.id == launch.CELL_ID
    assert "git+{}@{}".format(*launch.repository(course / "_config.yml")) in first.source
    code = first.source.replace("    %pip install --quiet", "    missing = ")
    exec(compile(code, "cell", "exec"), namespace := {})
    assert "missing" not in namespace  # here it is not


def options(url: str) -> SimpleNamespace:
    buttons = {"repository_url": url, "launch_buttons": {"colab_url": "x"}}
    return SimpleNamespace(html_theme_options=buttons, html_baseurl="", copyright="")


def test_the_workflow_s_variable_names_the_repository_in_the_configuration_that_it_hands_out(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("STUDENTS_REPOSITORY", "Some-School/lab")
    url, _ = launch.repository(ROOT / "_config.yml")
    handed_out = tmp_path / "_config.yml"

    text = (ROOT / "_config.yml").read_text("utf-8")
    handed_out.write_text(launch.with_address(text, url), "utf-8")

    monkeypatch.delenv("STUDENTS_REPOSITORY")
    assert launch.repository(handed_out) == ("https://github.com/Some-School/lab", "main")


def test_the_pages_of_a_repository_on_github_know_their_address():
    launch.settle_buttons(None, config := options("https://github.com/Some-School/lab"))

    assert config.html_baseurl == "https://some-school.github.io/lab/"


def test_the_footer_names_version_commit_and_year(monkeypatch):
    monkeypatch.setenv("GITHUB_SHA", "0123456789abcdef")

    launch.settle_footer(None, config := options(""))

    assert config.html_theme_options["extra_footer"].endswith(", commit 0123456")
    assert re.fullmatch(r"20\d\d", config.copyright)


def test_without_an_address_there_are_no_buttons_and_one_that_leads_nowhere_is_refused():
    launch.settle_buttons(None, without := options(""))
    assert without.html_theme_options["launch_buttons"] == {}
    assert launch.repository(ROOT / "_config.yml")[0] == ""
    for url in ("some-course", "https://github.com/some-school"):
        with pytest.raises(Exception, match=re.escape(f"got '{url}'")):
            launch.settle_buttons(None, options(url))

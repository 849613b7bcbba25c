"""From a notebook or Markdown to one page of HTML: whole, freshly run, without the network."""

import base64
import re

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from labkit.course.report import ReportError, pages, read_report, render

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def write(path, *cells):
    nbformat.write(new_notebook(cells=list(cells)), path)
    return path


def test_text_tables_and_formulas_come_without_code_and_without_the_network(tmp_path):
    page = tmp_path / "report.md"
    (tmp_path / "map.png").write_bytes(PIXEL)
    page.write_text(
        "---\njupytext: {}\n---\n# My <report>\n\n| a | b |\n|---|--:|\n| x | 1 |\n\n"
        "The $\\bar{q}$ of\n\n$$\nJ = \\sum_i r_i^2\n$$\n\n![the map](map.png)\n",
        "utf-8",
    )
    html = render(read_report(page), tmp_path)
    assert "<title>My &lt;report&gt;</title>" in html
    assert "jupytext" not in html
    assert "<td" in html
    assert html.count("<math") == 2
    assert "$" not in html
    assert 'src="data:image/png;base64,' in html
    assert 'alt="the map"' in html
    assert not re.search(r"<script|<link|https?://(?!www\.w3\.org)", html)


def test_a_notebook_is_run_and_its_code_is_left_out(tmp_path):
    path = write(
        tmp_path / "report.ipynb",
        new_markdown_cell("# Report"),
        new_code_cell("secret = 6\nprint(f'{7 * secret} inliers')"),
    )
    html = render(read_report(path))
    assert "42 inliers" in html
    assert "secret" not in html
    assert "42 inliers" not in render(read_report(path, run=False))
    assert nbformat.read(path, as_version=4).cells[1].outputs == []  # the file stays as it was


@pytest.mark.parametrize(
    ("latex", "parts"),
    [
        (r"$\displaystyle \frac{a}{b}$", "<mfrac"),
        ("$$x^2$$", "<msup"),
        (r"\[x^2\]", "<msup"),
        (r"\(x^2\)", "<msup"),
        ("$$\n  x^2\n- y\n$$", "<msup"),
        (r"\begin{pmatrix} x^2 & 1 \\[1ex] 2 & 3 \end{pmatrix}", "<mtable"),
        (r"\begin{align}x^2 &= 1\\y &= 2\end{align}", "<mtable"),
    ],
)
def test_a_formula_that_a_cell_displays_is_drawn(tmp_path, latex, parts):
    data = {"text/latex": latex, "text/plain": "<IPython.core.display.Math object>"}
    output = nbformat.v4.new_output("display_data", data)
    notebook = read_report(write(tmp_path / "a.ipynb", new_code_cell(outputs=[output])), run=False)
    html = render(notebook)
    assert html.count("<math") == 1
    assert parts in html
    assert "$" not in html
    assert "IPython" not in html
    assert notebook.cells[0].outputs[0].data == data  # as it was


def test_a_displayed_formula_that_cannot_be_read_is_named(tmp_path):
    output = nbformat.v4.new_output("display_data", {"text/latex": "$x_$"})
    path = write(tmp_path / "a.ipynb", new_markdown_cell("# A"), new_code_cell(outputs=[output]))
    with pytest.raises(ReportError, match=r"a\.ipynb: cell 2: the formula \$x_\$ cannot be read"):
        render(read_report(path, run=False))


def test_a_picture_in_html_that_a_cell_displays_goes_into_the_page(tmp_path):
    def displaying(source):
        output = nbformat.v4.new_output("display_data", {"text/html": source})
        path = write(tmp_path / "a.ipynb", new_code_cell(outputs=[output]))
        return render(read_report(path, run=False), tmp_path)

    (tmp_path / "a.png").write_bytes(PIXEL)
    url = f"data:image/png;base64,{base64.b64encode(PIXEL).decode()}"
    assert f'src="{url}"' in displaying('<p><img alt="a" src="a.png"/></p>')
    assert f'src="{url}"' in displaying(f"<img alt='a' src='{url}'>")
    with pytest.raises(
        ReportError, match=r"a\.ipynb: cell 1: the picture 'https://x\.org/a\?b=1&c"
    ):
        displaying('<img src="https://x.org/a?b=1&amp;c=2">')


def test_its_title_is_a_heading_and_no_comment(tmp_path):
    path = write(
        tmp_path / "a.ipynb",
        new_code_cell("# setup: imports\nx = 1"),
        new_markdown_cell("```\n# first\n```\n\n# My report\n\n# More"),
    )
    assert "<title>My report</title>" in render(read_report(path, run=False))


def test_a_byte_order_mark_is_no_part_of_the_report(tmp_path):
    notebook = write(tmp_path / "report.ipynb", new_markdown_cell("# Report"))
    page = tmp_path / "report.md"
    page.write_text("---\njupytext: {}\n---\n# Report\n", "utf-8")
    for path in (notebook, page):
        plain = read_report(path, run=False).cells[0].source
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
        assert read_report(path, run=False).cells[0].source == plain


def test_a_figure_keeps_its_words(tmp_path):
    output = nbformat.v4.new_output(
        "display_data", {"image/png": base64.b64encode(PIXEL).decode(), "text/plain": "figure"}
    )
    cell = new_code_cell("figure", outputs=[output])
    cell.metadata["mystnb"] = {"image": {"alt": "a map of the building"}}
    html = render(read_report(write(tmp_path / "a.ipynb", cell), run=False))
    assert 'alt="a map of the building"' in html


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("report.txt", "x", r"report\.txt: a report is a notebook \(\.ipynb\) or Markdown"),
        ("report.ipynb", "{", r"report\.ipynb: is no notebook: "),
        ("missing.md", None, r"missing\.md: cannot be read: No such file"),
        ("report.md", b"\xff\xfe", r"report\.md: cannot be read: it is not UTF-8"),
    ],
)
def test_what_is_no_report_is_refused(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ReportError, match=message):
        read_report(tmp_path / name)


def test_a_cell_that_fails_is_named(tmp_path):
    path = write(tmp_path / "a.ipynb", new_markdown_cell("# A"), new_code_cell("1 / 0"))
    with pytest.raises(ReportError, match=r"a\.ipynb: cell 2: ZeroDivisionError: division by zero"):
        read_report(path)


def test_a_cell_that_may_fail_is_not_taken_for_the_one_that_may_not(tmp_path):
    allowed = new_code_cell("1 / 0", metadata={"tags": ["raises-exception"]})
    path = write(tmp_path / "a.ipynb", new_markdown_cell("# A"), allowed, new_code_cell("3 / 0"))
    with pytest.raises(ReportError, match=r"a\.ipynb: cell 3: ZeroDivisionError"):
        read_report(path)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("%matplotlb inline", "UsageError: Line magic function `%matplotlb` not found"),
        ("x = 1\n%%time", "UsageError: Line magic function `%%time` not found"),
        ("import os\nos._exit(3)", "the kernel died while it ran"),
        ("import time\ntime.sleep(60)", "ran for more than 5 s"),
    ],
)
def test_a_cell_that_fails_without_an_error_output_is_named(tmp_path, monkeypatch, source, message):
    monkeypatch.setattr(pages, "TIMEOUT", 5)
    path = write(tmp_path / "a.ipynb", new_code_cell("x = 1"), new_code_cell(source))
    with pytest.raises(ReportError, match=rf"a\.ipynb: cell 2: {re.escape(message)}"):
        read_report(path)


def test_a_kernel_that_is_not_installed_is_named(tmp_path):
    notebook = new_notebook(cells=[new_code_cell("x = 1")])
    notebook.metadata["kernelspec"] = {"name": "lab-2019", "display_name": "Lab"}
    nbformat.write(notebook, tmp_path / "a.ipynb")
    with pytest.raises(
        ReportError, match=r"a\.ipynb: asks for the kernel 'lab-2019', which is not"
    ):
        read_report(tmp_path / "a.ipynb")


@pytest.mark.parametrize(
    "formula",
    [
        "$x_$",
        "$a_b_c$",
        r"$\frac{a}{$",
        r"$\left( \frac12$",
        r"$\sqrt$",
        r"$\color$",
        r"$\begin{pmatrix}1&2$",
        "$$ $$",
        r"\begin{align}x_\end{align}",
    ],
)
def test_a_formula_that_cannot_be_read_is_named_with_its_cell(tmp_path, formula):
    page = tmp_path / "a.md"
    page.write_text(f"# A\n\nAn angle {formula}.\n", "utf-8")
    body = re.escape(formula.strip("$"))
    with pytest.raises(ReportError, match=rf"a\.md: the formula \${body}\$ cannot be read") as told:
        render(read_report(page))
    assert "\n" not in str(told.value)
    path = write(tmp_path / "a.ipynb", new_markdown_cell("# A"), new_markdown_cell(formula))
    with pytest.raises(ReportError, match=r"a\.ipynb: cell 2: the formula"):
        render(read_report(path, run=False))


@pytest.mark.parametrize("name", ["p.png", "my pic.png"])
def test_a_picture_pasted_into_a_cell_goes_into_the_page(tmp_path, name):
    pasted = {name: {"image/png": base64.b64encode(PIXEL).decode()}}
    text = f"![a](attachment:{name.replace(' ', '%20')})"
    path = write(tmp_path / "a.ipynb", new_markdown_cell(text, attachments=pasted))
    assert f'src="data:image/png;base64,{pasted[name]["image/png"]}"' in render(
        read_report(path, run=False)
    )


@pytest.mark.parametrize(
    "text", ["![a](my%20pic.png)", "![a](<my pic.png>)", '<img src="my pic.png" alt="a">']
)
def test_a_picture_beside_the_report_goes_into_the_page(tmp_path, text):
    (tmp_path / "my pic.png").write_bytes(PIXEL)
    (tmp_path / "a.md").write_text(f"# A\n\n{text}\n", "utf-8")
    html = render(read_report(tmp_path / "a.md"), tmp_path)
    assert f'src="data:image/png;base64,{base64.b64encode(PIXEL).decode()}"' in html


def test_a_picture_that_is_a_data_url_stays(tmp_path):
    url = f"data:image/png;base64,{base64.b64encode(PIXEL).decode()}"
    (tmp_path / "a.md").write_text(f"![a]({url})\n", "utf-8")
    assert f'src="{url}"' in render(read_report(tmp_path / "a.md"), tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("![a](attachment:p.png)", "the picture 'p.png' is not attached to the cell, which has no"),
        ("![a](none.png)", "the picture 'none.png' cannot be read: No such file"),
        ("![a](https://x.org/a.png)", "the picture 'https://x.org/a.png' lies on the network"),
        ('<img src="//x.org/a.png">', "the picture '//x.org/a.png' lies on the network"),
        ("![a](../a.png)", "the picture '../a.png' lies outside of "),
        ("![a](.)", "the picture '.' cannot be read: "),
        ("![a](a%00.png)", r"the picture 'a\x00.png' cannot be read: "),
        ("![a](a.md)", "'a.md' is no picture that a page can show"),
    ],
)
def test_a_picture_that_cannot_go_into_the_page_is_named(tmp_path, text, message):
    (tmp_path / "a.md").write_text(f"# A\n\n{text}\n", "utf-8")
    with pytest.raises(ReportError, match=rf"a\.md: {re.escape(message)}"):
        render(read_report(tmp_path / "a.md"), tmp_path)

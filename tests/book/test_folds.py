"""A page shows of an exercise what its reader needs, and not how it is made."""

from docutils import nodes
from docutils.utils import new_document
from folds import is_dropdown, tidy_cells


def test_no_mark_of_a_solution_and_no_hidden_test_is_in_a_page_s_code():
    source = (
        "def f(x):\n    ### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION\n\n\n"
        "check(f)\n### BEGIN HIDDEN TESTS\nassert check(f).passed\n### END HIDDEN TESTS"
    )
    page = new_document("page")
    page += nodes.literal_block(source, source)

    tidy_cells(None, page)

    assert page.astext() == "def f(x):\n    return 2 * x\n\n\ncheck(f)"


def test_the_cells_of_a_solution_share_one_dropdown():
    page = new_document("page")
    for source in ("first = 1", "second = 2", "third = 3"):
        cell = nodes.container("", nodes.literal_block(source, source), nb_element="cell_code")
        cell["hide_mode"] = "all"
        page += cell

    tidy_cells(None, page)

    (dropdown,) = page.children
    assert is_dropdown(dropdown)
    assert [block.astext() for block in dropdown.findall(nodes.literal_block)] == [
        "first = 1",
        "second = 2",
        "third = 3",
    ]

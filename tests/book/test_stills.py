"""The picture that a widget brings stands below it, for paper."""

from docutils import nodes
from stills import WIDGET, keep_stills


def test_the_picture_of_a_widget_stands_below_it_with_words_for_it():
    picture = nodes.container("", nodes.image(uri="room.png"), mime_type="image/png")
    widget = nodes.container("", mime_type=WIDGET)
    bundle = nodes.container("", widget, picture, nb_element="mime_bundle")
    cell = nodes.container("", bundle)

    keep_stills(None, cell)

    shown, still = cell.children
    assert shown is bundle
    assert bundle.children == [widget]
    assert still["classes"] == ["still"]
    (image,) = still.findall(nodes.image)
    assert image["alt"]

"""The API page names what labkit exports, and chapters lead to it."""

from __future__ import annotations

import re
from pathlib import Path

import labkit

PACKAGES = (labkit.logs, labkit.odometry, labkit.evaluation, labkit.simulation, labkit.plotting)


def test_all_that_labkit_exports_is_on_the_page(html: Path):
    page = (html / "book/api.html").read_text("utf-8")
    told = set(re.findall(r'id="labkit\.(?:\w+\.)*(\w+)"', page))
    assert not {name for package in (labkit, *PACKAGES) for name in package.__all__} - told


def test_a_chapter_leads_to_it(html: Path):
    chapter = (html / "notebooks/02_alignment.html").read_text("utf-8")
    assert 'href="../book/api.html#labkit.align"' in chapter

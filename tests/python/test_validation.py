"""Claims of docs/validation.md: ours are the published figures, to their digits."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = runpy.run_path(str(ROOT / "docs" / "validation.py"))


@pytest.mark.parametrize("title", PAGE["SECTIONS"])
def test_figures_are_the_published_ones(title):
    for figure in PAGE["SECTIONS"][title]():
        assert abs(figure.difference) <= figure.digits, figure


def test_the_page_lists_every_figure():
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    for figures in PAGE["figures"]().values():
        for figure in figures:
            assert f"| {figure.what} | {figure.published:.7g} |" in text

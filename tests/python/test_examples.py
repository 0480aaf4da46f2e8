"""Claims of the examples and of the README's code: they run."""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "path", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem
)
def test_an_example_runs(path, capsys):
    runpy.run_path(str(path), run_name="__main__")
    assert "nan" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "page", ["README.md", "docs/structures.md", "docs/beams.md", "docs/nonlinear.md"]
)
def test_the_code_of_a_page_runs(page):
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(block, names)


def test_steps_of_a_free_beam_end_at_the_same_place(capsys):
    runpy.run_path(str(ROOT / "examples" / "free_beam.py"))
    ends = {line.split("ends at")[1] for line in capsys.readouterr().out.splitlines()[1:]}
    assert len(ends) == 1

"""The notebooks run from top to bottom, somewhere else, and are kept without what they print."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
SAID = {"teach": "learned: 500.0 points on average", "research": "report studies/poles/report.md"}
"""What one of their cells prints."""


def cells(path, kind):
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in found if cell["cell_type"] == kind]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs_and_its_cells_are_python(path):
    assert path.stem in SAID
    for cell in cells(path, "code"):
        assert (cell["outputs"], cell["execution_count"]) == ([], None)
        lines = [line for line in cell["source"] if not line.startswith("%")]
        compile("".join(lines), path.name, "exec")


def test_answers_are_hidden_and_each_exercise_has_one():
    texts = ["".join(cell["source"]) for cell in cells(FOLDER / "teach.ipynb", "markdown")]
    whole = "\n".join(texts)
    assert whole.count("<summary>An answer</summary>") == whole.count("### Exercise") == 5
    assert whole.count("<details>\n") == whole.count("\n</details>") == 5


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient", reason="comes with the extra `docs`")
    nbformat = pytest.importorskip("nbformat", reason="comes with the extra `docs`")
    monkeypatch.setenv("SEEDS", "2")
    notebook = nbformat.read(path, 4)
    place = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=place).execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", ())]
    assert any(SAID[path.stem] in out.get("text", "") for out in outputs)
    pictures = [kind for out in outputs for kind in out.get("data", {}) if kind == "image/png"]
    assert len(pictures) >= 2

"""The notebooks of the manual run from top to bottom, show tables and pictures, and are kept without outputs."""

from pathlib import Path

import nbclient
import nbformat
import pytest
from manual.pages import ROOT

pytestmark = pytest.mark.docs

NOTEBOOKS = sorted((ROOT / "bayesub" / "manual" / "notebooks").glob("*.ipynb"))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # those of Jupyter
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path):
    """In a kernel of its own; every object that a cell ends with has shown itself."""
    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)
    nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    outputs = [output for cell in code for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error" or output.get("name") == "stderr"]
    kinds = [kind for output in outputs for kind in output.get("data", {})]
    assert kinds.count("image/png") == sum(cell.source.endswith(".plot()") for cell in code) > 0
    assert kinds.count("text/html") >= 2
    assert "Converged." in "".join(output["data"].get("text/html", "") for output in outputs if "data" in output)


def test_there_is_one_for_each_audience():
    assert [Path(path).stem for path in NOTEBOOKS] == ["naval_architect", "uq_researcher"]

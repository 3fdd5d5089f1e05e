"""The example notebook runs, and is stored without outputs."""

from __future__ import annotations

import nbformat
from conftest import TOP
from nbclient import NotebookClient

NOTEBOOK = TOP / "examples" / "python" / "recording_to_block.ipynb"


def test_the_notebook_runs_from_a_recording_to_a_block() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells)
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    said = {k: "".join(output.get("text", "") for output in cell.get("outputs", [])) for k, cell in enumerate(notebook.cells)}
    (names,) = (text for text in said.values() if text.startswith("hidden:"))
    hidden, found = (line.split()[1:] for line in names.splitlines())
    assert hidden == found
    shown = [output["data"] for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]
    assert sum("text/html" in data for data in shown) >= 4 and any("image/png" in data for data in shown)

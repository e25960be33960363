"""The notebook and the examples of the documents run as they stand, on the installed package."""

import base64
import os
import pathlib
import re

import nbclient
import nbformat
import pytest
from conftest import FIXTURES, ROOT

import scan2params

NOTEBOOKS = sorted((ROOT / "python" / "notebooks").glob("*.ipynb"))


def test_it_is_the_installed_package_that_is_tested():
    assert ROOT not in pathlib.Path(scan2params.__file__).resolve().parents


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_a_notebook_runs_and_draws(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        assert not cell.get("outputs"), "stored without what it prints: clear it"
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}})
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures = [output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) >= 1
    # where a person wants to look at them
    folder = pathlib.Path(os.environ.get("NOTEBOOK_PICTURES", tmp_path))
    for number, picture in enumerate(pictures):
        content = base64.b64decode(picture)
        assert len(content) > 20_000
        (folder / f"{path.stem}-{number}.png").write_bytes(content)


@pytest.mark.parametrize("name", ["docs/python.md", "python/README.md"])
def test_the_examples_of_a_document_run(name, tmp_path, monkeypatch):
    (tmp_path / "fixtures").symlink_to(FIXTURES)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / name).read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    known = {}
    for block in blocks:
        exec(compile(block, name, "exec"), known)

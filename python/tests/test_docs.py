# SPDX-License-Identifier: Apache-2.0
"""The commands and code blocks of the documents work."""
import json
import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_the_blocks_of_the_document_run_one_after_the_other(flight, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    os.symlink(flight, tmp_path / "MH_01_easy")
    blocks = re.findall(r"<!-- run -->\n```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL)
    assert len(blocks) == 3
    names = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102
    assert (tmp_path / "flight.svg").exists() and (tmp_path / "flat.fbm").exists()
    assert len(names["run"].trajectory) > 50 and names["boosted"][0].shape[1] == 32


def test_the_readme_has_the_same_ten_lines():
    block = re.search(r"<!-- run -->\n```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL)[1]
    assert block in (ROOT / "README.md").read_text()


def test_the_example_beside_opencv(flight):
    pytest.importorskip("cv2")
    said = subprocess.run([sys.executable, ROOT / "examples" / "boost_beside_opencv.py", flight, "--pairs", "3", "--gap", "2"],
                          check=True, capture_output=True, text=True)
    correct = {line[:14].strip(): float(line[14:21]) for line in said.stdout.splitlines()[1:]}
    assert correct["fbvins.boost"] > 30 and correct["fbvins.orb"] > 30


def test_the_notebook_runs(flight, monkeypatch):
    pytest.importorskip("cv2")
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.setenv("FBVINS_RECORDING", str(flight))
    notebook = json.loads((ROOT / "examples" / "booster.ipynb").read_text())
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "booster.ipynb", "exec"), names)  # noqa: S102

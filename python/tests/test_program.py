# SPDX-License-Identifier: Apache-2.0
"""The command `fbvins` of the package: it becomes the program that lies in it."""
import pathlib
import subprocess
import sys

import fbvins
from fbvins import _program

COMMAND = [sys.executable, "-c", "from fbvins._program import main; main()"]


def says(*arguments):
    return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_it_is_the_program():
    done = says("--version")
    assert done.returncode == 0 and done.stdout.startswith(f"fbvins {fbvins.__version__}\n"), done
    assert says("run", "/nowhere").returncode == 2


def test_its_results_are_those_of_the_module(flight, tmp_path):
    done = says("run", flight, "--frontend", "boost", "--out", tmp_path / "program", "--quiet")
    assert done.returncode == 0, done
    fbvins.run(str(flight), frontend="boost").save(str(tmp_path / "module"))
    assert (tmp_path / "program" / "trajectory_tum.txt").read_bytes() == (tmp_path / "module" / "trajectory_tum.txt").read_bytes()


def test_every_program_is_there():
    for command in ("run", "info", "convert", "target", "live", "bench"):  # of six programs
        assert says(command, "--help").returncode == 0, command


def test_devices_are_read_by_the_python_of_the_package(tmp_path, monkeypatch):
    (tmp_path / "oak_bridge.py").write_text("import sys\nsys.exit('read by ' + sys.executable)\n", encoding="ascii")
    monkeypatch.setenv("FBVINS_BRIDGES", str(tmp_path))
    monkeypatch.delenv("FBVINS_PYTHON", raising=False)
    done = says("live", "--source", "oak")
    assert done.returncode == 2 and "oak: read by " + sys.executable in done.stderr, done


def test_a_package_without_its_program_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(_program, "PROGRAM", pathlib.Path(tmp_path) / "fbvins")
    try:
        _program.main()
    except SystemExit as end:
        assert "No such file" in str(end) and "install" in str(end)
    else:
        raise AssertionError("it ended without a word")

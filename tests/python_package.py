#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the Python package's own tests (python/tests) on the package in the build folder.

usage: python_package.py FBVINS PYTHON FOLDER      exit 77 (skipped) where the package has not been built
"""
import os
import pathlib
import subprocess
import sys


def main():
    program, python, folder = sys.argv[1:4]
    if not (pathlib.Path(folder) / "fbvins").is_dir():
        print("skipped: the Python package was not built; that needs nanobind and numpy in build/venv and Python's headers (python3-dev)")
        return 77
    repository = pathlib.Path(__file__).resolve().parents[1]
    data = os.environ.get("FBVINS_DATA") or str(repository.parent / "shared" / "data")
    environment = dict(os.environ, PYTHONPATH=folder, FBVINS=program, FBVINS_DATA=data)
    command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(repository / "python" / "tests")]
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Recordings of the tests: a rendered flight always, a real one where FBVINS_DATA names the folder that holds it."""
import os
import pathlib
import subprocess

import pytest


@pytest.fixture(scope="session")
def program():
    """The program to compare with: $FBVINS."""
    path = os.environ.get("FBVINS", "")
    if not path:
        pytest.skip("FBVINS does not name the program")
    return path


@pytest.fixture(scope="session")
def flight(program, tmp_path_factory):
    """A rendered flight of six seconds, an EuRoC folder."""
    folder = tmp_path_factory.mktemp("flight")
    subprocess.run([program, "simulate", "fast", "--seconds", "6", "--seed", "3", "--out", str(folder), "--quiet"], check=True)
    return folder


@pytest.fixture(scope="session")
def real_flight():
    folder = pathlib.Path(os.environ.get("FBVINS_DATA", "")) / "MH_01_easy_17s"
    if not os.environ.get("FBVINS_DATA") or not folder.exists():
        pytest.skip("FBVINS_DATA does not name a folder that holds MH_01_easy_17s")
    return folder

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders the flight that tests without real data share: three seconds at rest, then motion. Done once, and again where the renderer has changed.

usage: simulated_flight.py FBVINS FOLDER [RENDERER]      RENDERER: a file that is newer than the flight where it has changed
"""
import pathlib
import shutil
import subprocess
import sys

OPTIONS = ["normal", "--seconds", "13", "--seed", "3", "--set", "flight.rest_s=3", "--set", "flight.max_speed_mps=1.5"]


def is_there(folder, renderer):
    wanted = folder / "options"
    if not wanted.exists() or wanted.read_text(encoding="utf-8") != repr(OPTIONS):
        return False
    return renderer is None or wanted.stat().st_mtime >= pathlib.Path(renderer).stat().st_mtime


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    if is_there(folder, sys.argv[3] if len(sys.argv) > 3 else None):
        return 0
    part = folder.with_name(folder.name + ".part")
    for old in (folder, part):
        shutil.rmtree(old, ignore_errors=True)
    part.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run([program, "simulate", *OPTIONS, "--quiet", "--out", part], check=True)
    (part / "options").write_text(repr(OPTIONS), encoding="utf-8")
    part.rename(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())

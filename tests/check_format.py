#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that clang-format 14 changes nothing in the sources (.clang-format); other versions break lines elsewhere.

usage: check_format.py [REPOSITORY]     exit 1, and one line for each file; 77: there is no clang-format 14
"""
import os
import pathlib
import shutil
import subprocess
import sys

FOLDERS = ("include", "src", "lab", "apps", "python", "tests", "bench", "examples", "ros2", "training")


def version_14():
    for name in (os.environ.get("FBVINS_CLANG_FORMAT"), "clang-format-14", "clang-format"):
        program = shutil.which(name) if name else None
        if program and " 14." in subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout:
            return program
    return None


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    program = version_14()
    if program is None:
        print("format: skipped, there is no clang-format 14 here (FBVINS_CLANG_FORMAT names one)")
        return 77
    files = sorted(str(p) for folder in FOLDERS for end in ("*.cpp", "*.hpp") for p in (root / folder).rglob(end))
    wrong = []
    for i in range(0, len(files), 100):
        said = subprocess.run([program, "--dry-run", *files[i:i + 100]], capture_output=True, text=True).stderr
        wrong += {line.split(":")[0] for line in said.splitlines() if "[-Wclang-format-violations]" in line}
    for path in sorted(wrong):
        print(f"format: {path} is not formatted: ./dev format")
    if not wrong:
        print(f"format: {len(files)} sources are formatted")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lines of tests for a line of code, of what flies: `live`, `pipeline` and the programs. Blank lines do not count. A module's tests lie beside
it and in tests/robustness (pipeline); those of the programs are the scripts in tests/ that run them.

usage: check_ratio.py REPOSITORY [--least 0.6]      exit code 1 where one has less than that
"""
import argparse
import pathlib
import re
import sys


def lines(paths):
    return sum(1 for path in paths for line in path.read_text(encoding="utf-8").splitlines() if line.strip())


def is_test(path):
    return re.search(r"(_test\.cpp|test_[a-z_]+\.hpp|_test_[a-z_]+\.hpp)$", path.name) is not None


def module(root, name, more=()):
    files = [*(root / "src/fbvins" / name).glob("*.?pp"), *(root / "include/fbvins" / name).glob("*.hpp")]
    return [f for f in files if not is_test(f)], [f for f in files if is_test(f)] + [f for pattern in more for f in root.glob(pattern)]


def programs(root):
    files = list((root / "apps").glob("*.?pp"))
    runs_them = [f for f in (root / "tests").rglob("*.py") if re.search(r"usage: .*\.py FBVINS\b", f.read_text(encoding="utf-8"))]
    return [f for f in files if not is_test(f)], [f for f in files if is_test(f)] + runs_them


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=pathlib.Path)
    parser.add_argument("--least", type=float, default=0.0)
    arguments = parser.parse_args()
    root, failed = arguments.repository, 0
    print("| | lines of code | of tests | ratio |\n|---|---|---|---|")
    for name, (code, tests) in {"live": module(root, "live"), "pipeline": module(root, "pipeline", ["tests/robustness/*.?pp"]),
                                "programs (apps)": programs(root)}.items():
        ratio = lines(tests) / lines(code)
        failed += ratio < arguments.least
        print(f"| {name} | {lines(code)} | {lines(tests)} | {ratio:.2f} |")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

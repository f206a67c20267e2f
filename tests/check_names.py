#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that no two types of a namespace share a name: in one program that would be undefined behaviour without a diagnostic.
And that each test has a namespace of its own, named as its file, since several are compiled as one (FBVINS_UNITY).

usage: check_names.py [REPOSITORY]      exit 1, and one line for each name
"""
import collections
import pathlib
import re
import sys

FOLDERS = ("include", "src", "lab", "apps", "python", "tests")
NAMESPACE = re.compile(r"namespace(?: ([\w:]+))? \{")
END = re.compile(r"\}  // namespace")
TYPE = re.compile(r"(?:class|struct|union|enum class) (\w+)(?: final)?(?: : [^;]*)? \{")


def types(path):
    """Names, with their namespaces, of the types that a file defines for others; types within types are not looked at."""
    inside = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if match := NAMESPACE.match(line):
            inside.append(match[1] or "")
        elif END.match(line):
            inside.pop()
        elif (match := TYPE.match(line)) and "" not in inside:
            yield "::".join([*inside, match[1]])


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[1])
    files, shared = collections.defaultdict(list), []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            if path.name.endswith("_test.cpp") and f"namespace {path.stem} {{" not in path.read_text(encoding="utf-8"):
                shared.append(path.relative_to(root))
            for name in types(path):
                files[name].append(str(path.relative_to(root)))
    twice = {name: paths for name, paths in sorted(files.items()) if len(paths) > 1}
    for name, paths in twice.items():
        print(f"{name} is defined in {' and in '.join(paths)}")
    for path in shared:
        print(f"{path} has no namespace {path.stem}")
    print(f"{len(files)} types")
    return 1 if twice or shared or not files else 0


if __name__ == "__main__":
    sys.exit(main())

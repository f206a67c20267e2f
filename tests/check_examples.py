#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the examples at the beginning of headers (comment lines indented by three spaces): each function, member and type that they
name is declared in some header, of the tests' support, too.

usage: check_examples.py [REPOSITORY]      exit 1, and one line for each name that is no header declares
"""
import functools
import pathlib
import re
import sys

FOLDERS = ("include", "src", "lab/include", "lab")
# Calls, members, and types that are constructed or named with their parameters.
NAMED = re.compile(r"(?<![\w:])((?:std|fmt|Eigen)::)?(?:[A-Za-z_]\w*::)*([A-Za-z_]\w*)(?=[({<])|(?:\.|->)([A-Za-z_]\w*)")
KEYWORDS = {"if", "for", "while", "switch", "return", "sizeof", "else", "const", "auto", "double", "int", "static_cast", "catch"}
# What an example's reader is to put in, and members of the standard library.
OPEN = {"use", "print", "offer", "plot", "for_rig", "fly_with", "chosen_by", "slow_down", "drop_all_tracks", "wait_for_more_motion", "ASSERT_TRUE", "EXPECT_TRUE", "EXPECT_LT",
        "MyFactor"}
STANDARD = {"begin", "end", "size", "empty", "front", "back", "get", "reset", "value", "value_or", "has_value", "data", "push_back",
            "first", "second", "find", "c_str", "str", "norm", "transpose", "inverse", "x", "y", "z", "w", "resize", "at", "count",
            "load", "ldlt", "store", "join", "wait", "lock", "what", "png"}


def example_of(text):
    """The lines of the example, of the comment before `#pragma once`."""
    head = text.split("#pragma once")[0]
    lines = [line[5:] for line in head.splitlines() if line.startswith("//   ")]
    return "\n".join(re.sub(r"(//|#).*$|\"[^\"]*\"", "", line) for line in lines)


@functools.cache
def code_of(path):
    return "\n".join(line.split("//")[0] for line in path.read_text(encoding="utf-8").splitlines())


@functools.cache
def words_of(path):
    return set(re.findall(r"\w+", code_of(path)))


def faults(root):
    headers = [path for folder in FOLDERS for path in sorted((root / folder / "fbvins").rglob("*.hpp"))]
    known = set().union(*(words_of(path) for path in headers + sorted((root / "tests/support").glob("*.hpp"))))
    for path in headers:
        example = example_of(path.read_text(encoding="utf-8"))
        own = set(re.findall(r"\b(?:auto|struct|[A-Z]\w*(?:<[^>]*>)?|int|double)\s+&?\*?([A-Za-z_]\w*)\s*[({=;]", example))
        for match in NAMED.finditer(example):
            name = match[2] or match[3]
            if not match[1] and name not in KEYWORDS | OPEN | STANDARD | own | known:
                yield f"{path.relative_to(root)}: the example names '{name}', which no header declares"


def main():
    found = list(dict.fromkeys(faults(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())))
    print("\n".join(found) or "examples: every name in the examples of headers is declared")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

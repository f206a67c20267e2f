#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Arrows between modules run one way: a module includes only modules of lower rank (docs/architecture.md).

usage: check_ranks.py [REPOSITORY]      exit 1 and one line a fault; check_ranks.py --self-test
"""
import pathlib
import re
import sys
import tempfile

RANKS = {
    "core": 0,
    "geometry": 1, "optim": 1,
    "types": 2, "camera": 2,
    "imu": 3, "features": 3, "io": 3, "eval": 3, "mavlink": 3, "web": 3,
    "frontend": 4, "estimator": 4, "loop": 4, "sim": 4,
    "pipeline": 5,
    "config": 6,
    "experiment": 7,
}
# Within a rank only these: a camera rig is made of the values that travel.
ALLOWED_WITHIN_RANK = {("camera", "types")}
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')


def faults(root):
    sources = root / "src" / "fbvins"
    for path in sorted(p for p in sources.rglob("*") if p.suffix in (".cpp", ".hpp")):
        module = path.relative_to(sources).parts[0]
        if module not in RANKS:
            yield f"{path.relative_to(root)}: module '{module}' has no rank; give it one in tests/check_ranks.py"
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            match = INCLUDE.match(line)
            if match and (problem := judge(module, match[1], path)):
                yield f"{path.relative_to(root)}:{number}: {problem}"


def judge(module, included, path):
    """What is wrong with one include, or None."""
    if "/apps/" in included or included.startswith(("apps/", "../")):
        return f"includes {included}: modules are included as fbvins/<module>/<file>, programs never"
    parts = included.split("/")
    if parts[0] != "fbvins" or len(parts) < 3 or parts[1] == module:
        return None
    other = parts[1]
    if other not in RANKS:
        return f"includes unknown module '{other}'"
    lower = RANKS[other] < RANKS[module] or (module, other) in ALLOWED_WITHIN_RANK
    # A test may set two modules of its own rank side by side; it must not reach upwards.
    if lower or (path.stem.endswith("_test") and RANKS[other] == RANKS[module]):
        return None
    return f"{module} (rank {RANKS[module]}) includes {other} (rank {RANKS[other]})"


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {
            "core/a.hpp": '#include "fbvins/types/b.hpp"\n',
            "types/b.hpp": '#include <vector>\n#include "fbvins/core/a.hpp"\n',
            "frontend/c.cpp": '#include "fbvins/estimator/d.hpp"\n',
            "frontend/c_test.cpp": '#include "fbvins/estimator/d.hpp"\n#include "fbvins/pipeline/e.hpp"\n',
            "camera/f.hpp": '#include "fbvins/types/b.hpp"\n',
            "odd/g.hpp": "\n",
        }.items():
            path = root / "src" / "fbvins" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        where = [fault.split(": ")[0] for fault in faults(root)]
    wanted = ["core/a.hpp:1", "frontend/c.cpp:1", "frontend/c_test.cpp:2", "odd/g.hpp"]
    assert where == [f"src/fbvins/{w}" for w in wanted], where


def main():
    self_test()  # a check that cannot fail would be worse than none
    if sys.argv[1:] == ["--self-test"]:
        return 0
    found = list(faults(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()))
    print("\n".join(found) or "ranks: every include goes down")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

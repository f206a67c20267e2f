#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks which files include which: a module includes only modules of lower rank (docs/architecture.md). A public header
(include/) includes only public headers, the standard library, Eigen and fmt. The laboratory (lab/) may include everything, and
nothing outside includes it.

usage: check_ranks.py [REPOSITORY]      exit 1, and one line for each fault; check_ranks.py --self-test
"""
import pathlib
import re
import sys
import tempfile

RANKS = {
    "core": 0,
    "geometry": 1, "optim": 1,
    "types": 2, "camera": 2, "page": 2,
    "imu": 3, "features": 3, "io": 3, "eval": 3, "mavlink": 3,
    "frontend": 4, "estimator": 4, "loop": 4, "mocap": 4, "sim": 4, "calibration": 4,
    "pipeline": 5, "checkup": 5, "boards": 5, "bags": 5,
    "live": 6, "doctor": 6,
    "config": 7, "ros2": 7, "v4l2": 7, "web": 7, "realsense": 7, "flight": 7, "faults": 7,
    "report": 8,
    "experiment": 9, "tuning": 9,
}
# Modules that make or evaluate data lie in lab/; nothing outside lab/ includes them.
LABORATORY = {"sim", "boards", "faults", "flight", "report", "experiment", "tuning"}
# The only includes within a rank (from, to): a camera rig consists of values of types.
ALLOWED_WITHIN_RANK = {("camera", "types")}
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')


# Folders of modules: folder -> the folders whose headers its headers may include; None: any.
FOLDERS = {
    "include": ("include",),
    "src": None,
    "lab/include": ("include", "lab/include"),
    "lab": None,
}


def faults(root):
    for folder, public in FOLDERS.items():
        sources = root / folder / "fbvins"
        for path in sorted(p for p in sources.rglob("*") if p.suffix in (".cpp", ".hpp")):
            module = path.relative_to(sources).parts[0]
            if module not in RANKS:
                yield f"{path.relative_to(root)}: module '{module}' has no rank; give it one in tests/check_ranks.py"
                continue
            if (module in LABORATORY) != folder.startswith("lab"):
                yield f"{path.relative_to(root)}: module '{module}' does not live in {folder}/"
                continue
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                problem = (judge(module, match[1], path) or judge_laboratory(module, match[1])
                           or (public and judge_border(root, public, match[1])))
                if problem:
                    yield f"{path.relative_to(root)}:{number}: {problem}"


def judge_laboratory(module, included):
    """The fault of one include that concerns the laboratory, or None."""
    parts = included.split("/")
    if module not in LABORATORY and parts[0] == "fbvins" and parts[1] in LABORATORY:
        return f"{module} includes {included}: nothing outside the laboratory sees it"
    return None


def judge_border(root, public, included):
    """The fault of one include in a public header, or None."""
    if included.startswith("fbvins/"):
        if any((root / folder / included).exists() for folder in public):
            return None
        return f"a public header includes {included}, which is not public (not in {' or '.join(public)}/)"
    if included.startswith(("Eigen/", "fmt/")) or re.fullmatch(r"[a-z_]+|stdint\.h", included):
        return None
    return f"a public header includes {included}: only the standard library, Eigen and fmt are there for every user"


def judge(module, included, path):
    """The fault of one include, or None."""
    if "/apps/" in included or included.startswith(("apps/", "../")):
        return f"includes {included}: modules are included as fbvins/<module>/<file>, programs never"
    parts = included.split("/")
    if parts[0] != "fbvins" or len(parts) < 3 or parts[1] == module:
        return None
    other = parts[1]
    if other not in RANKS:
        return f"includes unknown module '{other}'"
    lower = RANKS[other] < RANKS[module] or (module, other) in ALLOWED_WITHIN_RANK
    # A test may include other modules of its own rank, but none of a higher rank.
    if lower or (path.stem.endswith("_test") and RANKS[other] == RANKS[module]):
        return None
    return f"{module} (rank {RANKS[module]}) includes {other} (rank {RANKS[other]})"


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {
            "src/fbvins/core/a.hpp": '#include "fbvins/types/b.hpp"\n',
            "src/fbvins/types/b.hpp": '#include <vector>\n#include "fbvins/core/a.hpp"\n',
            "src/fbvins/frontend/c.cpp": '#include "fbvins/estimator/d.hpp"\n',
            "src/fbvins/frontend/c_test.cpp": '#include "fbvins/estimator/d.hpp"\n#include "fbvins/pipeline/e.hpp"\n',
            "src/fbvins/camera/f.hpp": '#include "fbvins/types/b.hpp"\n',
            "src/fbvins/odd/g.hpp": "\n",
            "include/fbvins/core/h.hpp": '#include <vector>\n#include <Eigen/Core>\n#include <fmt/format.h>\n',
            "include/fbvins/types/i.hpp": '#include "fbvins/core/h.hpp"\n#include "fbvins/core/a.hpp"\n',
            "include/fbvins/types/j.hpp": '#include <ceres/ceres.h>\n#include <png.h>\n',
            "include/fbvins/types/k.hpp": '#include "fbvins/pipeline/e.hpp"\n',
            "src/fbvins/pipeline/l.cpp": '#include "fbvins/sim/m.hpp"\n',
            "src/fbvins/sim/n.hpp": "\n",
            "lab/include/fbvins/sim/m.hpp": '#include "fbvins/core/h.hpp"\n#include "fbvins/sim/o.hpp"\n',
            "lab/fbvins/sim/o.hpp": '#include "fbvins/core/a.hpp"\n#include "fbvins/pipeline/e.hpp"\n',
        }.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        where = [fault.split(": ")[0] for fault in faults(root)]
    wanted = ["include/fbvins/" + w for w in ("types/i.hpp:2", "types/j.hpp:1", "types/j.hpp:2", "types/k.hpp:1")]
    wanted += ["src/fbvins/" + w for w in ("core/a.hpp:1", "frontend/c.cpp:1", "frontend/c_test.cpp:2", "odd/g.hpp",
                                         "pipeline/l.cpp:1", "sim/n.hpp")]
    wanted += ["lab/include/fbvins/sim/m.hpp:2", "lab/fbvins/sim/o.hpp:2"]
    assert where == wanted, where


def main():
    self_test()  # shows that the check can fail
    if sys.argv[1:] == ["--self-test"]:
        return 0
    found = list(faults(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()))
    print("\n".join(found) or "ranks: every include is of an allowed module")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

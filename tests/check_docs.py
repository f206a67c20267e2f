#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the documents: links between them, to headings as well, have a target; sources that they name are there; docs/troubleshooting.md has an entry for every
health state and reason of the code; docs/benchmarks.md is what bench/benchmarks writes, and README.md has its rows; all files
name the same version; each public header begins with what it is.

usage: check_docs.py [REPOSITORY]      exit 1, and one line for each fault
"""
import pathlib
import re
import subprocess
import sys

LINK = re.compile(r"(?<!\!)\[[^\]]*\]\(([^)\s]+)\)|!\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.S)
SOURCE = re.compile(r"`([\w/.-]+\.(?:cpp|hpp|py|js))`")
OF_OTHERS = {"kalibr_common/ConfigReader.py", "rs-imu-calibration.py"}


def slug(heading):
    """The anchor of a heading, as forges and mkdocs make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", text))


def anchors(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    return {slug(h) for h in re.findall(r"^#+\s+(.*)$", text, re.M)}


def links(root):
    for page in sorted([*root.glob("*.md"), *root.glob("docs/**/*.md"), *root.glob("training/*.md")]):
        for match in LINK.finditer(CODE.sub("", page.read_text(encoding="utf-8"))):
            target = match.group(1) or match.group(2)
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            to = (page.parent / path).resolve() if path else page
            if not to.exists():
                yield f"{page.relative_to(root)}: there is no {target}"
            elif anchor and to.suffix == ".md" and anchor not in anchors(to):
                yield f"{page.relative_to(root)}: {path or page.name} has no heading #{anchor}"


def health(root):
    header = (root / "include/fbvins/types/odometry.hpp").read_text(encoding="utf-8")
    entries = re.findall(r"^### `(\w+)`$", (root / "docs/troubleshooting.md").read_text(encoding="utf-8"), re.M)
    for name in ("HealthState", "HealthReason"):
        body = re.sub(r"//.*", "", re.search(rf"enum class {name} \{{(.*?)\}};", header, re.S).group(1))
        for value in re.findall(r"\w+", body):
            if entries.count(value) != 1:
                yield f"docs/troubleshooting.md: {entries.count(value)} entries for the {name} '{value}', not one"


def benchmarks(root):
    done = subprocess.run([sys.executable, root / "bench/benchmarks", "--check"], capture_output=True, text=True)
    if done.returncode != 0:
        yield done.stderr.strip()
    page = (root / "docs/benchmarks.md").read_text(encoding="utf-8")
    for row in re.findall(r"^\| (?:FB-VINS|OpenVINS|Basalt|VINS-Fusion|ORB-SLAM3)\b.*\|$", (root / "README.md").read_text(encoding="utf-8"), re.M):
        if row not in page:
            yield f"README.md: docs/benchmarks.md has no row {row}"


def sources(root):
    """Sources that documents name, by the end of their path, are there; and each public header begins with what it is."""
    ends = set()
    for folder in ("include", "src", "lab", "apps", "bench", "examples", "packaging", "python", "tests", "training", "web"):
        for path in (root / folder).rglob("*.*"):
            parts = path.relative_to(root).parts
            ends |= {"/".join(parts[i:]) for i in range(len(parts))}
    for page in sorted([*root.glob("*.md"), *root.glob("docs/**/*.md")]):
        if page.name == "CHANGELOG.md":  # tells of what was
            continue
        for name in SOURCE.findall(page.read_text(encoding="utf-8")):
            if name not in ends | OF_OTHERS:
                yield f"{page.relative_to(root)}: there is no {name}"
    for header in sorted([*root.glob("include/**/*.hpp"), *root.glob("lab/include/**/*.hpp")]):
        if not header.read_text(encoding="utf-8").splitlines()[1].startswith("// "):
            yield f"{header.relative_to(root)}: the second line does not say what it is"


def versions(root):
    """All files name the same version."""
    named = {file: re.search(pattern, (root / file).read_text(encoding="utf-8"), re.M).group(1)
             for file, pattern in {"CMakeLists.txt": r"^project\(fbvins VERSION ([0-9.]+)", "pyproject.toml": r'^version = "(.*)"',
                                   "CITATION.cff": r"^version: (.*)$", "ros2/package.xml": r"<version>(.*)</version>"}.items()}
    if len(set(named.values())) != 1:
        yield f"versions differ: {named}"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    faults = [*links(root), *health(root), *benchmarks(root), *sources(root), *versions(root)]
    print("\n".join(faults) or "documents: links, sources, health reasons, benchmarks and versions hold")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws docs/images/modules.svg: the modules by rank, and an arrow for each dependency that does not follow from others (the
transitive reduction of what the sources include; tests left out).

usage: draw_modules.py [REPOSITORY]            writes the picture
       draw_modules.py [REPOSITORY] --check    exit 1 if the picture is not what the sources say
"""
import pathlib
import sys

from check_ranks import FOLDERS, INCLUDE, LABORATORY, RANKS

BOX_WIDTH, BOX_HEIGHT, COLUMN, ROW, MARGIN = 92, 30, 112, 82, 24
PICTURE = "docs/images/modules.svg"
STYLE = """text { font: 13px sans-serif; text-anchor: middle; dominant-baseline: central; fill: #222 }
rect.page { fill: #fff } rect.flight { fill: #dceaf7; stroke: #37699c } rect.laboratory { fill: #f6ead2; stroke: #a67c2d }
path { fill: none; stroke: #8a94a0; stroke-width: 1.1; marker-end: url(#tip) } .rank { font-size: 11px; fill: #777 }"""


def dependencies(root):
    """Module -> the modules that its sources include."""
    found = {module: set() for module in RANKS}
    for folder in FOLDERS:
        for path in (root / folder / "fbvins").rglob("*"):
            if path.suffix not in (".cpp", ".hpp") or path.stem.endswith("_test"):
                continue
            module = path.relative_to(root / folder / "fbvins").parts[0]
            for line in path.read_text(encoding="utf-8").splitlines():
                match = INCLUDE.match(line)
                parts = match[1].split("/") if match else []
                if len(parts) > 2 and parts[0] == "fbvins" and parts[1] in RANKS and parts[1] != module:
                    found[module].add(parts[1])
    return found


def reduced(uses):
    """Without the dependencies that follow from others."""
    def reaches(module):
        return set().union(*(({other} | reaches(other)) for other in uses[module])) if uses[module] else set()
    behind = {module: reaches(module) for module in uses}
    return {module: sorted(other for other in others if not any(other in behind[third] for third in others - {other}))
            for module, others in uses.items()}


def placed(rows, arrows, width):
    """Module -> the centre of its box; within a rank, modules stand below those that use them and above those that they use."""
    place = {}
    for sweep in range(6):
        for line, row in enumerate(rows.values()):
            if sweep:
                neighbours = {m: [place[n][0] for n in arrows[m] + [k for k in arrows if m in arrows[k]]] for m in row}
                row.sort(key=lambda m: (sum(neighbours[m]) / max(1, len(neighbours[m])), m))
            left = (width + 30 - len(row) * COLUMN) / 2
            for column, module in enumerate(row):
                place[module] = (left + COLUMN * (column + 0.5), MARGIN + line * ROW + BOX_HEIGHT / 2)
    return place


def draw(root):
    arrows = reduced(dependencies(root))
    ranks = sorted(set(RANKS.values()), reverse=True)
    rows = {rank: [module for module in RANKS if RANKS[module] == rank] for rank in ranks}
    width = max(len(row) for row in rows.values()) * COLUMN + 2 * MARGIN + 30
    height = len(ranks) * ROW + 2 * MARGIN - (ROW - BOX_HEIGHT)
    place = placed(rows, arrows, width)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">', f"<style>{STYLE}</style>",
           '<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
           '<path d="M0,1 L7,4 L0,7" style="marker-end:none"/></marker>', f'<rect class="page" width="{width}" height="{height}"/>']
    for module, others in arrows.items():
        for other in others:
            (x, y), (u, v) = place[module], place[other]
            y, v = y + BOX_HEIGHT / 2, v - BOX_HEIGHT / 2
            if v <= y:  # of the same rank
                out.append(f'<path d="M{x:g},{y:g} C{x:g},{y + 24:g} {u:g},{y + 24:g} {u:g},{y:g}"/>')
            else:
                out.append(f'<path d="M{x:g},{y:g} C{x:g},{y + 30:g} {u:g},{v - 30:g} {u:g},{v:g}"/>')
    for line, rank in enumerate(ranks):
        out.append(f'<text class="rank" x="{MARGIN}" y="{MARGIN + line * ROW + BOX_HEIGHT / 2:g}">{rank}</text>')
    for module, (x, y) in place.items():
        kind = "laboratory" if module in LABORATORY else "flight"
        out.append(f'<rect class="{kind}" x="{x - BOX_WIDTH / 2:g}" y="{y - BOX_HEIGHT / 2:g}" width="{BOX_WIDTH}" '
                   f'height="{BOX_HEIGHT}" rx="5"/><text x="{x:g}" y="{y:g}">{module}</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--check"]
    root = pathlib.Path(arguments[0] if arguments else ".").resolve()
    drawn = draw(root)
    if "--check" not in sys.argv:
        (root / PICTURE).write_text(drawn, encoding="utf-8")
    elif (root / PICTURE).read_text(encoding="utf-8") != drawn:
        print(f"{PICTURE} is not what the sources include: run tests/draw_modules.py")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

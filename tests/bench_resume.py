#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills `fbvins bench` in the middle and starts it again: finished runs are kept, the others are done, nothing is lost.

usage: bench_resume.py FBVINS
"""
import csv
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

PROGRAM = sys.argv[1]
MATRIX = """title: Two short flights
datasets:
  - simulate: {preset: normal, seconds: 2, seeds: 2, set: [image_rate_hz=10]}
frontends: [klt, orb]
"""


def bench(folder, *arguments):
    return [PROGRAM, "bench", str(folder / "matrix.yaml"), "--out", str(folder / "out"), "--jobs", "1", *map(str, arguments)]


def finished(folder):
    """A cell is finished when its folder has its own name: in the moment before, it is ID.part."""
    return {path.parent.name: path.stat().st_mtime_ns for path in (folder / "out" / "cells").glob("*/cell.json") if path.parent.suffix != ".part"}


def kill_after_first_cell(folder):
    process = subprocess.Popen(bench(folder), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 600
    while len(finished(folder)) < 1:
        assert process.poll() is None, "the bench ended before it could be killed"
        assert time.monotonic() < deadline, "no cell was finished in ten minutes"
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()


def rows_of(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "matrix.yaml").write_text(MATRIX, encoding="utf-8")
        kill_after_first_cell(folder)
        before = finished(folder)
        assert 1 <= len(before) < 4, before

        again = subprocess.run(bench(folder), capture_output=True, text=True, timeout=600, check=False)
        assert again.returncode == 0, again.stderr
        assert f"{4 - len(before)} cells run, {len(before)} kept from before, 0 failed" in again.stdout, again.stdout
        after = finished(folder)
        assert len(after) == 4 and all(after[name] == stamp for name, stamp in before.items()), (before, after)
        rows = rows_of(folder / "out" / "results.csv")
        assert [row["status"] for row in rows] == ["ok"] * 4, rows
        for name in ("results.json", "tables.md", "report.html"):
            assert (folder / "out" / name).stat().st_size > 1000, name

        # Against the same figures there is no regression; against figures ten times better there is one.
        same = folder / "same.csv"
        same.write_bytes((folder / "out" / "results.csv").read_bytes())
        assert subprocess.run(bench(folder, "--reference", same, "--quiet"), check=False, timeout=60).returncode == 0
        with open(folder / "better.csv", "w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows({**row, "restarts": -1} for row in rows)
        worse = subprocess.run(bench(folder, "--reference", folder / "better.csv"), check=False, timeout=60, capture_output=True, text=True)
        assert worse.returncode == 1 and "Worse than the reference" in worse.stdout, worse
    print("killed and resumed: finished cells were kept, the others run")
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Anchors of `fbvins run`: positions from a file bring M into another frame than the flight's own, outliers change nothing, and
the map file keeps it; wrong files end with one sentence. The recording is FBVINS_SIMULATED_FLIGHT (tests/simulated_flight.py).

usage: anchors.py FBVINS
"""
import csv
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

SHIFT = (20.0, -8.0, 3.0)  # of the building's frame against the truth's
IMAGES = 220


def truth_of(recording):
    with open(recording / "mav0/state_groundtruth_estimate0/data.csv", encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    return {int(row[0]): tuple(float(x) + s for x, s in zip(row[1:4], SHIFT)) for row in rows}


def write_positions(path, truth, outliers):
    rng = random.Random(5)
    with open(path, "w", encoding="utf-8") as file:
        file.write("#timestamp_ns,x,y,z,sx,sy,sz\n")
        for t in sorted(truth)[::20]:
            size = 2 if rng.random() < outliers else 0.02
            p = [x + rng.gauss(0, size) for x in truth[t]]
            file.write(f"{t},{p[0]},{p[1]},{p[2]},0.02,0.02,0.02\n")


def run(program, *arguments):
    return subprocess.run([program, "run", *map(str, arguments), "--frontend", "klt", "--max-images", str(IMAGES)], capture_output=True, text=True)


def worst_m(out, truth):
    """Of the poses in M against the truth, without any alignment."""
    stamps = sorted(truth)
    worst, poses = 0.0, 0
    lines = (out / "map_trajectory_tum.txt").read_text(encoding="utf-8").splitlines()
    for line in (line for line in lines if not line.startswith("#")):
        seconds, x, y, z = line.split()[:4]
        whole, part = seconds.split(".")
        t = int(whole) * 10**9 + int(part)
        nearest = min(stamps, key=lambda s: abs(s - t))
        if abs(nearest - t) < 3e6:
            worst, poses = max(worst, math.dist((float(x), float(y), float(z)), truth[nearest])), poses + 1
    assert poses > 50, poses
    return worst


def refused(program, recording, root, option, text, words):
    path = root / "wrong"
    path.write_text(text, encoding="utf-8")
    done = run(program, recording, "--out", root / "wrong_out", option, path)
    assert done.returncode == 2 and words in done.stderr, (done.returncode, done.stderr)
    assert not (root / "wrong_out" / "trajectory.csv").exists()


def main():
    program, recording = sys.argv[1], pathlib.Path(os.environ["FBVINS_SIMULATED_FLIGHT"])
    truth = truth_of(recording)
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for outliers in (0.0, 0.2):
            write_positions(root / "positions.csv", truth, outliers)
            done = run(program, recording, "--out", root / "out", "--positions", root / "positions.csv", "--save-map", root / "map.fbm")
            assert done.returncode == 0, done.stderr
            assert "in the building's frame after" in done.stdout, done.stdout
            worst = worst_m(root / "out", truth)
            print(f"{outliers:.0%} outliers: {1000 * worst:.0f} mm at worst")
            assert worst < 0.08, worst
        done = run(program, recording, "--out", root / "again", "--load-map", root / "map.fbm")
        assert done.returncode == 0 and worst_m(root / "again", truth) < 0.12, done.stderr
        refused(program, recording, root, "--positions", "1,2,3\n", "wrong:1: 3 columns")
        refused(program, recording, root, "--tags", "family: tag36h11\nsize_m: 0.2\ntags:\n  - {id: 3, facing_deg: 0}\n", "position_m: is missing")
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The golden set: hashes of what the program writes for fourteen short rendered flights. A change that only moves code keeps every one of them;
one that changes results says which (CONTRIBUTING.md).

usage: golden.py FBVINS            compares with tests/golden.txt; exit code 1 and a line for each cell that differs
       golden.py FBVINS --write    writes tests/golden.txt

A cell is one run: its hash is that of trajectory.csv, covariance.csv and gauge.csv, of a run with a map of map.fbm and map_trajectory_tum.txt
besides. Runs with --threaded and live replays have to give the hash of the run that they repeat, so they have no line of their own. Flights are
rendered once, into the folder of --flights (render them anew after a change of the simulator); `rendered` is the hash of their readings and of their last image.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

GOLDEN = pathlib.Path(__file__).with_suffix(".txt")
FRONTENDS = ("klt", "orb", "boost")
WRITTEN = ("trajectory.csv", "covariance.csv", "gauge.csv")
MAP = ("map.fbm", "map_trajectory_tum.txt")

# name: arguments of `fbvins simulate`
FLIGHTS = {
    "normal": ["normal"],
    "dim": ["dim"],
    "moving-light": ["moving-light"],
    "weak-texture": ["weak-texture"],
    "moving-objects": ["moving-objects"],
    "fast": ["fast"],
    "takeoff": ["takeoff"],
    "rolling-shutter": ["rolling"],
    "one-camera": ["mono"],
    "four-cameras": ["quad"],
    "depth-sensor": ["rgbd"],
    "wide-lenses": ["fisheye"],
    "cheap-pair": ["normal", "--sensors", "d435i"],
    "phone": ["handheld", "--sensors", "phone"],
}
SECONDS = 7


def digest(paths):
    sha = hashlib.sha256()
    for path in paths:
        sha.update(path.read_bytes())
    return sha.hexdigest()[:16]


def render(program, name, flights):
    """The folder of a flight, rendered where it is not there yet."""
    folder = flights / name
    if not folder.exists():
        part = folder.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        subprocess.run([program, "simulate", *FLIGHTS[name], "--seconds", str(SECONDS), "--seed", "59", "--out", part, "--quiet"], check=True)
        part.rename(folder)
    mav = folder / "mav0"
    return digest([mav / "imu0/data.csv", max((mav / "cam0/data").iterdir())])


def fly(program, arguments, files=WRITTEN):
    with tempfile.TemporaryDirectory() as out:
        out = pathlib.Path(out)
        arguments = [str(out / "map.fbm") if a == "MAP" else str(a) for a in arguments]
        done = subprocess.run([program, *arguments, "--out", out, "--quiet"], capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):  # 1: no pose
            return f"exit {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
        return digest([out / f for f in files if (out / f).exists()])


def replayed(program, recording, frontend):
    """A live flight's hash, or nothing where this machine was too slow for it."""
    with tempfile.TemporaryDirectory() as out:
        out = pathlib.Path(out)
        subprocess.run([program, "live", "--source", f"replay:{recording}", "--preload", "--frontend", frontend, "--out", out, "--quiet"],
                       capture_output=True, check=False)
        if json.loads((out / "summary.json").read_text(encoding="utf-8"))["live"]["images_dropped"]:
            return None
        return digest([out / f for f in WRITTEN])


def cells(program, flights):
    """Name and function of each cell; the run `=FLIGHT FRONTEND HOW` repeats the cell `FLIGHT FRONTEND`."""
    for name in FLIGHTS:
        yield f"{name} rendered", lambda name=name: render(program, name, flights)
    for name in FLIGHTS:
        for frontend in FRONTENDS:
            yield f"{name} {frontend}", lambda n=name, f=frontend: fly(program, ["run", flights / n, "--frontend", f])
    for frontend in FRONTENDS:
        threaded = ["run", flights / "normal", "--frontend", frontend, "--threaded"]
        yield f"=normal {frontend} threaded", lambda r=threaded: fly(program, r)
    for frontend in ("orb", "boost"):
        run = ["run", flights / "takeoff", "--frontend", frontend, "--save-map", "MAP"]
        yield f"takeoff {frontend} map", lambda r=run: fly(program, r, WRITTEN + MAP)
    yield "=normal boost live", lambda: replayed(program, flights / "normal", "boost")


def hashes(program, flights, jobs):
    found = {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        todo = list(cells(program, flights))
        rendered = [c for c in todo if c[0].endswith(" rendered")]
        for part in (rendered, [c for c in todo if c not in rendered]):
            runs = [(name, pool.submit(work)) for name, work in part]
            found.update({name: run.result() for name, run in runs})
    return found


def repeated(name):
    """The cell whose hash `=FLIGHT FRONTEND HOW` has to give."""
    return name[1:].rsplit(" ", 1)[0]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program", type=lambda s: str(pathlib.Path(s).resolve()))
    p.add_argument("--write", action="store_true")
    p.add_argument("--flights", type=pathlib.Path, default=pathlib.Path("build/recordings/golden"))
    p.add_argument("--jobs", type=int, default=os.cpu_count())
    a = p.parse_args()
    a.flights.mkdir(parents=True, exist_ok=True)
    found = hashes(a.program, a.flights, a.jobs)
    repeats = {n: h for n, h in found.items() if n.startswith("=")}
    wrong = [f"{n[1:]}: not the bytes of {repeated(n)}" for n, h in repeats.items() if h not in (None, found[repeated(n)])]
    wrong += [f"{n}: {h}" for n, h in found.items() if h and h.startswith("exit")]
    skipped = [n[1:] for n, h in repeats.items() if h is None]
    own = {n: h for n, h in found.items() if n not in repeats}
    if a.write and not wrong:
        GOLDEN.write_text("".join(f"{h}  {n}\n" for n, h in own.items()), encoding="utf-8")
    golden = dict(reversed(line.split(maxsplit=1)) for line in GOLDEN.read_text(encoding="utf-8").splitlines())
    wrong += [f"{n}: {own.get(n)}, golden {golden.get(n)}" for n in sorted(own.keys() | golden.keys()) if own.get(n) != golden.get(n)]
    for line in wrong:
        print(line)
    print(f"{len(found) - len(wrong) - len(skipped)} of {len(found)} cells as golden" + "".join(f"; {s}: images dropped, not judged" for s in skipped))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two runs of the same recording write the same bytes, and so does a run with --threaded; a run with another option does not.
The recording is MH_01_easy_17s of FBVINS_DATA, or where that is absent FBVINS_SIMULATED_FLIGHT (tests/simulated_flight.py).

usage: determinism.py FBVINS FRONTEND
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

REPRODUCIBLE = ["trajectory_tum.txt", "trajectory.csv", "statistics.csv", "config.yaml"]
OF_THE_MAP = ["map_trajectory_tum.txt", "map_causal_tum.txt", "map_bounded_tum.txt", "map_updates.csv"]
IMAGES = 150  # start, window and marginalisation all take part


def run(program, recording, out, *arguments):
    command = [program, "run", str(recording), "--out", str(out), "--max-images", str(IMAGES), "--quiet", *arguments]
    subprocess.run(command, check=True)
    files = {name: (out / name).read_bytes() for name in REPRODUCIBLE}
    files.update({name: (out / name).read_bytes() for name in OF_THE_MAP if (out / name).exists()})
    for path in out.glob("*.fbm"):
        files[path.name] = path.read_bytes()
    files["summary.json result"] = json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]
    return files


def differing(a, b):
    return [name for name in a if a[name] != b.get(name)]


def check_loop_closure(program, recording, root, kind, odometry):
    """The map is reproducible as well, and the odometry is the same with loop closure as without."""
    def fly(name, *arguments):
        (root / name).mkdir()
        return run(program, recording, root / name, *kind, "--save-map", str(root / name / "map.fbm"), *arguments)

    first = fly("map")
    assert set(OF_THE_MAP + ["map.fbm"]) <= first.keys(), f"only {sorted(first)} were written"
    assert not (wrong := [n for n in REPRODUCIBLE if first[n] != odometry[n]]), f"loop closure changed {wrong}"
    assert first["map_updates.csv"].count(b"\n") > 10, "fewer than ten keyframes reached the loop closer"
    for name, arguments in {"again": [], "threaded": ["--threaded"]}.items():
        wrong = differing(first, fly("map " + name, *arguments))
        assert not wrong, f"loop closure, {name}: {wrong} differ"
        print(f"loop closure, {name}: same bytes")


def main():
    program, frontend = sys.argv[1:3]
    repository = pathlib.Path(__file__).resolve().parents[1]
    data = pathlib.Path(os.environ.get("FBVINS_DATA") or repository.parent / "shared" / "data")
    recording = data / "MH_01_easy_17s"
    if not recording.exists():
        recording = pathlib.Path(os.environ["FBVINS_SIMULATED_FLIGHT"])
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        kind = ["--frontend", frontend]
        first = run(program, recording, root / "a", *kind)
        poses = first["trajectory_tum.txt"].count(b"\n")
        assert poses > 0.8 * IMAGES, f"only {poses} poses of {IMAGES} images"
        for name, arguments in {"again": [], "threaded": ["--threaded"],
                                "from its own config.yaml": ["--config", str(root / "a" / "config.yaml")]}.items():
            wrong = differing(first, run(program, recording, root / "b", *kind, *arguments))
            assert not wrong, f"{name}: {wrong} differ"
            print(f"{frontend} {name}: same bytes")
        check_loop_closure(program, recording, root, kind, first)
        other = run(program, recording, root / "c", *kind, "--set", "estimator.keyframes.max_keyframes=6")
        assert "trajectory.csv" in differing(first, other), "another option gave the same bytes, so this test proves nothing"
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A flight of whose IMU only every tenth reading is left, 20 a second: it is flown, with a covariance that fits its errors, and said in one
sentence; readings that are missing among these are still a gap.

usage: slow_imu.py FBVINS FLIGHT      FLIGHT: tests/simulated_flight.py
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

EVERY, GAP = 10, range(150, 157)  # of the readings that are left


def thinned(flight, folder, lacks=()):
    """The flight with every tenth reading; the rest of it is linked."""
    for part in flight.iterdir():
        if part.name != "imu0":
            (folder / part.name).symlink_to(part)
    (folder / "imu0").mkdir()
    head, *rows = (flight / "imu0" / "data.csv").read_text(encoding="utf-8").splitlines()
    kept = [row for k, row in enumerate(rows[3::EVERY]) if k not in lacks]
    (folder / "imu0" / "data.csv").write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
    (folder / "imu0" / "sensor.yaml").write_bytes((flight / "imu0" / "sensor.yaml").read_bytes())


def fly(program, recording, out):
    done = subprocess.run([program, "run", recording, "--out", out, "--frontend", "klt", "--quiet"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done
    return done.stderr, json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]


def main(program, flight):
    flight = pathlib.Path(flight).resolve()
    flight = flight / "mav0" if (flight / "mav0").exists() else flight
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for case, lacks in (("whole", ()), ("gap", GAP)):
            recording = folder / case / "mav0"
            os.makedirs(recording)
            thinned(flight, recording, lacks)
            said, result = fly(program, recording.parent, folder / f"out_{case}")
            good = result["health"].get("good", 0) / result["coverage"]["images"]
            nees = result["nees_from_start"]["mean"]
            print(f"{case}: {100 * good:.0f} % good, {result['health']}, NEES {nees}, ATE {result['accuracy']['ape_m']['rmse']:.4f} m")
            assert said.count("20 readings a second") == 1 and "the covariance is larger" in said, said
            assert good > 0.6 and result["restarts"] == 0
            assert result["accuracy"]["ape_m"]["rmse"] < 0.1
            assert nees["pose"] < 18, "six when it is honest"
            gaps = result["health"].get("degraded/imu_gap", 0)
            assert 6 <= gaps <= 30 if lacks else gaps == 0, gaps
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A real flight controller flies missions by FBVINS's odometry in the simulated world (`fbvins fly --px4`, `--ardupilot`): the
mission of the paper, up to its landing; and one in which the odometry fails for a second, and later for good, so that PX4's own
failsafe lands the vehicle, or ArduPilot by its second set of sources. FBVINS_PX4 names bin/px4 of a px4_sitl build,
FBVINS_ARDUPILOT arducopter of a SITL build.

usage: controller_mission.py FBVINS px4|ardupilot
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
MEAN_BAR_M = 0.03
PROGRAMS = {"px4": ("FBVINS_PX4", "a PX4 (bin/px4 of a px4_sitl build)"), "ardupilot": ("FBVINS_ARDUPILOT", "an ArduPilot (arducopter of a SITL build)")}
LANDS_BLIND = {"px4": "mode AUTO.LAND", "ardupilot": "second set of sources"}


def fly(program, kind, mission, out, expect):
    done = subprocess.run([program, "fly", REPOSITORY / "configs" / "missions" / f"{mission}.yaml", f"--{kind}", "--quiet", "--out", out],
                          capture_output=True, text=True, timeout=800, check=False)
    assert done.returncode == expect, (done.returncode, done.stderr, (out / "flight.txt").read_text() if (out / "flight.txt").exists() else "")
    flight = json.loads((out / "flight.json").read_text(encoding="utf-8"))
    print(f"{mission}:")
    for t, text in flight["events"]:
        print(f"  {t:7.2f} s  {text}")
    assert flight["crash"] is None, flight["crash"]
    assert flight["controller"] == kind, flight["controller"]
    return flight


def said(flight, text):
    """The time of the first event that fulfils the condition."""
    return next((t for t, event in flight["events"] if text in event), None)


def paper(program, kind, root):
    flight = fly(program, kind, "paper", root / "paper", 0)
    assert flight["arrived"] and flight["ended"] == "landed" and flight["reason"] == "none", flight
    assert flight["controller_resets"] == 0, "its estimator was reset in flight"
    assert flight["mean_axial_error_m"] <= MEAN_BAR_M, flight["mean_axial_error_m"]
    assert (root / "paper" / kind / "link.tlog").stat().st_size > 100_000, "the link was not logged"
    print(f"  arrived and landed, mean axial error {100 * flight['mean_axial_error_m']:.2f} cm, no reset of its estimator in flight")


def silence(program, kind, root):
    flight = fly(program, kind, "odometry_stops", root / "silence", 1)
    modes = [name for name, _ in flight["modes"]]
    assert "holding/late" in modes and modes[-1].startswith("landed"), modes
    assert modes.index("mission", modes.index("holding/late")), "the mission did not continue after the first gap in the odometry"
    assert said(flight, LANDS_BLIND[kind]) is not None, "what lands it without poses was not seen"
    print(f"  {', '.join(modes)}; {flight['drift_blind_m']:.2f} m of drift without poses")


def main():
    program, kind = sys.argv[1:]
    variable, what = PROGRAMS[kind]
    if variable not in os.environ:
        print(f"SKIPPED: {variable} does not name {what}, see docs/px4.md")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        paper(program, kind, pathlib.Path(folder))
        silence(program, kind, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())

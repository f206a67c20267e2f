#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A real PX4 flies missions by FBVINS's odometry in the simulated world (`fbvins fly --px4`): the mission of the paper, up to its
landing; and one in which the odometry fails for a second, and later for good, so that PX4's own failsafe lands the vehicle.
FBVINS_PX4 names the program (bin/px4 of a px4_sitl build).

usage: px4_mission.py FBVINS
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
MEAN_BAR_M = 0.03


def fly(program, mission, out, expect):
    done = subprocess.run([program, "fly", REPOSITORY / "configs" / "missions" / f"{mission}.yaml", "--px4", "--quiet", "--out", out],
                          capture_output=True, text=True, timeout=800, check=False)
    assert done.returncode == expect, (done.returncode, done.stderr, (out / "flight.txt").read_text() if (out / "flight.txt").exists() else "")
    flight = json.loads((out / "flight.json").read_text(encoding="utf-8"))
    print(f"{mission}:")
    for t, text in flight["events"]:
        print(f"  {t:7.2f} s  {text}")
    assert flight["crash"] is None, flight["crash"]
    return flight


def said(flight, text):
    """The time of the first event that fulfils the condition."""
    return next((t for t, event in flight["events"] if text in event), None)


def paper(program, root):
    flight = fly(program, "paper", root / "paper", 0)
    assert flight["arrived"] and flight["ended"] == "landed" and flight["reason"] == "none", flight
    assert flight["controller_resets"] == 0, "EKF2 reset its estimate in flight"
    assert flight["mean_axial_error_m"] <= MEAN_BAR_M, flight["mean_axial_error_m"]
    print(f"  arrived and landed, mean axial error {100 * flight['mean_axial_error_m']:.2f} cm, no reset of EKF2 in flight")


def silence(program, root):
    flight = fly(program, "odometry_stops", root / "silence", 1)
    modes = [name for name, _ in flight["modes"]]
    assert "holding/late" in modes and modes[-1].startswith("landed"), modes
    assert modes.index("mission", modes.index("holding/late")), "the mission did not continue after the first gap in the odometry"
    assert said(flight, "mode AUTO.LAND") is not None, "PX4's failsafe was not seen"
    print(f"  {', '.join(modes)}; {flight['drift_blind_m']:.2f} m of drift without poses")


def main():
    if "FBVINS_PX4" not in os.environ:
        print("SKIPPED: FBVINS_PX4 does not name a PX4 (bin/px4 of a px4_sitl build), see docs/px4.md")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        paper(sys.argv[1], pathlib.Path(folder))
        silence(sys.argv[1], pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())

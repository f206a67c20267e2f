#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins calibrate --from-flight` on a rendered flight: its own calibration stays as it is, one with a wrong time offset is mended, and
what cannot be used is said in a sentence.

usage: calibrate_from_flight.py FBVINS      FBVINS_SIMULATED_FLIGHT: the flight (simulated_flight.py)
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

PROGRAM, FLIGHT = sys.argv[1], os.environ["FBVINS_SIMULATED_FLIGHT"]
OFFSET = re.compile(r"timeshift_cam_imu: (\S+)")


def calibrate(*arguments, code=0):
    done = subprocess.run([PROGRAM, "calibrate", "--from-flight", *map(str, arguments), "--quiet"], capture_output=True, text=True, timeout=600)
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done.stderr


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def check_good(folder):
    """The files hold the calibration as it was given."""
    calibrate(FLIGHT, "--out", folder)
    summary = summary_of(folder)
    assert not summary["better"] and "stays" in summary["verdict"], summary["verdict"]
    assert {"camchain-imucam.yaml", "imu.yaml", "calibration.txt"} <= {p.name for p in folder.iterdir()}
    for name, p in summary["parameters"].items():
        assert p["finding"] in ("refined", "confirmed", "not determined"), (name, p)
        assert p["finding"] == "refined" or p["value"] == p["given"], (name, p)


def check_spoilt(good, folder):
    """A time offset that is 4 ms off is found again; a second time gives the same bytes."""
    text = (good / "camchain-imucam.yaml").read_text(encoding="utf-8")
    true_s = float(OFFSET.search(text).group(1))
    spoilt = folder / "spoilt.yaml"
    spoilt.write_text(OFFSET.sub(f"timeshift_cam_imu: {true_s + 0.004}", text), encoding="utf-8")
    arguments = [FLIGHT, "--calibration", spoilt, "--imu-calibration", good / "imu.yaml", "--out"]
    calibrate(*arguments, folder / "refined")
    summary = summary_of(folder / "refined")
    assert summary["better"], summary["verdict"]
    offset = summary["parameters"]["time_offset"]
    assert offset["finding"] == "refined" and offset["sigma"] < 5e-4, offset
    text = (folder / "refined/camchain-imucam.yaml").read_text(encoding="utf-8")
    assert abs(float(OFFSET.search(text).group(1)) - true_s) < min(3 * offset["sigma"], 1e-3), (true_s, offset)
    assert all(part["gain"] > 0 for part in summary["held_out"]), summary["held_out"]
    calibrate(*arguments, folder / "again")
    for name in ("summary.json", "camchain-imucam.yaml", "calibration.json"):
        assert (folder / "refined" / name).read_bytes() == (folder / "again" / name).read_bytes(), name


def check_refused(good, folder):
    other = folder / "other.yaml"
    other.write_text("no calibration\n", encoding="utf-8")
    assert "other.yaml" in calibrate(FLIGHT, "--calibration", other, "--out", folder / "none", code=2)
    assert "nowhere" in calibrate(folder / "nowhere", "--out", folder / "none", code=2)
    assert not (folder / "none").exists()


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_good(folder / "good")
        check_spoilt(folder / "good", folder)
        check_refused(folder / "good", folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rendered recording of a board through `fbvins calibrate`: the calibration is the one that was put in, its page shows it, a bag and a
flight record give the same, and so does a search for the board that was killed and started again.

usage: calibrate.py FBVINS
"""
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import browser
import page_checks

PROGRAM = sys.argv[1]


def fbvins(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, timeout=600)


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def check_truth(summary):
    """Against the rig of `fbvins simulate board`, whose numbers are in docs/experiments/calibration.md."""
    parameters, imu = summary["parameters"], summary["imu"]
    assert abs(parameters["cam0.fx"]["value"] - 458.7) < 0.3, parameters["cam0.fx"]
    baseline_m = math.dist([parameters[f"cam1.p{axis}"]["value"] for axis in "xyz"], (0, 0, 0))
    assert abs(baseline_m - 0.11001) < 1e-4, baseline_m
    assert abs(imu["time_offset_s"] - 0.005) < 2e-4, imu["time_offset_s"]
    assert 0.8 < imu["image_factor"] < 3 and imu["stamp_jitter_s"] < 1e-3, imu


def check_page(folder):
    """What summary.json has is on the page, which draws all of its plots."""
    summary = summary_of(folder)
    with browser.Browser() as chromium:
        for theme in ("light", "dark"):
            dom = page_checks.drawn(chromium, folder / "calibration.html", theme, 18)
            for name in [*summary["parameters"], *summary["imu"]["parameters"]]:
                assert f">{name}<" in dom, name
            for camera in summary["cameras"]:
                assert f">{camera['reprojection']['corners']}<" in dom, camera
            for sentence in [*summary["remarks"], *(weak[key] for weak in summary["weak"] for key in ("what", "advice"))]:
                assert sentence in dom, sentence
        page_checks.check_layout(chromium, folder / "calibration.html")


def check_bag(board, folder, rig):
    """Killed while it looks for the board, and started again: the same bytes as of the folder without any interruption."""
    bag, out = folder / "board.bag", folder / "from_bag"
    fbvins("convert", board, bag)
    command = [PROGRAM, "calibrate", bag, "--target", board / "target.yaml", "--save-detections", "--out", out]
    first = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120
    while not list(out.glob("detecting/*.found")) and time.monotonic() < end:
        time.sleep(0.02)
    first.kill()
    first.wait()
    again = subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)
    assert re.search("goes on after (50|80) of 80 images", again.stderr) and "/cam0/image_raw, /cam1/image_raw; IMU: /imu" in again.stderr, again.stderr
    for name in ("detections.csv", "summary.json", "camchain-imucam.yaml"):
        assert (out / name).read_bytes() == (rig / name).read_bytes(), f"{name}: other bytes than from the folder"
    assert not (out / "detecting").exists()


def check_record(board, folder, rig):
    """The right camera of a flight record alone, without a calibration to be asked for."""
    record, out = folder / "board.mcap", folder / "from_record"
    fbvins("convert", board, record)
    fbvins("calibrate", record, "--topics", "/camera/right", "--cameras-only", "--target", board / "target.yaml", "--save-detections", "--out", out)
    rows = [line.split(",") for line in (rig / "detections.csv").read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    # Cameras alone do not measure the board, and say so.
    assert any("all lengths are those of the board's file (88 mm)" in remark for remark in summary_of(out)["remarks"]), summary_of(out)["remarks"]
    found = [line.split(",") for line in (out / "detections.csv").read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    assert found == [[t, "0", *rest] for t, camera, *rest in rows if camera == "1"] != []
    refused = subprocess.run([PROGRAM, "calibrate", record, "--topics", "/left", "--target", board / "target.yaml", "--out", out],
                             capture_output=True, text=True, timeout=60, check=False)
    assert refused.returncode == 2 and "there are images on /camera/left, /camera/right, readings on /imu" in refused.stderr, refused


def check_rolling(folder):
    """The line delay is found and written, with the time offset of the middle row; lenses are those of a global shutter."""
    board, rig = folder / "rolling_board", folder / "rolling_rig"
    fbvins("simulate", "board", "--cameras", 1, "--seconds", 9, "--rate", 5, "--seed", 4, "--line-delay", 20, "--out", board)
    fbvins("calibrate", board, "--target", board / "target.yaml", "--line-delay", "--out", rig)
    camchain = (rig / "camchain-imucam.yaml").read_text(encoding="utf-8")
    delay_s, offset_s = (float(re.search(rf"{key}: (\S+)", camchain)[1]) for key in ("line_delay", "timeshift_cam_imu"))
    assert abs(delay_s - 20e-6) < 0.3e-6 and abs(offset_s - 0.005) < 1e-4, camchain  # the first row's is 4.8 ms earlier
    found = summary_of(rig)["parameters"]
    assert abs(found["cam0.fx"]["value"] - 458.7) < 0.2, found["cam0.fx"]
    shown = subprocess.run([PROGRAM, "info", board, "--calibration", rig / "camchain-imucam.yaml"], capture_output=True, text=True, timeout=60, check=True)
    assert re.search(r"line delay (19\.[789]|20\.[012])", shown.stdout), shown.stdout


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        board, rig = folder / "board", folder / "rig"
        fbvins("simulate", "board", "--seconds", "8", "--rate", "5", "--seed", "3", "--out", board)
        fbvins("calibrate", board, "--target", board / "target.yaml", "--save-detections", "--out", rig)
        check_truth(summary_of(rig))
        check_rolling(folder)
        if pathlib.Path(PROGRAM).with_name("fbvins-bags").exists():
            check_bag(board, folder, rig)
            check_record(board, folder, rig)
        if browser.PROGRAM:
            check_page(rig)
    print("calibrated; " + ("the page draws every plot and shows the right figures" if browser.PROGRAM else "no Chromium here to open the page with"))
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rendered recording of a board through `fbvins calibrate`: the calibration is the one that was put in, and its page shows it.

usage: calibrate.py FBVINS
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

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


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        board, rig = folder / "board", folder / "rig"
        fbvins("simulate", "board", "--seconds", "8", "--rate", "5", "--seed", "3", "--out", board)
        fbvins("calibrate", board, "--target", board / "target.yaml", "--out", rig)
        check_truth(summary_of(rig))
        if browser.PROGRAM:
            check_page(rig)
    print("calibrated; " + ("the page draws every plot and shows the right figures" if browser.PROGRAM else "no Chromium here to open the page with"))
    return 0


if __name__ == "__main__":
    sys.exit(main())

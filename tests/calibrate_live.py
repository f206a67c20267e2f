#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rendered board, replayed as live sensors, through `fbvins calibrate --source`: it ends by itself with the calibration that was put
in, what it kept gives the same bytes again, guidance names what the recording lacks, the page shows it, and Ctrl-C loses nothing.

usage: calibrate_live.py FBVINS
FBVINS_WEB_PICTURES=FOLDER keeps a picture of the page (docs/calibration.md).
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import browser
from calibrate import check_truth, summary_of

PROGRAM = sys.argv[1]
PICTURES = os.environ.get("FBVINS_WEB_PICTURES")
SPEED = 0.4  # of the replay: images of a busy machine are looked at often enough


def fbvins(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, timeout=600)


def live(board, out, *more, speed=SPEED):
    return [PROGRAM, "calibrate", "--source", f"replay:{board}@{speed}", "--target", str(board / "target.yaml"), "--out", str(out), *more]


def check_end(board, folder):
    """It ends before the recording does, and its files give the same calibration without the sensors."""
    out, again = folder / "live", folder / "again"
    done = subprocess.run(live(board, out), capture_output=True, text=True, timeout=600, check=True)
    assert "all aims are reached" in done.stderr, done.stderr
    assert "show the board to the cameras" in done.stderr and "too few" in done.stderr, done.stderr
    summary = summary_of(out)
    check_truth(summary)
    assert summary["weak"] == [], summary["weak"]
    fbvins("calibrate", "--detections", out / "detections.csv", "--imu", out / "imu0.csv", "--imu-calibration", out / "imu.yaml",
           "--target", board / "target.yaml", "--out", again)
    for name in ("summary.json", "camchain-imucam.yaml", "imu.yaml", "calibration.html"):
        assert (out / name).read_bytes() == (again / name).read_bytes(), f"{name}: other bytes than from the files that were kept"


def check_without_tilt(folder):
    """A board that is always parallel to the image determines no focal length: guidance asks for the tilt, and nothing is answered."""
    board, out = folder / "flat", folder / "flat_out"
    fbvins("simulate", "board", "--motion", "distance,roll", "--seconds", "6", "--rate", "5", "--seed", "4", "--out", board)
    done = subprocess.run(live(board, out, "--cameras-only", speed=0.2), capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 1, done
    assert re.search("tilt the board about its (horizontal|vertical) axis, its (upper|lower|left|right) edge towards cam[01]", done.stderr), done.stderr
    assert "all aims are reached" not in done.stderr and not (out / "summary.json").exists()
    assert (out / "detections.csv").read_text(encoding="utf-8").count("\n") > 100


def look_at_page(address, interrupt):
    """A desktop's and a phone's page: images with corners, a sentence, progress; after the interruption the end."""
    with browser.Browser() as chromium:
        page, phone = chromium.open(address, width=1400, height=900), chromium.open(address, width=390, height=844, phone=True)
        for one in (page, phone):
            one.wait_for("document.querySelectorAll('#cameras canvas').length === 2")
            one.wait_for("[...document.querySelectorAll('#cameras canvas')].some(c => Number(c.dataset.corners) > 30)")
            one.wait_for("document.querySelectorAll('#parts li').length >= 4")
        assert len(page.text("action")) > 10 and "px" in page.text("parts"), page.text("action")
        assert page.value("document.querySelector('#parts meter').value") > 0
        assert re.fullmatch(r"\d+ views, \d+ % of the image seen", page.value("document.querySelector('#cameras small').textContent"))
        assert page.value("document.getElementById('next').dataset.stage") == "recording"
        assert phone.value("document.documentElement.scrollWidth") <= 390, "the phone's page is too wide"
        if PICTURES:
            page.picture(f"{PICTURES}/calibrate_live.jpg")
        assert page.faults() == [] and phone.faults() == [], (page.faults(), phone.faults())
        origin = address.split("#")[0]
        assert all(a.startswith((origin, "blob:" + origin, "data:")) for a in page.addresses()), page.addresses()
        interrupt()
        page.wait_for("document.getElementById('next').dataset.stage === 'done'")
        assert "The calibration is in" in page.text("action"), page.text("action")


def check_early(board, folder):
    """Ctrl-C before the readings determine anything: the cameras alone are calibrated."""
    out = folder / "early"
    with open(folder / "early_said", "w+", encoding="utf-8") as said:
        program = subprocess.Popen(live(board, out, speed=0.1), stdout=subprocess.DEVNULL, stderr=said)
        end = time.monotonic() + 120
        while "mm" not in (folder / "early_said").read_text(encoding="utf-8") and time.monotonic() < end and program.poll() is None:
            time.sleep(0.1)
        program.send_signal(signal.SIGINT)
        assert program.wait(timeout=120) == 1
        text = (folder / "early_said").read_text(encoding="utf-8")
    assert "the calibration of the cameras alone is in" in text, text
    for name in ("detections.csv", "imu0.csv", "camchain.yaml", "summary.json"):
        assert (out / name).stat().st_size > 100, name
    assert not (out / "camchain-imucam.yaml").exists()


def check_interrupted(board, folder):
    """Ctrl-C in the middle: all files are there."""
    out = folder / "interrupted"
    with open(folder / "said", "w+", encoding="utf-8") as said:
        program = subprocess.Popen(live(board, out, "--cameras-only", "--web", speed=0.1), stdout=subprocess.DEVNULL, stderr=said)
        try:
            text, end = "", time.monotonic() + 120
            while not ("the page is" in text and "mm" in text) and time.monotonic() < end and program.poll() is None:
                time.sleep(0.1)
                text = (folder / "said").read_text(encoding="utf-8")
            address = re.search(r"the page is (\S+)", text)
            if address and browser.PROGRAM:
                look_at_page(address[1], lambda: program.send_signal(signal.SIGINT))
            else:
                program.send_signal(signal.SIGINT)
            assert program.wait(timeout=120) == 0, (folder / "said").read_text(encoding="utf-8")
        finally:
            program.kill()
    for name in ("detections.csv", "imu0.csv", "camchain.yaml", "summary.json", "calibration.html"):
        assert (out / name).stat().st_size > 100, name


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        board = folder / "board"
        fbvins("simulate", "board", "--seconds", "20", "--rate", "5", "--seed", "3", "--out", board)
        check_end(board, folder)
        check_interrupted(board, folder)
        check_early(board, folder)
        check_without_tilt(folder)
    print("calibrated live" + ("" if browser.PROGRAM else "; no Chromium here to open the page with"))
    return 0


if __name__ == "__main__":
    sys.exit(main())

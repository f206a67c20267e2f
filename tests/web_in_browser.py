#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens the page of `fbvins live --web` and `fbvins view` in headless Chromium: it shows a flight, its figures are those of the run,
its buttons work, and it requests nothing from other addresses.

usage: web_in_browser.py FBVINS      exit 77 where there is no Chromium, or no page in the program
FBVINS_WEB_PICTURES=FOLDER keeps pictures of the pages; those of docs/web.md, best taken while nothing else runs:
  FBVINS_WEB_PICTURES=$PWD/docs/images ctest --test-dir build -R web_in_browser
"""
import csv
import json
import math
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import browser
from browser import Browser

PROGRAM = sys.argv[1]
PICTURES = os.environ.get("FBVINS_WEB_PICTURES")
DESKTOP, PHONE = {"width": 1400, "height": 1250}, {"width": 390, "height": 844, "phone": True}
HAS_IMAGE = "Number(document.getElementById('image').dataset.features) > 20"


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", text.replace("\u202f", ""))]


def poses(run):
    with open(run / "trajectory.csv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    return [row for row in rows if row[-3] in ("good", "degraded")], rows


class WebInBrowser(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder_object = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.folder_object.name)
        cls.flight, cls.run_folder = cls.folder / "flight", cls.folder / "run"
        cls.fbvins("simulate", "normal", "--seconds", "12", "--set", "image_rate_hz=10", "--out", cls.flight)
        cls.fbvins("run", cls.flight, "--frontend", "klt", "--out", cls.run_folder)
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()
        cls.folder_object.cleanup()

    @staticmethod
    def fbvins(*arguments):
        subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, timeout=600)

    def serve(self, *arguments, **environment):
        """The program in the background, and the page's address."""
        port = free_port()
        program = subprocess.Popen([PROGRAM, *map(str, arguments), "--web", str(port)], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                   text=True, env={**os.environ, **environment})
        self.addCleanup(program.stderr.close)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        for line in program.stderr:
            if address := re.search(r"the page is (\S+)", line):
                return program, address[1]
        self.fail("the program ended without a page")

    def check_alone(self, page, address):
        """The page has no error and requested nothing from other addresses."""
        self.assertEqual(page.faults(), [])
        origin = address.split("#")[0]
        strangers = [a for a in page.addresses() if not a.startswith((origin, "blob:" + origin, "data:"))]
        self.assertEqual(strangers, [])
        self.assertGreater(len(page.addresses()), 5)

    def check_figures(self, page, run):
        """Compares the figures of the last pose and those of the whole run."""
        known, rows = poses(run)
        last = [float(x) for x in known[-1][1:14]]
        shown = page.text("position").replace("\u2212", "-")
        for a, b in zip(numbers(shown), last[0:3], strict=True):
            self.assertAlmostEqual(a, b, delta=0.0051, msg=shown)  # the page has single precision: a half may round either way
        self.assertAlmostEqual(numbers(page.text("speed"))[0], math.hypot(*last[7:10]), delta=0.006)
        places = [[float(x) for x in row[1:4]] for row in known]
        self.assertAlmostEqual(numbers(page.text("distance"))[0], sum(map(math.dist, places, places[1:])), delta=0.06)
        sigma_cm = 100 * math.sqrt(sum(float(known[-1][i]) for i in (17, 23, 28)))
        self.assertAlmostEqual(numbers(page.text("sigma"))[0], sigma_cm, delta=0.06)
        self.assertEqual(numbers(page.text("images"))[0], len(rows))

    @staticmethod
    def keys(page):
        """What the keys of scene and time line name."""
        return set(json.loads(page.value("JSON.stringify([...document.querySelectorAll('[data-key]')].filter(e => !e.hidden).map(e => e.dataset.key))")))

    def test_a_finished_run_shows_its_figures_and_is_wound_back(self):
        _, address = self.serve("view", self.run_folder, "--recording", self.flight)
        page = self.browser.open(address, **DESKTOP)
        page.wait_for("document.getElementById('health').dataset.state === 'good'")
        duration = page.value("Number(document.getElementById('seek').max)")
        seek = "(t => { const s = document.getElementById('seek'); s.value = t; s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change')); })"
        page.value(f"{seek}({duration})")
        page.wait_for(f"document.getElementById('clock').dataset.image === '{len(poses(self.run_folder)[1]) - 1}'")
        time.sleep(0.5)
        self.check_figures(page, self.run_folder)
        self.assertIn("Position known to ±", page.text("health-words"))
        self.assertIn("waiting until the vehicle rests", page.text("changes"))
        self.assertEqual(self.keys(page), {row[-3] for row in poses(self.run_folder)[1]} | {"ellipsoid"}, "keys name only what a folder has: it has no landmarks and no marks")
        page.value(f"{seek}({duration / 2})")
        page.wait_for(f"Math.abs(Number(document.getElementById('seek').value) - {duration / 2}) < 0.2 && "
                      f"Number(document.getElementById('clock').dataset.image) < {0.6 * len(poses(self.run_folder)[1])}")
        page.click("play")
        page.wait_for(f"Number(document.getElementById('clock').dataset.image) === {len(poses(self.run_folder)[1]) - 1}")
        self.check_alone(page, address)

    def test_without_3d_graphics_the_path_is_shown_from_above(self):
        _, address = self.serve("view", self.run_folder)
        with Browser(["--disable-3d-apis"]) as flat:
            page = flat.open(address, **DESKTOP)
            page.wait_for("document.getElementById('health').dataset.state === 'good'")
            self.assertFalse(page.value("document.getElementById('no-webgl').hidden"))
            page.wait_for("""(canvas => [...canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data]
                             .filter((value, i) => i % 4 === 1 && value > 150).length > 100)(document.getElementById('scene'))""")

    def test_a_stranger_is_asked_for_the_token(self):
        _, address = self.serve("view", self.run_folder, FBVINS_WEB_TOKEN="0123456789abcdef")
        page = self.browser.open(address.split("#")[0], **DESKTOP)
        page.wait_for("document.getElementById('token-dialog')?.open")
        self.assertEqual(page.text("position"), "–")
        page.value("document.getElementById('token').value = '0123456789abcdef'; document.querySelector('#token-dialog button').click()")
        page.wait_for("document.getElementById('position').textContent !== '–'")

    def test_a_live_flight_with_its_buttons_and_its_record(self):
        live, record, kept = self.folder / "live", self.folder / "flight.mcap", self.folder / "flight.fbm"
        program, address = self.serve("live", "--source", f"replay:{self.flight}", "--laps", "20", "--frontend", "klt", "--out", live, "--record",
                                      record, "--save-map", kept, "--quiet", "--set", "live.mavlink.mounting.imu_axes=camera_fwd",
                                      "--set", "live.mavlink.mounting.roll_rad=-1.5708", FBVINS_WEB_TOKEN="0123456789abcdef")
        self.assertTrue(address.endswith("#token=0123456789abcdef"))
        page, phone = self.browser.open(address, **DESKTOP), self.browser.open(address, **PHONE)
        for one in (page, phone):
            one.wait_for("document.getElementById('health').dataset.state === 'good'")
            one.wait_for(HAS_IMAGE)
        self.assertLessEqual(phone.value("document.documentElement.scrollWidth"), PHONE["width"], "the phone's page is too wide")
        page.wait_for("!document.querySelector('[data-key=points]').hidden && !document.querySelector('[data-key=keyframes]').hidden")
        self.assertNotIn("mark", self.keys(page))
        self.assertEqual(page.text("attitude-of"), "Roll, pitch, yaw of the vehicle")
        roll, pitch, _ = numbers(page.text("attitude").replace("\u2212", "-"))
        self.assertLess(max(abs(roll), abs(pitch)), 60, "the vehicle is upright, however its IMU is mounted")
        page.click("mark")
        phone.wait_for("document.getElementById('changes').textContent.includes('mark')")
        page.click("save-map")  # the map is saved with the next keyframe
        end = time.monotonic() + browser.PATIENCE_S
        while not kept.exists() and time.monotonic() < end:  # before the run ends, which saves the map as well
            time.sleep(0.05)
        self.assertTrue(kept.exists(), f"no map is saved: {page.text('note')}; {page.text('health-words')}; {page.text('map')}")
        if PICTURES:
            page.click("fit")
            time.sleep(1)
            page.picture(f"{PICTURES}/web_desktop.jpg")
            phone.picture(f"{PICTURES}/web_phone.jpg")
        self.assertEqual(phone.faults(), [])
        phone.call("Page.navigate", url="about:blank")
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=60), 0)
        page.wait_for("document.getElementById('note').textContent.includes('The flight has ended')")
        self.check_figures(page, live)
        counts = json.loads((live / "summary.json").read_text(encoding="utf-8"))["live"]
        self.assertEqual(numbers(page.text("dropped"))[0], counts["images_dropped"])
        self.assertEqual(numbers(page.text("imu")), [counts["imu"], counts["imu_late"]])
        self.assertAlmostEqual(numbers(page.text("latency"))[0], counts["shutter_to_pose_ms"]["p50"], delta=0.06)
        # The connection ends with the program; the page's messages about its attempts to reconnect are no fault.
        self.assertEqual([f for f in page.faults() if "ERR_CONNECTION" not in f], [])
        self.check_record(record, live)

    def test_record_and_reset_from_the_page_and_the_link_of_a_flight_controller(self):
        record = self.folder / "asked.mcap"
        program, address = self.serve("live", "--source", f"replay:{self.flight}", "--laps", "20", "--frontend", "klt", "--record", record,
                                      "--record-on-request", "--mavlink", f"udp:127.0.0.1:{free_port()}:{free_port()}", "--quiet")
        page = self.browser.open(address, **DESKTOP)
        page.wait_for("document.getElementById('health').dataset.state === 'good'")
        page.wait_for(HAS_IMAGE)
        page.value("document.querySelector('#camera-choice [data-camera=\"1\"]').click()")
        page.wait_for(f"document.getElementById('image').dataset.camera === '1' && {HAS_IMAGE}")
        page.wait_for("document.getElementById('link').textContent.startsWith('not heard, 0 poses')")
        self.assertEqual(page.text("clocks"), "not known: no poses are sent")
        self.assertEqual(page.text("record-words"), "not being recorded")
        self.assertFalse(record.exists())
        page.click("record")
        page.wait_for("document.getElementById('record').textContent === 'Stop record'")
        page.wait_for("/^asked.mcap, \\d+\\.\\d MB; \\d+ [MG]B free$/.test(document.getElementById('record-words').textContent)")
        page.click("record")
        page.wait_for("document.getElementById('record').textContent === 'Record'")
        self.assertGreater(record.stat().st_size, 1000)
        page.click("reset")
        page.wait_for("document.getElementById('reset-dialog').open")
        page.value("document.querySelector('#reset-dialog [value=no]').click()")
        time.sleep(1.5)
        self.assertEqual(page.text("resets"), "0", "it was cancelled")
        page.click("reset")
        page.value("document.querySelector('#reset-dialog [value=yes]').click()")
        page.wait_for("document.getElementById('resets').textContent === '1'")
        self.check_alone(page, address)
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=60), 0)

    def check_record(self, record, live):
        program, address = self.serve("view", record)
        page = self.browser.open(address, **DESKTOP)
        page.wait_for(HAS_IMAGE)
        page.value("(s => { s.value = s.max; s.dispatchEvent(new Event('input')); })(document.getElementById('seek'))")
        page.wait_for("document.getElementById('player-clock').textContent.split(' / ')[0] === document.getElementById('player-clock').textContent.split(' / ')[1]")
        page.wait_for("document.getElementById('clock').dataset.image > 0")
        time.sleep(0.5)
        self.check_figures(page, live)
        self.assertIn("mark", page.text("changes"))
        self.check_alone(page, address)
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=30), 0)


if __name__ == "__main__":
    if not browser.PROGRAM:
        print("skipped: no Chromium here to open the page with")
        sys.exit(77)
    said = subprocess.run([PROGRAM, "view", "/nowhere"], capture_output=True, text=True, timeout=60, check=False).stderr
    if "built without" in said:
        print(f"skipped: {said.strip()}")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Devices that `fbvins live --source d435i` and the like read by a program of their own (examples/*_bridge.py), with stand-ins for these
programs: it is started, watched and ended, and what it says is one clear sentence.

usage: bridge_source.py FBVINS [PYTHON]    PYTHON: one that may have the makers' packages, for the real programs without a device
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, PYTHONS = sys.argv[1], sys.argv[2:]
EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"

# A camera for a few seconds, by the sender of the examples; its arguments and its process are written down.
SENDER = f"""
import os, sys
sys.path.insert(0, {str(EXAMPLES)!r})
import socket_sender
here = os.path.dirname(os.path.abspath(__file__))
with open(here + "/started", "a") as file:
    print(os.getpid(), *sys.argv[2:], file=file)
print("waiting for fbvins at", sys.argv[1], file=sys.stderr)
"""
FLIES = """
sys.argv[2:] = [{seconds}]
sys.exit(socket_sender.main())
"""


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


class BridgeSource(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.bridges, self.temporary = self.folder / "bridges", self.folder / "tmp"
        self.bridges.mkdir()
        self.temporary.mkdir()
        self.environment = {**os.environ, "FBVINS_BRIDGES": str(self.bridges), "TMPDIR": str(self.temporary), "FBVINS_PYTHON": sys.executable}

    def bridge(self, text, name="oak_bridge.py"):
        (self.bridges / name).write_text(text, encoding="ascii")

    def start(self, *arguments):
        live = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.environment)
        self.addCleanup(live.kill)
        return live

    def said(self, live, seconds=60):
        out, err = live.communicate(timeout=seconds)
        return live.returncode, out, err

    def started(self, times=1):
        """The lines that starts have written, once there are so many."""
        for _ in range(600):
            try:
                lines = (self.bridges / "started").read_text(encoding="ascii").splitlines()
            except FileNotFoundError:
                lines = []
            if len(lines) >= times:
                return lines
            time.sleep(0.05)
        self.fail("the bridge was not started")

    def ended(self, pid):
        for _ in range(60):
            if not is_alive(pid):
                return
            time.sleep(0.05)
        self.fail("the bridge's process is left over")

    def assert_fails(self, *words, source="oak", more=(), command="live"):
        code, out, err = self.said(self.start(command, "--source", source, *more))
        self.assertEqual((code, out), (2, ""), err)
        for word in words:
            self.assertIn(word, err)
        self.assertNotIn("Traceback", err)
        self.assertEqual(len(err.strip().splitlines()), 1, err)
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_it_flies_until_its_data_end(self):
        self.bridge(SENDER + FLIES.format(seconds=5))
        code, _, err = self.said(self.start("live", "--source", "oak:14442C10D1:640x480@20", "--quiet", "--out", self.folder / "out"))
        self.assertEqual(code, 0, err)
        self.assertEqual(self.started()[0].split()[1:], ["14442C10D1", "640x480@20"])
        poses = (self.folder / "out" / "trajectory_tum.txt").read_text(encoding="ascii").splitlines()
        self.assertGreater(len(poses), 30)
        self.assertIn("oak: synthetic rig is connected", err)
        self.assertNotIn(str(self.temporary), err, "the socket is an inner matter")
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_signals_end_both(self):
        self.bridge(SENDER + FLIES.format(seconds=100))
        for stop, wanted in ((signal.SIGINT, (0, 1)), (signal.SIGTERM, (0, 1)), (signal.SIGKILL, (-9,))):
            with self.subTest(stop=stop):
                (self.bridges / "started").unlink(missing_ok=True)
                live = self.start("live", "--source", "oak", "--quiet")
                pid = int(self.started()[0].split()[0])
                time.sleep(1)
                self.assertTrue(is_alive(pid))
                live.send_signal(stop)
                code, _, err = self.said(live)
                self.assertIn(code, wanted, err)
                self.ended(pid)
                if stop != signal.SIGKILL:
                    self.assertEqual(list(self.temporary.iterdir()), [])

    def test_one_that_dies_in_flight_is_started_again(self):
        self.bridge(SENDER + "import threading\nif not os.path.exists(here + '/again'):\n    open(here + '/again', 'w').close()\n"
                    "    threading.Timer(3, lambda: (print('USB is gone', file=sys.stderr, flush=True), os._exit(3))).start()\n" + FLIES.format(seconds=4))
        code, _, err = self.said(self.start("live", "--source", "oak", "--quiet"))
        self.assertEqual(code, 0, err)
        self.assertEqual(len(self.started()), 2)
        self.assertIn("oak: USB is gone; it is started again", err)

    def test_a_missing_package_is_the_line_that_installs_it(self):
        self.bridge("import no_such_package\n")
        self.assert_fails("oak: `pip install 'depthai>=3' numpy`", "no_such_package")
        target = self.folder / "board"
        subprocess.run([PROGRAM, "target", "--out", target], check=True, capture_output=True)
        self.assert_fails("pip install", command="calibrate", more=("--target", target.with_suffix(".yaml"), "--out", self.folder / "rig"))
        self.bridge("import no_such_package\n", "d435i_bridge.py")
        for name in ("d435i", "d435i:123:848x480@60", "realsense"):
            self.assert_fails("`pip install pyrealsense2 numpy`", source=name)
        flight = self.folder / "flight"
        subprocess.run([PROGRAM, "simulate", "normal", "--seconds", "2", "--seed", "1", "--quiet", "--out", flight], check=True, timeout=300)
        self.assert_fails("pip install", more=("--calibration", flight))

    def test_what_it_refuses_is_its_sentence(self):
        self.bridge("import sys\nsys.exit('the camera has no mode 1x1, but 640x480@30')\n")
        self.assert_fails("error: oak: the camera has no mode 1x1, but 640x480@30")
        self.bridge("def f():\n    raise RuntimeError('the device is in use by another program')\nf()\n")
        self.assert_fails("error: oak: the device is in use by another program")

    def test_without_a_device_it_waits_and_says_so(self):
        self.bridge(SENDER + "import time\nprint('waiting for an OAK: none is there', file=sys.stderr, flush=True)\ntime.sleep(100)\n")
        live = self.start("live", "--source", "oak")
        pid = int(self.started()[0].split()[0])
        time.sleep(1)
        self.assertIsNone(live.poll())
        live.send_signal(signal.SIGINT)
        code, _, err = self.said(live)
        self.assertEqual(code, 2, err)
        self.assertIn("oak: waiting for an OAK: none is there", err)
        self.assertIn("error: oak: no device came", err)
        self.ended(pid)

    def test_wrong_names_and_what_is_not_there(self):
        self.assert_fails("oak_bridge.py", str(self.bridges), "FBVINS_BRIDGES")
        self.bridge("")
        self.assert_fails("oak: its program has ended (exit code 0)")
        self.environment["FBVINS_PYTHON"] = "/nowhere/python3"
        self.assert_fails("oak: /nowhere/python3 cannot be started", "FBVINS_PYTHON")
        self.assert_fails("depth images", "librealsense2", source="d435i:depth")
        self.assert_fails("zed:672x376", source="zed")
        self.assert_fails("source 'OAK': it is replay:", "oak, orbbec", source="OAK")

    def test_the_real_programs_without_a_device(self):
        del self.environment["FBVINS_BRIDGES"]
        tried = 0
        for package, other, source, wanted in (("pyrealsense2", "FBVINS_REALSENSE", "d435i:848x480@60", "a RealSense camera: none is plugged in"),
                                               ("depthai", "FBVINS_DEPTHAI", "oak:@20", "an OAK")):
            python = next((p for p in [*PYTHONS, os.environ.get(other, "")] if p and os.path.exists(p)), None)
            if python is None or subprocess.run([python, "-c", f"import {package}, numpy"], capture_output=True, check=False).returncode:
                continue
            tried += 1
            self.environment["FBVINS_PYTHON"] = python
            live = self.start("live", "--source", source)
            time.sleep(6)
            live.send_signal(signal.SIGTERM)
            code, _, err = self.said(live)
            self.assertIn(code, (0, 1, 2), err)
            self.assertRegex(err, f"{source.split(':')[0]}: (waiting|looking) for {wanted}|is connected")
        if not tried:
            self.skipTest("neither pyrealsense2 nor depthai is installed; FBVINS_REALSENSE and FBVINS_DEPTHAI may name a Python that has them")

    def test_arguments_that_no_bridge_has(self):
        """The real programs, with stand-ins for their makers' packages: each refuses them in a sentence of its own."""
        del self.environment["FBVINS_BRIDGES"]
        stand_ins = self.folder / "packages"
        stand_ins.mkdir()
        anything = "import types, sys\nclass Any(types.ModuleType):\n    def __getattr__(self, name):\n        if name.startswith('__'):\n            raise AttributeError(name)\n" \
                   "        return Any(name)\n    def __call__(self, *a, **k):\n        return Any('x')\nsys.modules[__name__] = Any(__name__)\n"
        for package in ("numpy", "depthai"):
            (stand_ins / f"{package}.py").write_text(anything, encoding="ascii")
        self.environment["PYTHONPATH"] = str(stand_ins)
        self.assert_fails("oak: images are of 640x400", source="oak:1280x800")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)

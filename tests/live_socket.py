#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `fbvins live --source socket:PATH` with the senders of examples/, in wall time (about a minute).

usage: live_socket.py FBVINS CXX
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, CXX = sys.argv[1:3]
REPOSITORY = pathlib.Path(__file__).resolve().parents[1]
REAL = pathlib.Path(os.environ.get("FBVINS_DATA") or REPOSITORY.parent / "shared" / "data") / "MH_01_easy_17s"
RECORDING = REAL if REAL.exists() else pathlib.Path(os.environ["FBVINS_SIMULATED_FLIGHT"])
# The Python sender as it is, but with the same synthetic wall and noise every time.
SEEDED = "import random, runpy, sys; random.seed(7); del sys.argv[0]; runpy.run_path(sys.argv[0], run_name='__main__')"


def rows(sensor):
    """The number of readings or images in the recording."""
    with open(RECORDING / "mav0" / sensor / "data.csv", encoding="utf-8") as file:
        return sum(1 for line in file if line[:1].isdigit())


def seconds_left(until):
    return max(0.0, until - time.monotonic())


class LiveSocket(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.path, self.out = self.folder / "s", self.folder / "out"

    def listen(self, *arguments):
        live = subprocess.Popen([PROGRAM, "live", "--source", f"socket:{self.path}", "--out", self.out, "--quiet", *arguments],
                                stderr=subprocess.PIPE, text=True)
        self.addCleanup(live.kill)
        self.addCleanup(live.stderr.close)
        until = time.monotonic() + 30
        while not self.path.exists() and seconds_left(until):
            time.sleep(0.01)
        self.assertTrue(self.path.exists())
        return live

    def end(self, live):
        time.sleep(0.5)  # the last image's pose
        live.send_signal(signal.SIGINT)
        self.assertEqual(live.wait(timeout=30), 0)
        self.assertFalse(self.path.exists(), "the socket is removed")
        return live.stderr.read()

    def python_sender(self, seconds):
        return subprocess.Popen([sys.executable, "-c", SEEDED, REPOSITORY / "examples/socket_sender.py", self.path, str(seconds)])

    def compile_sender(self):
        sender = self.folder / "socket_sender"
        subprocess.run([CXX, "-std=c++20", "-O2", "-Wall", "-Wextra", "-Werror", "-pthread", "-I", REPOSITORY / "include",
                        REPOSITORY / "examples/socket_sender.cpp", "-lpng", "-o", sender], check=True)
        return sender

    def recording_of_the_senders_rig(self):
        """RECORDING with the sender's extrinsics to the last digit; a simulated recording has them to ten."""
        rig = (REPOSITORY / "examples/euroc_rig.hpp").read_text(encoding="utf-8")
        extrinsics = [numbers for group in re.findall(r"\{([^{}]*)\}", rig) if len(numbers := group.split(",")) == 12]
        copy = self.folder / "recording"
        for sensor in ("cam0", "cam1", "imu0"):
            (copy / "mav0" / sensor).mkdir(parents=True)
            for path in (RECORDING / "mav0" / sensor).iterdir():
                (copy / "mav0" / sensor / path.name).symlink_to(path.resolve())
        for camera, numbers in enumerate(extrinsics):
            path = copy / f"mav0/cam{camera}/sensor.yaml"
            text = path.read_text(encoding="utf-8")
            path.unlink()
            path.write_text(re.sub(r"data: \[[^\]]*\]", f"data: [{', '.join(numbers)}, 0, 0, 0, 1]", text), encoding="utf-8")
        return copy

    def every_image_was_estimated(self, said, sent):
        """Whether the motion can be compared. A machine that is too slow, or too busy, for wall time misses images: each is counted."""
        counts = json.loads((self.out / "summary.json").read_text(encoding="utf-8"))["live"]
        frames, missed = map(int, re.findall(r"\((\d+) frames, (\d+) missed", said)[-1])
        self.assertLessEqual(frames + missed, sent)
        self.assertEqual(counts["images_estimated"] + counts["images_dropped"] + counts["images_late"], counts["images"])
        return missed == 0 and counts["images_dropped"] == 0

    def poses(self, folder):
        rows = [line.split() for line in (folder / "trajectory_tum.txt").read_text().splitlines() if not line.startswith("#")]
        return [[float(number) for number in row[:4]] for row in rows]

    def test_the_header_is_c(self):
        subprocess.run([CXX, "-x", "c", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only",
                        REPOSITORY / "include/fbvins/live/socket_protocol.hpp"], check=True)

    def test_the_page_and_the_header_agree(self):
        facts = []
        for line in (REPOSITORY / "docs/socket.md").read_text(encoding="utf-8").splitlines():
            if match := re.match(r"### (Fbvins\w+),(?: type (\d+),)? (\d+) bytes", line):
                struct = match[1]
                facts.append(f"sizeof({struct}) == {match[3]}")
                if match[2]:
                    facts.append(f"FBVINS_SOCKET_{struct.removeprefix('FbvinsSocket').upper()} == {match[2]}")
            elif match := re.match(r"### (Fbvins\w+), type", line):
                struct = match[1]
            elif match := re.match(r"\| (\d+) \| `(\w+)` \|", line):
                facts.append(f"offsetof({struct}, {match[2]}) == {match[1]}")
        self.assertGreater(len(facts), 60)
        source = self.folder / "facts.cpp"
        source.write_text('#include <cstddef>\n#include "fbvins/live/socket_protocol.hpp"\n'
                          + "".join(f"static_assert({fact});\n" for fact in facts))
        subprocess.run([CXX, "-std=c++20", "-fsyntax-only", "-I", REPOSITORY / "include", source], check=True)

    def test_a_sender_is_killed_and_the_next_goes_on(self):
        live = self.listen()
        first = self.python_sender(60)
        time.sleep(4)
        first.kill()
        first.wait()
        self.assertIsNone(live.poll())
        self.assertEqual(self.python_sender(7).wait(timeout=60), 0)
        said = self.end(live)
        self.assertIn("synthetic rig: left without a goodbye", said)
        self.assertRegex(said, r"synthetic rig: said goodbye: end of the synthetic flight \(1\d\d frames, \d+ missed, 1400 readings, 0 refused\)")
        # The rig sways by 0.4 m to the right, and by nothing else. The second sender has another wall: W may be a new one.
        self.assertTrue(self.poses(self.out))
        if not self.every_image_was_estimated(said, 140):
            return
        last = self.poses(self.out)[-60:]
        span_m = [max(p[i] for p in last) - min(p[i] for p in last) for i in (1, 2, 3)]
        self.assertAlmostEqual((span_m[0]**2 + span_m[1]**2)**0.5, 0.4, delta=0.02)
        self.assertLess(span_m[2], 0.02)

    def test_a_second_listener_and_a_second_sender_are_refused(self):
        live = self.listen()
        again = subprocess.run([PROGRAM, "live", "--source", f"socket:{self.path}"], capture_output=True, text=True, timeout=30,
                               check=False)
        self.assertEqual(again.returncode, 2)
        self.assertIn("another program listens there", again.stderr)
        first = self.python_sender(4)
        time.sleep(1)
        second = subprocess.run([sys.executable, REPOSITORY / "examples/socket_sender.py", self.path], capture_output=True, text=True,
                                timeout=30, check=False)
        self.assertEqual(second.returncode, 1)
        self.assertIn("goodbye: another sender is connected: synthetic rig", second.stderr)
        self.assertEqual(first.wait(timeout=30), 0)
        self.end(live)

    def test_waiting_for_a_calibration_ends_at_a_signal(self):
        live = self.listen()
        live.send_signal(signal.SIGTERM)
        self.assertEqual(live.wait(timeout=30), 2)
        self.assertIn("no sender came", live.stderr.read())
        self.assertFalse(self.path.exists())

    def test_a_recording_over_the_socket_is_the_recording(self):
        sender, plain = self.compile_sender(), self.folder / "plain"
        subprocess.run([PROGRAM, "run", self.recording_of_the_senders_rig(), "--quiet", "--out", plain], check=True)
        live = self.listen()
        subprocess.run([sender, self.path, RECORDING / "mav0"], check=True, timeout=60)
        said = self.end(live)
        self.assertIn(f"{rows('imu0')} readings, 0 refused)", said)
        if not self.every_image_was_estimated(said, rows("cam0")):
            return
        for name in ("trajectory_tum.txt", "trajectory.csv"):
            self.assertEqual((self.out / name).read_bytes(), (plain / name).read_bytes(), name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

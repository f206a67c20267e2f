#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that `fbvins live --map` with one camera keeps a map from flight to flight: the second flight finds itself in what the first one saw.

usage: one_camera_map.py FBVINS FLIGHT
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PROGRAM, FLIGHT = sys.argv[1], pathlib.Path(sys.argv[2])


class OneCameraMap(unittest.TestCase):
    def fly(self, recording, kept):
        done = subprocess.run([PROGRAM, "live", "--source", f"replay:{recording}@2.5", "--max-images", "200", "--frontend", "klt", "--map", kept],
                              capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr

    def test_a_second_flight_finds_itself_in_the_map_of_the_first(self):
        with tempfile.TemporaryDirectory() as scratch:
            recording, kept = pathlib.Path(scratch) / "left", pathlib.Path(scratch) / "kept.fbm"
            (recording / "mav0").mkdir(parents=True)
            for part in ("cam0", "imu0"):
                (recording / "mav0" / part).symlink_to((FLIGHT / "mav0" / part).resolve())
            self.assertNotIn("knows where it is in the map", self.fly(recording, kept), "it begins the map")
            self.assertIn("knows where it is in the map", self.fly(recording, kept))
            info = subprocess.run([PROGRAM, "map", "info", kept], capture_output=True, text=True, timeout=60, check=True).stdout
            self.assertRegex(info, r"of 2 sessions")
            loops = int(re.search(r"session 1: .* (\d+) loops with other sessions", info)[1])
            self.assertGreater(loops, 5)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])

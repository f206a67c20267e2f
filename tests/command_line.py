#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The messages and exit codes of the program `fbvins`. Needs no recording.

usage: command_line.py FBVINS
"""
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv[1]


def fbvins(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False)


def times(a, b):
    """Product of quaternions w x y z."""
    (w, x, y, z), (v, i, j, k) = a, b
    return (w * v - x * i - y * j - z * k, w * i + x * v + y * k - z * j, w * j - x * k + y * v + z * i, w * k + x * j - y * i + z * v)


def turned(q, p):
    return times(times(q, (0, *p)), (q[0], -q[1], -q[2], -q[3]))[1:]


def tumbling(t):
    """Attitude and position of a body that is turned about all axes for a minute, and rests in its first and last two seconds."""
    u = min(max(min(t - 2, 58 - t) / 4, 0), 1)
    u = u ** 3 * (10 + u * (6 * u - 15))
    q = (1, 0, 0, 0)
    for axis, angle in ((1, 0.4 * math.sin(1.7 * t)), (2, 0.3 * math.sin(2.3 * t + 1)), (3, 0.8 * math.sin(0.9 * t + 0.2 * math.sin(0.4 * t)))):
        part = [math.cos(u * angle / 2), 0, 0, 0]
        part[axis] = math.sin(u * angle / 2)
        q = times(q, part)
    return q, (u * math.sin(0.8 * t), u * math.cos(0.6 * t), 0.5 * u * math.sin(1.1 * t))


class CommandLine(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path

    def assert_bad_input(self, done, *words):
        self.assertEqual(done.returncode, 2, done)
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertNotIn("\033", done.stderr, "colour only on a terminal")

    def test_help_and_version(self):
        self.assertRegex(fbvins("--version").stdout, r"^fbvins \d+\.\d+\.\d+\ncommit: .+\ncompiler: .+\nfeatures: .*\n$")
        for command in ([], ["run"], ["calibrate"], ["target"], ["simulate", "board"], ["mocap"], ["eval"], ["info"], ["doctor"], ["config"], ["simulate"], ["report"], ["bench"], ["fly"], ["tune"], ["live"], ["view"], ["map"], ["record"], ["px4"], ["convert"], ["bug-report"]):
            done = fbvins(*command, "--help")
            self.assertEqual(done.returncode, 0)
            self.assertIn("examples:", done.stdout)

    def test_a_command_whose_program_is_not_there(self):
        alone = self.folder / "fbvins"
        shutil.copy(PROGRAM, alone)
        done = subprocess.run([alone, "live"], capture_output=True, text=True, timeout=120, check=False)
        self.assert_bad_input(done, f"{self.folder}/fbvins-live", "No such file", "./dev build")

    def test_target_and_calibration_from_detections(self):
        name = self.folder / "board"
        self.assertEqual(fbvins("target", "--kind", "chessboard", "--columns", 8, "--rows", 6, "--size", 0.03, "--paper", "A3", "--out", name).returncode, 0)
        self.assertTrue(name.with_suffix(".pdf").read_bytes().startswith(b"%PDF-1.4"))
        self.assertIn('width="420mm" height="297mm"', name.with_suffix(".svg").read_text(encoding="utf-8"))
        self.assert_bad_input(fbvins("target", "--kind", "chessboard", "--size", 0.2, "--out", name), "would fit")
        rows = ["timestamp_ns,camera,corner,u_px,v_px"]
        for view in range(14):  # a pinhole camera of 500 px, the board turned to all sides
            q = times(times((math.cos(0.2), math.sin(0.2) * math.cos(view), math.sin(0.2) * math.sin(view), 0), (math.cos(0.1 * view), 0, 0, math.sin(0.1 * view))), (1, 0, 0, 0))
            for corner in range(48):
                x, y, z = turned(q, (0.03 * (corner % 8) - 0.105, 0.03 * (corner // 8) - 0.075, 0))
                x, y, z = x + 0.06 * math.cos(2 * view), y + 0.04 * math.sin(2 * view), z + 0.35 + 0.01 * view
                noise = 0.05 * math.sin(12.9898 * corner + 78.233 * view)
                rows.append(f"{1000 + view},0,{corner},{320.5 + 500 * x / z + noise:.4f},{240.25 + 500 * y / z - noise:.4f}")
        detections = self.write("detections.csv", "\n".join(rows) + "\n")
        target, out = name.with_suffix(".yaml"), self.folder / "rig"
        arguments = ["calibrate", "--detections", detections, "--target", target, "--out", out]
        done = fbvins(*arguments, "--resolution", "640x480")
        self.assertEqual(done.returncode, 0, done)
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        for parameter, value, tolerance in (("fx", 500, 1), ("fy", 500, 1), ("cx", 320.5, 1), ("cy", 240.25, 1), ("k1", 0, 0.01)):
            found = summary["parameters"]["cam0." + parameter]
            self.assertAlmostEqual(found["value"], value, delta=tolerance)
            self.assertLess(found["sigma"], tolerance)
        self.assertIn("resolution: [640, 480]", (out / "camchain.yaml").read_text(encoding="utf-8"))
        self.assert_bad_input(fbvins("calibrate", "--detections", detections), "--target is missing")
        self.assert_bad_input(fbvins("calibrate", "--target", target), "give a recording, --source or --detections")
        self.assert_bad_input(fbvins("calibrate", "--target", target, "--model", "ds", self.folder), str(target), "only AprilGrids are found in images", "--detections")
        self.write("detections.csv", "\n".join(rows[:1 + 3 * 48]) + "\n")
        done = fbvins(*arguments)
        self.assertEqual(done.returncode, 1)
        self.assertIn("in 3 images, too few", done.stderr)

    def test_wrong_usage(self):
        self.assertEqual(fbvins().returncode, 2)
        for arguments in (["no-such-command"], ["run"], ["eval", "one"], ["run", "x", "--frontend", "surf"], ["run", "x", "--max-images", "-1"],
                          ["eval", "a", "b", "--align", "se4"], ["run", "x", "--no-such-option"]):
            self.assert_bad_input(fbvins(*arguments))

    def test_input_that_is_not_there(self):
        self.assert_bad_input(fbvins("run", self.folder / "none"), "none")
        self.assert_bad_input(fbvins("info", self.folder / "none"), "none")
        self.assert_bad_input(fbvins("doctor", self.folder / "none"), "none")
        self.assert_bad_input(fbvins("eval", self.folder / "none", self.folder / "none"), "none")
        self.assert_bad_input(fbvins("info", self.folder), str(self.folder))
        self.assert_bad_input(fbvins("report", self.folder), "summary.json")
        self.assert_bad_input(fbvins("bench", self.folder / "none.yaml"), "none.yaml")
        self.assert_bad_input(fbvins("fly", self.folder / "none.yaml"), "none.yaml")
        self.assert_bad_input(fbvins("fly"), "--identify")
        self.assert_bad_input(fbvins("tune", self.folder / "none.ulg"), "none.ulg")
        self.assert_bad_input(fbvins("bench", self.write("m.yaml", "datasets:\n  - {pth: x}\n")), "m.yaml:2: unknown key 'pth'")

    def test_parameters_of_px4(self):
        file = self.folder / "vision.params"
        self.assertEqual(fbvins("px4", "params", "--link", "serial", "-o", file).returncode, 0)
        rows = [line.split("\t") for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        self.assertTrue(all(len(row) == 5 and row[4] in ("6", "9") for row in rows), rows)
        self.assertEqual({row[2]: row[3] for row in rows}["SYS_HAS_MAG"], "0")
        self.assertNotIn("SYS_HAS_MAG", fbvins("px4", "params", "--compass").stdout)
        self.assert_bad_input(fbvins("px4", "check", "udp:nowhere"), "udp:nowhere")
        self.assert_bad_input(fbvins("px4", "check"), "ADDRESS")

    def test_config_round_trip(self):
        first = fbvins("config", "--all", "--yaml").stdout
        again = fbvins("config", "--all", "--yaml", "--config", self.write("c.yaml", first)).stdout
        self.assertEqual(first, again)
        changed = fbvins("config", "--yaml", "--set", "estimator.max_iterations=9").stdout
        self.assertEqual([line for line in changed.splitlines() if line not in first.splitlines()],
                         [line for line in changed.splitlines() if line.startswith("  max_iterations: 9 ")])

    def test_config_mistakes_name_file_and_line(self):
        path = self.write("c.yaml", "frontend:\n  kind: klt\nestimator:\n  max_iteration: 3\n")
        self.assert_bad_input(fbvins("config", "--config", path), f"{path}:4:", "estimator.max_iterations")
        self.assert_bad_input(fbvins("run", "x", "--set", "estimator.max_iterations=many"), "whole number")
        self.assert_bad_input(fbvins("run", "x", "--set", "estimator.max_iterations=0"), "outside")

    def test_every_option_is_explained(self):
        text = fbvins("config").stdout
        everything = fbvins("config", "--all").stdout
        self.assertIn("estimator.max_iterations = ", text)
        self.assertNotIn("estimator.keyframes.leaving", text)
        self.assertIn("estimator.keyframes.leaving = oldest   oldest|entropy", everything)
        self.assertIn("frontend.kind = boost   klt|orb", text)
        self.assertNotIn("\033", text)

    def test_loop_closure(self):
        flight, out = self.folder / "flight", self.folder / "out"
        self.assertEqual(fbvins("simulate", "--out", flight, "--seconds", 3, "--quiet").returncode, 0)
        run = ["run", flight, "--out", out, "--quiet"]
        self.assert_bad_input(fbvins(*run, "--save-map", self.folder / "none" / "a.fbm"), "a.fbm", "there is no folder")
        self.assert_bad_input(fbvins(*run, "--load-map", self.folder / "none.fbm"), "none.fbm")
        self.assert_bad_input(fbvins(*run, "--load-map", self.write("text.fbm", "hello")), "text.fbm", "damaged map")
        self.assert_bad_input(fbvins(*run, "--loop", "--vocabulary", self.write("text.fbv", "hello")), "text.fbv")
        self.assertEqual(fbvins(*run, "--final-ba", "--save-map", self.folder / "a.fbm").returncode, 0)
        in_map = json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]["map"]
        self.assertGreater(in_map["keyframes"], 2)
        self.assertEqual(fbvins("map", "info", self.folder / "a.fbm").returncode, 0)
        self.assertEqual(fbvins(*run, "--load-map", self.folder / "a.fbm", "--save-map", self.folder / "again.fbm").returncode, 0)
        found = json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]["map"]
        self.assertGreater(found["keyframes_in_map"], in_map["keyframes_in_map"])
        self.assertLess(found["keyframes_in_map"], 2 * in_map["keyframes_in_map"])  # what brings nothing is left out
        self.assertLess(found["localised_after_s"], 2.0)
        sessions = [line for line in fbvins("map", "info", self.folder / "again.fbm").stdout.splitlines() if line.startswith("session")]
        self.assertEqual(len(sessions), 2)
        self.assertIn("session 1: 2", sessions[1])  # a date
        forget = ["map", "forget", self.folder / "again.fbm", "-o", self.folder / "before.fbm", "--session"]
        self.assertEqual(fbvins(*forget, 1).returncode, 0)
        difference = json.loads(fbvins("map", "diff", self.folder / "a.fbm", self.folder / "before.fbm", "--json").stdout)
        self.assertEqual(difference["keyframes_only_in_second"], 0)
        self.assertLess(difference["moved_largest_m"], 0.002)
        self.assert_bad_input(fbvins(*forget, 7), "there is no session 7 in the map")

        maps = {name: self.folder / f"{name}.fbm" for name in ("a", "cut", "named", "aligned")}
        self.assertEqual(fbvins("map", "rename", maps["a"], "Hall 3", "-o", maps["named"]).returncode, 0)
        self.assertIn("name: Hall 3", fbvins("map", "info", maps["named"]).stdout)
        corners = ["0,0,0,10,20,0", "4,0,0,10,24,0", "0,3,1,7,20,1"]  # turned by 90 degrees
        done = fbvins("map", "align", maps["named"], "-o", maps["aligned"], "--points", *corners)
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("turned by 90.00 degrees, moved by 10.000, 20.000, 0.000 m", done.stdout)
        hardly = ["0,0,0,-0.0001,0,-0.0001", "4,0,0,3.9999,-0.0001,-0.0001", "0,3,1,-0.0001,3,0.9999"]
        self.assertIn("turned by 0.00 degrees, moved by 0.000, 0.000, 0.000 m; ", fbvins("map", "align", maps["a"], "-o", maps["cut"], "--points", *hardly).stdout)
        self.assert_bad_input(fbvins("map", "align", maps["a"], "-o", maps["cut"], "--points", *corners[:2]), "2 points are given where three are needed")
        self.assert_bad_input(fbvins("map", "cut", maps["a"], "-o", maps["cut"], "--box", "50,50,50,51,51,51"), "none of its")
        self.assertEqual(fbvins("map", "cut", maps["aligned"], "-o", maps["cut"], "--box", "-99,-99,-99,99,99,99").returncode, 0)
        self.assertEqual(json.loads(fbvins("map", "diff", maps["aligned"], maps["cut"], "--json").stdout)["moved_largest_m"], 0)
        moved = json.loads(fbvins("map", "diff", maps["a"], maps["aligned"], "--json").stdout)
        self.assertGreater(moved["moved_rms_m"], 15)
        self.assertAlmostEqual(moved["turned_largest_deg"], 90, delta=1e-3)
        self.assertEqual((moved["keyframes_only_in_first"], moved["keyframes_only_in_second"]), (0, 0))
        boosted = self.folder / "boosted.fbm"
        self.assertEqual(fbvins(*run, "--boosted-map", "--save-map", boosted).returncode, 0)
        self.assertIn("boosted", fbvins("map", "info", boosted).stdout)
        self.assertEqual(fbvins(*run, "--load-map", boosted).returncode, 0)
        words = pathlib.Path(__file__).resolve().parents[1] / "data" / "orb_vocabulary.fbv"
        self.assert_bad_input(fbvins(*run, "--load-map", boosted, "--vocabulary", words), "'orb'", "'boosted'")
        self.assert_bad_input(fbvins("map", "merge", self.folder / "a.fbm", boosted, "-o", self.folder / "c.fbm"), "boosted")

    def test_doctor(self):
        """`doctor` finds nothing wrong with a good recording. It reports an accelerometer in g and exchanged images, and so does `run`."""
        flight = self.folder / "flight"
        self.assertEqual(fbvins("simulate", "--out", flight, "--seconds", 3, "--quiet").returncode, 0)
        done = fbvins("doctor", flight)
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1][:13]), (0, "nothing wrong"), done)
        self.assertIn("measured: ", fbvins("doctor", flight, "--all").stdout)
        readings = flight / "mav0" / "imu0" / "data.csv"
        rows = [row.split(",") for row in readings.read_text(encoding="utf-8").splitlines()]
        readings.write_text("\n".join(",".join(row if row[0].startswith("#") else row[:4] + [str(float(a) / 9.80665) for a in row[4:]])
                                      for row in rows) + "\n", encoding="utf-8")
        kept = self.folder / "kept"
        for what in ("", "sensor.yaml"):  # the folders, and the calibrations back to where they were
            left, right = flight / "mav0" / "cam0" / what, flight / "mav0" / "cam1" / what
            left.rename(kept), right.rename(left), kept.rename(right)
        done = fbvins("doctor", flight, "--json")
        self.assertEqual(done.returncode, 1, done)
        kinds = {finding["kind"] for finding in json.loads(done.stdout)["findings"]}
        self.assertIn("accel_units", kinds)
        self.assertIn("swapped_images", kinds)
        said = fbvins("run", flight, "--out", self.folder / "out", "--quiet").stderr
        self.assertIn("accel_units: ", said)
        self.assertIn("swapped_images: ", said)

    def test_doctor_fix(self):
        """A wrong calibration is corrected, with which the doctor finds nothing; where no calibration helps, nothing is written."""
        flight, fixed = self.folder / "flight", self.folder / "fixed.yaml"
        self.assertEqual(fbvins("simulate", "handheld", "--out", flight, "--seconds", 6, "--quiet").returncode, 0)
        done = fbvins("doctor", flight, "--fix", fixed)
        self.assertEqual(done.returncode, 0, done)
        self.assertIn(f"{fixed} is not written: nothing is wrong", done.stdout)
        readings = flight / "mav0" / "imu0" / "data.csv"
        rows = [row.split(",") for row in readings.read_text(encoding="utf-8").splitlines()]

        def rewrite(change):
            readings.write_text("\n".join(",".join(row if row[0].startswith("#") else change(row)) for row in rows) + "\n", encoding="utf-8")

        rewrite(lambda row: [str(int(row[0]) + 60_000_000), *row[1:]])
        done = fbvins("doctor", flight, "--fix", fixed)
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("time_offset: ", done.stdout)
        self.assertRegex(done.stdout, r"Examined again with it:\n(.*\n)*nothing wrong in ")
        text = fixed.read_text(encoding="utf-8")
        self.assertAlmostEqual(float(re.search(r"timeshift_cam_imu: (\S+)", text)[1]), 0.06, delta=0.001)
        self.assertIn("imu0:\n  accelerometer_noise_density: ", text)
        done = fbvins("doctor", flight, "--calibration", fixed)
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1][:13]), (0, "nothing wrong"), done)
        self.assertEqual(fbvins("run", flight, "--calibration", fixed, "--out", self.folder / "out", "--quiet").returncode, 0)
        self.assert_bad_input(fbvins("doctor", flight, "--calibration", fixed, "--fix", fixed), str(fixed), "another file")
        fixed.unlink()
        rewrite(lambda row: row[:4] + [str(float(a) / 9.80665) for a in row[4:]])
        done = fbvins("doctor", flight, "--fix", fixed, "--json")
        self.assertEqual(done.returncode, 1, done)
        self.assertEqual(json.loads(done.stdout)["fix"]["why_not"], f"{fixed} is not written: nothing of what is wrong can be corrected in a calibration")
        self.assertFalse(fixed.exists())

    def test_mocap(self):
        estimate, quad, wand = [], [], []
        for i in range(1201):
            q, p = tumbling(i / 20)
            estimate.append(f"{1.5e9 + i / 20:.9f} " + " ".join(f"{v:.9f}" for v in (*p, *q[1:], q[0])))
        lever, about_z = (0.03, -0.02, 0.08), (math.sqrt(0.5), 0, 0, math.sqrt(0.5))
        for i in range(8400):  # begins 7 s before the flight, at 120 Hz, in a volume turned by a quarter
            q, p = tumbling(i / 120 - 7)
            p = turned(about_z, [a + b for a, b in zip(p, turned(q, lever))])
            q = times(about_z, q)
            if 4000 <= i < 4060:
                p = (p[0] + 0.8, *p[1:])
            p = [v + 2e-7 * ((i * factor) % 1000 - 500) for v, factor in zip(p, (7919, 6007, 4409))]  # no measurement repeats itself
            numbers = (q[1], q[3], -q[2], q[0], p[0], p[2], -p[1])  # y is up; the same turn of the body's own axes stays with it
            quad.append(",".join(f"{v:.9f}" for v in numbers))
            wand.append("0,0,0,1,1,1,1")
        head = ("Format Version,1.23,Take Name,t,Capture Frame Rate,120,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global\n\n"
                + ",," + ",".join(["Rigid Body"] * 14) + "\n,," + ",".join(["quad"] * 7 + ["wand"] * 7) + "\n,," + ",".join(["1"] * 14) + "\n,,"
                + ",".join((["Rotation"] * 4 + ["Position"] * 3) * 2) + "\nFrame,Time (Seconds)," + ",".join(["X,Y,Z,W,X,Y,Z"] * 2) + "\n")
        take = self.write("take.csv", head + "".join(f"{i},{i / 120:.6f},{a},{b}\n" for i, (a, b) in enumerate(zip(quad, wand))))
        flight = self.write("flight.txt", "\n".join(estimate) + "\n")
        out = self.folder / "measured"
        done = fbvins("mocap", take, flight, "--body", "quad", "--expected", "0,0,0", "--out", out)
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("8400 poses at 120.00 Hz", done.stdout)
        self.assertRegex(done.stdout, r"jump by 0\.\d+ m and \d\.\d degrees, 33\.333 s to 33\.825 s")
        found = [float(v) for v in done.stdout.split("markers on the IMU, m")[1].split()[:3]]
        self.assertLess(math.dist(found, lever), 0.001, done.stdout)
        self.assertIn("1499999993.0000", done.stdout)
        self.assertRegex(done.stdout, r"axial error +-?0\.00[0-3]\d +-?0\.000\d +-?0\.000\d")
        evaluated = fbvins("eval", flight, out / "truth_tum.txt", "--align", "none", "--json")
        self.assertLess(json.loads(evaluated.stdout)["ape_m"]["rmse"], 0.01)

        self.assert_bad_input(fbvins("mocap", take, flight), "'quad', 'wand'")
        self.assert_bad_input(fbvins("mocap", take, flight, "--body", "drone"), "no body 'drone'")
        self.assert_bad_input(fbvins("mocap", take, flight, "--body", "wand"), "both need 8 s")
        self.assert_bad_input(fbvins("mocap", flight, take), "take.csv")
        self.assert_bad_input(fbvins("eval", take, flight, "--hand-eye"), "'quad', 'wand'")

    def test_imu_state(self):
        flight, out, state = self.folder / "flight", self.folder / "out", self.folder / "imu.yaml"
        self.assertEqual(fbvins("simulate", "--out", flight, "--seconds", 2, "--quiet").returncode, 0)
        run = ["run", flight, "--out", out, "--quiet", "--imu-state"]

        def tilt_sigma_at_first_pose():
            return float((out / "gauge.csv").read_text(encoding="utf-8").splitlines()[1].split(",")[-2])

        self.assertEqual(fbvins(*run, state).returncode, 0)  # the first flight: there is no file yet
        unknown = tilt_sigma_at_first_pose()
        state.write_text(state.read_text(encoding="utf-8").replace("accel_bias_covariance: [", "accel_bias_covariance: [1e-4, 0, 0, 1e-4, 0, 1e-4] # "),
                         encoding="utf-8")
        kept = state.read_text(encoding="utf-8")
        self.assertEqual(fbvins(*run, state).returncode, 0)
        self.assertLess(tilt_sigma_at_first_pose(), 0.5 * unknown)
        self.assertNotEqual(state.read_text(encoding="utf-8"), kept)
        self.assert_bad_input(fbvins(*run, self.write("half.yaml", kept[:len(kept) // 2])), "half.yaml")
        self.assert_bad_input(fbvins(*run, self.write("other.yaml", kept.replace("rate_hz: 200", "rate_hz: 400"))), "other.yaml", "another IMU")
        self.assert_bad_input(fbvins(*run, self.folder), str(self.folder))

    def test_imu_state_keeps_the_time_offset(self):
        """Stamps are 30 ms early, which no calibration says; the second flight knows it from its first image on."""
        flight, out, state = self.folder / "flight", self.folder / "out", self.folder / "imu.yaml"
        self.assertEqual(fbvins("simulate", "handheld", "--out", flight, "--seconds", 3, "--set", "camera.time_offset_ms=30", "--quiet").returncode, 0)

        def first_pose_after_s():
            self.assertEqual(fbvins("run", flight, "--out", out, "--quiet", "--imu-state", state).returncode, 0)
            return json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]["coverage"]["first_pose_after_s"]

        unknown = first_pose_after_s()
        kept = state.read_text(encoding="utf-8")
        self.assertAlmostEqual(float(re.search(r"^time_offset_s: (.*)$", kept, re.M)[1]), 0.03, delta=0.002)
        self.assertLess(first_pose_after_s(), unknown - 0.2)
        half = re.sub(r"^time_offset_sigma_s: .*\n", "", kept, flags=re.M)
        self.assert_bad_input(fbvins("run", flight, "--out", out, "--quiet", "--imu-state", self.write("half.yaml", half)), "half.yaml", "time_offset_sigma_s")

    def test_eval(self):
        rows = [f"{1.5e9 + i / 20:.9f} {i * 0.1:.3f} {(i % 7) * 0.1:.3f} {(i % 3) * 0.1:.3f} 0 0 0 1" for i in range(60)]
        truth = self.write("truth.txt", "\n".join(rows) + "\n")
        done = fbvins("eval", truth, truth, "--json")
        self.assertEqual(done.returncode, 0, done)
        self.assertLess(json.loads(done.stdout)["ape_m"]["rmse"], 1e-9)
        self.assertRegex(fbvins("eval", truth, truth).stdout, r"Max\s+Mean\s+Median\s+RMSE\s+Std")
        late = self.write("late.txt", "\n".join("16" + row[2:] for row in rows) + "\n")
        self.assert_bad_input(fbvins("eval", truth, late), "clock")
        self.assert_bad_input(fbvins("eval", truth, self.write("empty.txt", "")), "empty.txt")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)

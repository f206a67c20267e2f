#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `fbvins` reads of recordings that a small writer here makes as people's programs do, and what `fbvins convert` keeps.

usage: recordings.py FBVINS
"""
import json
import math
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROGRAM = sys.argv[1] if __name__ == "__main__" else ""
WIDTH, HEIGHT, FIRST_NS = 80, 60, 1_700_000_000_000_000_000
FRAMES, READINGS = 10, 120
T_BC0 = "[0.0, -1.0, 0.0, -0.02, 1.0, 0.0, 0.0, -0.06, 0.0, 0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 1.0]"
T_BC1 = "[0.0, -1.0, 0.0, -0.02, 1.0, 0.0, 0.0, 0.05, 0.0, 0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 1.0]"


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False)


def png(values, bits=8):
    """Grey; rows of WIDTH values."""
    rows = [values[y * WIDTH:(y + 1) * WIDTH] for y in range(HEIGHT)]
    raw = b"".join(b"\0" + struct.pack(f">{WIDTH}{'H' if bits == 16 else 'B'}", *row) for row in rows)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, bits, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


def picture(number):
    of = random.Random(number)
    return [of.randrange(256) for _ in range(WIDTH * HEIGHT)]


def camera_yaml(number, more=""):
    return (f"sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: {T_BC1 if number else T_BC0}\nrate_hz: 20\nresolution: [{WIDTH}, {HEIGHT}]\n"
            f"camera_model: pinhole\nintrinsics: [{70.5 + number}, 71.25, 40.5, 29.5]\ndistortion_model: radial-tangential\n"
            f"distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n{more}")


def imu_yaml(more=""):
    return ("sensor_type: imu\nrate_hz: 200\ngyroscope_noise_density: 1.0e-3\ngyroscope_random_walk: 3.0e-5\naccelerometer_noise_density: 2.5e-2\n"
            f"accelerometer_random_walk: 4.0e-3\n{more}")


def write(folder, stamps=lambda camera, i: FIRST_NS + 50_000_000 * i, readings=None, image=lambda camera, i: png(picture(10 * i + camera)),
          cameras=(camera_yaml(0), camera_yaml(1)), imu=imu_yaml(), names=lambda stamp: f"{stamp}.png", frames=FRAMES):
    """An EuRoC folder: frames every 50 ms, readings every 5 ms from 50 ms before the first frame on."""
    for camera, yaml in enumerate(cameras):
        own = folder / "mav0" / f"cam{camera}"
        (own / "data").mkdir(parents=True)
        (own / "sensor.yaml").write_text(yaml, encoding="utf-8")
        rows = [stamps(camera, i) for i in range(frames)]
        (own / "data.csv").write_text("#timestamp [ns],filename\n" + "".join(f"{t},{names(t)}\n" for t in rows), encoding="utf-8")
        for i, t in enumerate(rows):
            (own / "data" / f"{t}.png").write_bytes(image(camera, i))
    own = folder / "mav0" / "imu0"
    own.mkdir()
    (own / "sensor.yaml").write_text(imu, encoding="utf-8")
    rows = readings or [FIRST_NS - 50_000_000 + 5_000_000 * i for i in range(READINGS)]
    (own / "data.csv").write_text("#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n" + "".join(
        f"{t},{0.01 * (i % 7)},{0.02 * (i % 5)},0.01,{0.1 * (i % 3)},0.2,{9.8 + 0.01 * (i % 11)}\n" for i, t in enumerate(rows)), encoding="utf-8")
    return folder


class Recordings(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def convert(self, *arguments):
        done = run("convert", *arguments, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr

    def info(self, *arguments):
        done = run("info", *arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), done.stderr


class Conversions(Recordings):
    """Every output, and every way to name its topics, keeps the calibration."""
    NAMES = "/camera/left=/a/left/image,/camera/right=/a/right/image,/imu=/a/imu"
    # Name, what makes it, and of the names of topics with which it is read.
    OUTPUTS = (("folder", ()), ("flight.bag", ()), ("flight.mcap", ()), ("ros2", ("--rosbag2",)),
               ("named.bag", ("--rename", "/cam0/image_raw=/a/left/image,/cam1/image_raw=/a/right/image,/imu0=/a/imu")),
               ("named.mcap", ("--rename", NAMES)), ("named_ros2", ("--rosbag2", "--rename", NAMES)))

    def calibration_of(self, recording, out, *more):
        self.convert(recording, out, *more)
        return {str(path.relative_to(out)): path.read_text(encoding="utf-8") for path in sorted(out.rglob("sensor.yaml")) if "truth" not in path.parent.name}

    def same(self, files, expected):
        """Microseconds and matrices of a folder cost the last of 17 digits."""
        number = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
        self.assertEqual({name: number.sub("N", text) for name, text in files.items()}, {name: number.sub("N", text) for name, text in expected.items()})
        for name, text in files.items():
            for a, b in zip(number.findall(text), number.findall(expected[name])):
                self.assertAlmostEqual(float(a), float(b), delta=1e-12 + 1e-14 * abs(float(b)), msg=name)

    def test_every_output_keeps_the_calibration(self):
        recording = write(self.folder / "own", cameras=(
            camera_yaml(0, "timeshift_cam_imu: 0.03\nline_delay_us: 12.5\nmask_rectangles: [[0, 50, 80, 10]]\n"),
            camera_yaml(1, "timeshift_cam_imu: 0.0315\nline_delay_us: 14.5\n")), imu=imu_yaml(
                "gyroscope_range: 17.5\naccelerometer_range: 78.5\naccelerometers:\n  M:\n  - [1.01, 0.0, 0.0]\n  - [0.002, 0.99, 0.0]\n  - [0.001, 0.003, 1.02]\n"))
        about, _ = self.info(recording)
        self.assertEqual((about["time_offset_s"], about["imu"]["gyro_noise_density_radps_rthz"]), (0.03, 0.001))
        self.assertGreater(about["left"]["masked_share"], 0)
        expected = self.calibration_of(recording, self.folder / "again")
        self.assertEqual(len(expected), 3)
        self.assertIn("78.5", expected["mav0/imu0/sensor.yaml"])
        self.assertIn("line_delay_us: 14.5", expected["mav0/cam1/sensor.yaml"])
        for name, options in self.OUTPUTS:
            with self.subTest(name):
                copy = self.folder / name
                self.convert(recording, copy, *options)
                self.same(self.calibration_of(copy, self.folder / f"{name}_folder"), expected)
                self.assertEqual(self.info(copy)[0]["left"]["images"], FRAMES)
        # From record to bag and back.
        self.convert(self.folder / "flight.mcap", self.folder / "of_record", "--rosbag2", "--start", 0.1)
        self.same(self.calibration_of(self.folder / "of_record", self.folder / "of_record_folder"), expected)

    def test_one_camera_of_a_bag_has_its_own_calibration(self):
        recording = write(self.folder / "own", cameras=(camera_yaml(0, "timeshift_cam_imu: 0.03\n"), camera_yaml(1, "timeshift_cam_imu: 0.04\n")))
        self.convert(recording, self.folder / "ros2", "--rosbag2")
        about, _ = self.info(self.folder / "ros2", "--topics", "/camera/right,/imu")
        self.assertEqual(about["left"]["fx_fy_cx_cy_distortion"][0], 71.5)
        self.assertAlmostEqual(about["time_offset_s"], 0.04, places=12)

    def test_more_than_two_cameras(self):
        recording = write(self.folder / "own", cameras=(camera_yaml(0), camera_yaml(1), camera_yaml(0).replace("-0.06", "0.3"), camera_yaml(1).replace("0.05", "0.6")))
        expected = self.calibration_of(recording, self.folder / "again")
        self.assertEqual(len(expected), 5)
        for name, options in (("ros2", ("--rosbag2",)), ("flight.bag", ())):
            self.convert(recording, self.folder / name, *options)
            self.assertEqual(self.calibration_of(self.folder / name, self.folder / f"{name}_folder"), expected, name)


class Stamps(Recordings):
    def refused(self, name, of):
        readings = [FIRST_NS - 50_000_000 + 5_000_000 * i for i in range(READINGS)]
        recording = write(self.folder / name, readings=[of(t, i) for i, t in enumerate(readings)])
        said = {command: run(command, recording, *(("--out", self.folder / "out") if command == "run" else ())) for command in ("info", "run", "doctor")}
        for done in said.values():
            self.assertEqual((done.returncode, done.stderr), (2, said["info"].stderr))
        return said["info"].stderr

    def test_what_is_wrong_with_stamps_of_readings_is_named(self):
        self.assertIn("105 rows have the stamp of another: what arrives in a block needs a stamp", self.refused("blocks", lambda t, i: t - 5_000_000 * (i % 8)))
        self.assertIn("a factor of 1000: the readings' stamps look like microseconds", self.refused("micro", lambda t, i: t // 1000))
        self.assertIn("a factor of 1000000000: the readings' stamps look like seconds", self.refused("whole", lambda t, i: 1_700_000_000 + i))
        self.assertIn("the clocks are 17999.950 s apart, about 5.00 hours, as local time", self.refused("zone", lambda t, i: t + 18_000_000_000_000))
        self.assertIn("the readings' stamps count from a device's power-on", self.refused("boot", lambda t, i: t - FIRST_NS + 60_000_000_000))

    def test_some_shared_stamps_are_a_warning(self):
        readings = [FIRST_NS - 50_000_000 + 5_000_000 * (i - i % 3 // 2) for i in range(READINGS)]
        _, said = self.info(write(self.folder / "own", readings=readings))
        self.assertIn("40 rows have the stamp of another", said)

    def test_a_late_imu_is_no_other_clock(self):
        frames, late = 120, [FIRST_NS + 3_500_000_000 + 5_000_000 * i for i in range(520)]
        done = run("info", write(self.folder / "late", readings=late, frames=frames))
        self.assertIn("imu_gaps: the readings begin 3.500 s after the first image;", done.stderr)
        apart = [FIRST_NS + 2_500_000_000 + 5_000_000 * i for i in range(1230)]
        done = run("info", write(self.folder / "apart", readings=apart, frames=frames))
        self.assertIn("clocks_apart: the readings begin 2.500 s after the first image and end 2.695 s after the last image", done.stderr)


class Images(Recordings):
    def test_ten_and_twelve_bits_in_pngs_of_sixteen_are_scaled(self):
        """As those of a bag are, with the same warning; sixteen are narrowed, and eight are as they are."""
        def converted(name, image):
            out = self.folder / f"{name}_out"
            said = self.convert(write(self.folder / name, image=image), out)
            return said, [path.read_bytes() for path in sorted(out.rglob("*.png"))]
        _, eight = converted("eight", lambda camera, i: png(picture(10 * i + camera)))
        self.assertEqual(len(eight), 2 * FRAMES)
        for bits in (8, 10, 12, 16):
            with self.subTest(bits):
                said, images = converted(f"of{bits}", lambda camera, i, bits=bits: png([v << (bits - 8) for v in picture(10 * i + camera)], 16))
                sentence = f"images of 16 bits have values of {bits} bits only, and are scaled by {1 << (16 - bits)}"
                self.assertEqual(sentence in said, bits < 16, said)
                self.assertTrue(images == eight or bits == 16)


    def test_names_may_begin_with_the_folder(self):
        for name, of in (("data", "data/{}.png"), ("whole", "mav0/cam0/data/{}.png")):
            about, said = self.info(write(self.folder / name, names=of.format))
            self.assertEqual((about["left"]["images"], about["right"]["missing"], said.count("no such file")), (FRAMES, 0, 0))
        refused = run("info", write(self.folder / "outside", names="/home/me/data/{}.png".format))
        self.assertEqual(refused.returncode, 2, refused.stdout)

    def test_what_is_no_image_and_no_row_is_named(self):
        for found, content in (("BMP", b"BM" + bytes(80)), ("TIFF", b"II*\0" + bytes(80)), ("PGM", b"P5\n2 2\n255\n1234")):
            refused = run("info", write(self.folder / found, image=lambda camera, i, content=content: content))
            self.assertIn(f"{found}, neither PNG nor JPEG: write images as PNG", refused.stderr)
        recording = write(self.folder / "rows")
        path = recording / "mav0/imu0/data.csv"
        rows = path.read_text(encoding="utf-8")
        for separator, name in ((";", "semicolons"), ("\t", "tabs")):
            path.write_text(rows.replace(",", separator), encoding="utf-8")
            self.assertIn(f"1 columns where 7 are needed: they are between {name}, and commas are needed", run("info", recording).stderr)

    def test_images_that_are_stamped_apart(self):
        _, said = self.info(write(self.folder / "own", stamps=lambda camera, i: FIRST_NS + 50_000_000 * i + 20_000_000 * camera))
        self.assertIn("--pair-tolerance says so", said)


class Trajectories(Recordings):
    """Of one flight, written as people's programs write it."""

    def rows(self):
        for i in range(80):
            a = 0.05 * i
            yield FIRST_NS + 50_000_000 * i, (math.cos(a), math.sin(a), 0.01 * i), (math.cos(a / 2), 0.0, 0.0, math.sin(a / 2))

    def compared(self, name, text, *more):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        done = run("eval", self.folder / "truth.txt", path, "--json", *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        result = json.loads(done.stdout)
        self.assertEqual(result["pairs"], 80)
        self.assertLess(result["ape_m"]["max"], 1e-5)
        return result, done.stderr

    def test_what_others_write(self):
        rows = list(self.rows())
        tum = [f"{t / 1e9:.6f} {p[0]:.8f} {p[1]:.8f} {p[2]:.8f} {q[1]:.8f} {q[2]:.8f} {q[3]:.8f} {q[0]:.8f}\n" for t, p, q in rows]
        (self.folder / "truth.txt").write_text("".join(tum), encoding="utf-8")
        ros = ("%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.position.z,"
               "field.pose.pose.orientation.x,field.pose.pose.orientation.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w,field.pose.covariance0\n"
               + "".join(f"{t + 30_000_000},{i},{t},world,{p[0]},{p[1]},{p[2]},{q[1]},{q[2]},{q[3]},{q[0]},0.1\n" for i, (t, p, q) in enumerate(rows)))
        px4 = ("timestamp,timestamp_sample,pose_frame,position[0],position[1],position[2],q[0],q[1],q[2],q[3],velocity[0]\n"
               + "".join(f"{t // 1000 + 30000},{t // 1000},1,{p[0]},{p[1]},{p[2]},{q[0]},{q[1]},{q[2]},{q[3]},0.5\n" for t, p, q in rows))
        german = "t;x;y;z;qx;qy;qz;qw\n" + "".join(row.replace(" ", ";").replace(".", ",") for row in tum)
        swapped = "stamp,qw,qx,qy,qz,z,y,x\n" + "".join(f"{t},{q[0]},{q[1]},{q[2]},{q[3]},{p[2]},{p[1]},{p[0]}\n" for t, p, q in rows)
        mixed = list(tum)
        random.Random(1).shuffle(mixed)
        for name, text, words in (("ros.csv", ros, "columns by their names"), ("px4.csv", px4, "columns by their names"), ("german.csv", german, "decimal commas"),
                                  ("swapped.csv", swapped, "columns by their names"), ("mixed.txt", "".join(mixed), "rows out of order, sorted by their stamps")):
            with self.subTest(name):
                result, said = self.compared(name, text)
                self.assertIn(words, said)
                self.assertEqual(said.count("\n"), 1, said)
                self.assertLess(result["ape_deg"]["max"], 1e-3)
                self.assertTrue(result["orientations_compared"])
        local = ("timestamp,timestamp_sample,ref_timestamp,x,y,z,vx,vy,vz,heading\n"
                 + "".join(f"{t // 1000 + 9},{t // 1000},5,{p[0]},{p[1]},{p[2]},0.1,0.2,0.3,1.5\n" for t, p, _ in rows))
        positions = "".join(" ".join(row.split()[:4]) + "\n" for row in tum)
        for name, text in (("local.csv", local), ("positions.txt", positions), ("positions.csv", positions.replace(" ", ",")), ("zero.txt", positions.replace("\n", " 0 0 0 1\n"))):
            with self.subTest(name):
                result, said = self.compared(name, text)
                self.assertIn("positions without orientations", said)
                self.assertFalse(result["orientations_compared"])
                self.assertEqual(result["ape_deg"]["count"], 0)
        imu = ("%time,field.header.stamp,field.orientation.x,field.orientation.y,field.orientation.z,field.orientation.w,field.angular_velocity.x,field.angular_velocity.y,"
               "field.angular_velocity.z\n" + "".join(f"{t},{t},0,0,0,1,0.1,0.2,0.3\n" for t, _, _ in rows))
        places = "time,lat,lon,alt\n" + "".join(f"{t},{47 + 1e-6 * p[0]},{8 + 1e-6 * p[1]},{p[2]}\n" for t, p, _ in rows)
        for name, text in (("imu.csv", imu), ("places.csv", places)):
            (self.folder / name).write_text(text, encoding="utf-8")
            self.assertEqual(run("eval", self.folder / "truth.txt", self.folder / name).returncode, 2, name)
        self.assertIn("orientations are not compared", run("eval", self.folder / "truth.txt", self.folder / "positions.txt").stdout)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

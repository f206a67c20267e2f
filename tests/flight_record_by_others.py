#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads a flight record with independent programs: `mcap` and `mcap-ros2-support` (PyPI) find every topic, with the index and
without it, in a whole record and in one that is cut off, and every number is the one that was recorded.

usage: flight_record_by_others.py FBVINS [PYTHON]      PYTHON: an interpreter that may have them (./dev test makes one)
exit 77 (skipped) where they are not installed
"""
import contextlib
import csv
import io
import math
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import textwrap
import time
import warnings

try:
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader, make_reader
    from mcap_ros2.decoder import DecoderFactory
except ImportError as missing:
    if len(sys.argv) > 2 and pathlib.Path(sys.argv[2]).exists():
        os.execv(sys.argv[2], [sys.argv[2], __file__, sys.argv[1]])
    print(f"skipped: mcap and mcap-ros2-support are not installed ({missing}); ./dev test installs them where PyPI can be reached")
    sys.exit(77)

TYPES = {"/imu": "sensor_msgs/msg/Imu", "/camera/left": "sensor_msgs/msg/Image", "/camera/right": "sensor_msgs/msg/Image",
         "/camera/left/camera_info": "sensor_msgs/msg/CameraInfo", "/camera/right/camera_info": "sensor_msgs/msg/CameraInfo",
         "/odometry": "nav_msgs/msg/Odometry", "/odometry/live": "nav_msgs/msg/Odometry", "/tf": "tf2_msgs/msg/TFMessage",
         "/tf_static": "tf2_msgs/msg/TFMessage", "/health": "diagnostic_msgs/msg/DiagnosticArray",
         "/landmarks": "sensor_msgs/msg/PointCloud2", "/marks": "rcl_interfaces/msg/Log", "/ground_truth": "geometry_msgs/msg/PoseStamped"}


DOCUMENT = pathlib.Path(__file__).resolve().parents[1] / "docs" / "flight_record.md"


class Failure(Exception):
    pass


def require(fact, sentence):
    if not fact:
        raise Failure(sentence)


def stamp_ns(header):
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def messages(reader, topic=None):
    return [(channel.topic, schema.name, message, decoded)
            for schema, channel, message, decoded in reader.iter_decoded_messages(topics=topic)]


def indexed(record):
    return make_reader(io.BytesIO(record), validate_crcs=True, decoder_factories=[DecoderFactory()])


def rows(path):
    with open(path, encoding="utf-8", newline="") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


def check_summary(record):
    reader = indexed(record)
    require(reader.get_header().profile == "ros2", "the profile is not ros2")
    summary = reader.get_summary()
    require({c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()} == TYPES, "topics or types differ")
    statistics, all_messages = summary.statistics, messages(reader)
    require(statistics.message_count == len(all_messages), "the statistics have another number of messages than the file")
    require(statistics.chunk_count == len(summary.chunk_indexes), "the index does not have all chunks")
    require(statistics.message_start_time == min(m.log_time for _, _, m, _ in all_messages), "the statistics have another start time than the messages")
    attachments = {a.name: a.data.decode() for a in reader.iter_attachments()}
    require(set(attachments) == {"calibration.yaml", "config.yaml"}, f"attachments: {list(attachments)}")
    require("T_BC0:" in attachments["calibration.yaml"] and "frontend:" in attachments["config.yaml"], "attachments are empty")
    about = {m.name: m.metadata for m in reader.iter_metadata()}
    require(about["fbvins"]["images"] == "yes", f"metadata: {about}")


def check_time_window(record):
    """With the index: reads from the middle of the file on."""
    reader = indexed(record)
    statistics = reader.get_summary().statistics
    middle = (statistics.message_start_time + statistics.message_end_time) // 2
    late = [m.log_time for _, _, m in reader.iter_messages(topics="/imu", start_time=middle)]
    require(middle <= late[0] <= middle + 5_000_000, f"the first reading after {middle} is at {late[0]}")
    require(late == sorted(late), "readings found by the index are out of order")


def check_readings(record, flight):
    read = {stamp_ns(m.header): (m.angular_velocity, m.linear_acceleration) for _, _, _, m in messages(indexed(record), "/imu")}
    known = {int(row[0]): [float(v) for v in row[1:7]] for row in rows(flight / "imu0" / "data.csv")}
    require(len(read) > 500, f"{len(read)} readings")
    for stamp, (gyro, accel) in read.items():
        require([gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z] == known[stamp], f"the reading at {stamp} differs")


def check_poses(record, live):
    known = {int(row[0]): [float(v) for v in row[1:8]] for row in rows(live / "trajectory.csv")}
    poses = messages(indexed(record), "/odometry")
    require(len(poses) > 10, f"{len(poses)} poses")
    for _, _, message, m in poses:
        p, q = m.pose.pose.position, m.pose.pose.orientation
        ours = known[stamp_ns(m.header)]
        # The table has nine digits after the decimal point, the record has full precision.
        require(all(abs(a - b) < 1e-8 for a, b in zip([p.x, p.y, p.z, q.w, q.x, q.y, q.z], ours)), f"{m.pose.pose} is not {ours}")
        require(message.log_time == stamp_ns(m.header), "the message's time is not its stamp")
        require(m.header.frame_id == "odom" and m.child_frame_id == "body", "frames have other names")
        require(m.pose.covariance[0] > 0 and m.twist.covariance[35] > 0, "there is no covariance")
    live_poses = messages(indexed(record), "/odometry/live")
    require(len(live_poses) > 5 * len(poses), "there are too few poses at IMU rate")


def check_images(record, flight):
    images = messages(indexed(record), ["/camera/left", "/camera/right"])
    require(len(images) > 50, f"{len(images)} images")
    for topic, _, _, m in images:
        require(m.encoding == "mono8" and m.step == m.width and len(m.data) == m.height * m.width, f"{topic}: {m.encoding}")
        require(m.header.frame_id == topic.strip("/").replace("/", "_"), f"{topic} is in {m.header.frame_id}")
    stamps = {topic: [stamp_ns(m.header) for t, _, _, m in images if t == topic] for topic in ("/camera/left", "/camera/right")}
    require(stamps["/camera/left"] == stamps["/camera/right"], "the stamps of left and right differ")
    known = {int(row[0]) for row in rows(flight / "cam0" / "data.csv")}
    require(set(stamps["/camera/left"]) <= known, "a stamp is not one of the flight")


def check_health(record):
    diagnostics = [status for _, _, _, m in messages(indexed(record), "/health") for status in m.status]
    by_name = {name: [s for s in diagnostics if s.name == name] for name in ("odometry", "live")}
    require(by_name["odometry"] and by_name["live"], f"names: {set(s.name for s in diagnostics)}")
    last = by_name["odometry"][-1]
    values = {v.key: v.value for v in last.values}
    require(values["state"] in ("good", "degraded") and "reset_counter" in values, f"{last}")
    require(int({v.key: v.value for v in by_name["live"][-1].values}["imu"]) > 500, "the counts of the live system are missing")


def check_landmarks(record):
    """One point cloud for each frame: every landmark has a position, every feature a pixel, and many points have both."""
    clouds = [m for _, _, _, m in messages(indexed(record), "/landmarks")]
    bodies = {stamp_ns(m.header): m.pose.pose.position for _, _, _, m in messages(indexed(record), "/odometry")}
    require(len(clouds) >= len(bodies), f"{len(clouds)} clouds for {len(bodies)} poses")
    cloud = next(m for m in reversed(clouds) if stamp_ns(m.header) in bodies)
    require([f.name for f in cloud.fields] == ["x", "y", "z", "track", "u", "v", "age", "depth"], f"fields: {cloud.fields}")
    require(cloud.header.frame_id == "odom" and len(cloud.data) == cloud.width * cloud.point_step == cloud.row_step, "sizes differ")
    points = list(struct.iter_unpack("<3fI4f", bytes(cloud.data)))
    body = bodies[stamp_ns(cloud.header)]
    both = [p for p in points if math.isfinite(p[0]) and math.isfinite(p[4])]
    require(len(both) > 20, f"{len(both)} of {len(points)} landmarks are in the image")
    for x, y, z, _, u, v, age, depth in both:
        require(0 <= u < 752 and 0 <= v < 480 and age >= 0, f"a feature at {u}, {v}, {age} images old")
        require(0 <= depth <= math.dist((x, y, z), (body.x, body.y, body.z)) + 0.5, f"a depth of {depth} m to {x}, {y}, {z}")


def check_broken_off(record):
    """Reads the record as a stream, as recovery tools do, up to the last whole chunk."""
    whole = len(list(NonSeekingReader(io.BytesIO(record), validate_crcs=True).iter_messages(log_time_order=False)))
    last = 0
    for part in (0.2, 0.5, 0.8, 0.99):
        count = 0
        reader = NonSeekingReader(io.BytesIO(record[:int(part * len(record))]), validate_crcs=True)
        try:
            for _ in reader.iter_messages(log_time_order=False):
                count += 1
        except McapError:  # the end of the file is missing
            pass
        require(count > last and count >= whole * (part - 0.2), f"{count} of {whole} messages in {part} of the file")
        last = count


def all_of(record):
    return [(c.topic, m.log_time, bytes(m.data)) for _, c, m in NonSeekingReader(io.BytesIO(record)).iter_messages(log_time_order=False)]


def check_killed(program, flight, root):
    """The record of a program that was killed: read by default, by the snippet of the document, too; `record recover` makes it whole."""
    killed, whole = root / "killed.mcap", root / "recovered.mcap"
    with subprocess.Popen([program, "live", "--source", f"replay:{flight}", "--record", killed, "--quiet"]) as process:
        while process.poll() is None and (not killed.exists() or killed.stat().st_size < 6_000_000):
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    require(process.returncode == -signal.SIGKILL, "the flight ended before it was killed")
    messages_before = all_of(killed.read_bytes())
    with open(killed, "rb") as file:
        require(sum(1 for _ in make_reader(file).iter_messages()) == len(messages_before), "make_reader gives other messages than the stream")
    snippet = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)[1].replace('"flight.mcap"', repr(str(killed)))
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(textwrap.dedent(snippet), {})  # noqa: S102
    require(len(said.getvalue().splitlines()) == sum(topic == "/odometry" for topic, _, _ in messages_before) > 0, "the snippet prints other poses")
    done = subprocess.run([program, "record", "recover", killed, "-o", whole], capture_output=True, text=True, check=False)
    require(done.returncode == 0 and f"{len(messages_before)} messages" in done.stdout, f"{done}")
    check_summary(whole.read_bytes())
    require(all_of(whole.read_bytes()) == messages_before, "recovered messages differ")
    (root / "cut.mcap").write_bytes(killed.read_bytes()[:-1_000_123])  # also a file cut in the middle of a message
    require(subprocess.run([program, "record", "recover", root / "cut.mcap", "-o", root / "cut_whole.mcap"], capture_output=True, check=False).returncode == 0, "cut")
    check_summary((root / "cut_whole.mcap").read_bytes())
    again = subprocess.run([program, "record", "recover", killed, "-o", whole], capture_output=True, text=True, check=False)
    require(again.returncode == 2 and "exists already" in again.stderr, f"{again}")


def check_converted(program, path, root):
    """Outputs stay with a record that is converted."""
    for out in ("copy.mcap", "copy.bag", "copy"):
        subprocess.run([program, "convert", path, root / out, "--quiet"], check=True)
    require(all_of((root / "copy.mcap").read_bytes()) == all_of(path.read_bytes()), "a copy of a record has other messages")
    poses = sum(topic == "/odometry" for topic, _, _ in all_of(path.read_bytes()))
    lines = [line for line in (root / "copy" / "odometry_tum.txt").read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    require(len(lines) == poses, f"{len(lines)} poses in the folder where the record has {poses}")
    done = subprocess.run([program, "eval", root / "copy.bag", root / "copy" / "odometry_tum.txt", "--topic", "/odometry", "--align", "none"],
                          capture_output=True, text=True, check=False)
    require(done.returncode == 0 and f"{poses}" in done.stdout, f"{done}")
    subprocess.run([program, "convert", path, root / "part.mcap", "--quiet", "--start", "1", "--duration", "1"], check=True)
    part = all_of((root / "part.mcap").read_bytes())
    require(0 < sum(topic == "/odometry" for topic, _, _ in part) < poses and "/camera/left" in {topic for topic, _, _ in part}, "a part of a record")


def main():
    program = sys.argv[1]
    warnings.filterwarnings("ignore", category=DeprecationWarning)  # start_time has this name in all versions of mcap
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        flight, live, path = root / "flight", root / "live", root / "flight.mcap"
        subprocess.run([program, "simulate", "normal", "--seconds", "4", "--set", "image_rate_hz=10", "--out", flight, "--quiet"],
                       check=True)
        subprocess.run([program, "live", "--source", f"replay:{flight}", "--record", path, "--out", live, "--quiet"], check=True)
        record = path.read_bytes()
        try:
            check_summary(record)
            check_time_window(record)
            check_readings(record, next(flight.rglob("imu0")).parent)
            check_poses(record, live)
            check_images(record, next(flight.rglob("cam0")).parent)
            check_health(record)
            check_landmarks(record)
            check_broken_off(record)
            check_converted(program, path, root)
            check_killed(program, flight, root)
        except Failure as failure:
            print(failure)
            return 1
    print(f"mcap and mcap-ros2-support read all {len(TYPES)} topics, and every number is the recorded one")
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One flight, written in all bag formats by independent libraries (PyPI rosbags and mcap), gives the same trajectory from each.

usage: bags_by_others.py FBVINS PYTHON      exit 77 (skipped) where PYTHON lacks rosbags or mcap
"""
import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

try:
    import numpy as np
    from bag_writers import (IMAGES, OAK_TOPICS, Flight, kalibr_files, rows, write_librealsense, write_mcap, write_messages_of_depthai,
                             write_ros1, write_ros2, write_split)
    from mcap.writer import CompressionType
    from rosbags import rosbag1, rosbag2
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as lack:
    if len(sys.argv) > 2 and os.path.exists(sys.argv[2]) and not os.environ.get("FBVINS_TRIED"):
        os.environ["FBVINS_TRIED"] = "1"
        os.execv(sys.argv[2], [sys.argv[2], *sys.argv])
    print(f"skipped: {lack.name} is not there; ./dev test installs it (PyPI)")
    sys.exit(77)

CUTS = int(os.environ.get("FBVINS_CUTS", "40"))


def check_what_cannot_be_run(program, folder, root):
    """Each command says why in one sentence and exits with 2. `info` shows a bag all the same where it lacks a calibration or a decision."""
    def refused(arguments, *words):
        done = subprocess.run([program, *map(str, arguments)], check=False, capture_output=True, text=True)
        assert done.returncode == 2 and all(word in done.stderr for word in words), f"{arguments}: {done.returncode} {done.stderr}"

    write_messages_of_depthai(root / "depthai3.mcap")
    for command in ("info", "run"):
        refused([command, root / "depthai3.mcap"], "holds no images in messages of ROS", "left (dai.proto.img_frame.ImgFrame, protobuf)")
    flight = Flight(folder, get_typestore(Stores.ROS1_NOETIC), True)
    write_ros1(root / "tiff.bag", flight, encoding="tiff")
    sentence = "images encoded as 'tiff' cannot be read (none of 8 left images tried can be used)"
    for command in (["info"], ["doctor"], ["run", "--out", root / "none"], ["convert", root / "none"]):
        refused([*command[:1], root / "tiff.bag", *command[1:], "--calibration", folder], sentence)
    assert not (root / "none").exists(), "a folder of results of nothing"
    refused(["info", root / "tiff.bag"], "tiff.bag: /cam0/image_raw: images encoded as 'tiff' cannot be read")
    refused(["run", root / "lz4.bag"], "give one with --calibration")

    done = subprocess.run([program, "info", root / "lz4.bag"], check=False, capture_output=True, text=True)
    assert done.returncode == 0 and "--calibration" in done.stderr, done
    assert "topics to use: cameras /cam0/image_raw, /cam1/image_raw, IMU /imu0" in done.stdout, done.stdout
    assert re.search(r"/cam0/image_raw +40 messages +20.00 Hz  sensor_msgs/Image  \d+ x \d+ mono8", done.stdout), done.stdout
    with rosbag1.Writer(root / "two_rigs.bag") as writer:
        connections = {}
        for stamp, topic, kind, data in flight.messages():
            for name in [topic] if topic == "/imu0" else ["/front" + topic, "/rear" + topic]:
                if name not in connections:
                    connections[name] = writer.add_connection(name, kind, typestore=flight.store)
                writer.write(connections[name], stamp, data)
    question = "has 2 stereo pairs (/front/cam0/image_raw and /front/cam1/image_raw, /rear/cam0/image_raw and /rear/cam1/image_raw): say which are the cameras' with --topics CAM0[,CAM1,...][,IMU][,DEPTH]"
    refused(["run", root / "two_rigs.bag", "--calibration", folder], question)
    shown = subprocess.run([program, "info", root / "two_rigs.bag", "--calibration", folder, "--json"], check=False, capture_output=True, text=True)
    assert shown.returncode == 0 and json.loads(shown.stdout)["question"] == question and len(json.loads(shown.stdout)["topics"]) == 5, shown
    print("what cannot be run is said, and shown")


def check_tum_vi(program, folder, root):
    """No sensor.yaml, but Kalibr's files in dso/."""
    path = root / "tum_vi"
    shutil.copytree(folder, path)
    for camera in ("cam0", "cam1", "imu0"):
        (path / "mav0" / camera / "sensor.yaml").unlink()
    kalibr_files(folder, path / "dso")
    expected = trajectory(program, folder, root / "kalibr", "--calibration", path / "dso" / "camchain.yaml", "--imu-calibration",
                          path / "dso" / "imu_config.yaml")
    assert trajectory(program, path, root / "tum_vi_out") == expected, "TUM-VI: another trajectory than with these calibrations given"
    print("tum_vi: the same bytes")


def check_converted(program, folder, root, expected):
    """Converts to each format and from there to the next; the independent libraries read what was written."""
    steps = [root / "lz4.bag", root / "once.mcap", root / "again.bag", root / "folder"]
    for before, after in zip(steps, steps[1:]):
        arguments = [] if before.name == "once.mcap" else ["--calibration", folder]
        subprocess.run([program, "convert", before, after, "--quiet", *arguments], check=True)
    assert trajectory(program, root / "once.mcap", root / "once_out") == expected, "once.mcap: another trajectory"
    for name in ("again.bag", "folder"):
        assert trajectory(program, root / name, root / "out", "--calibration", folder) == expected, f"{name}: another trajectory"
    own = trajectory(program, root / "again.bag", root / "out")  # by its camera_info and /tf_static, whose rotations are quaternions
    assert own.count(b"good") == expected.count(b"good")
    store = get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Reader(root / "again.bag") as bag:
        assert {c.topic: c.msgcount for c in bag.connections}["/cam0/image_raw"] == IMAGES
        for connection, stamp, data in bag.messages():
            if connection.msgtype not in store.types:
                store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            message = store.deserialize_ros1(data, connection.msgtype)
            if connection.msgtype == "std_msgs/msg/String":
                assert "gyroscope_noise_density" in message.data
                continue
            header = message.transforms[0].header if connection.topic == "/tf_static" else message.header
            assert header.stamp.sec * 10**9 + header.stamp.nanosec == stamp
            assert connection.msgtype != "sensor_msgs/msg/Image" or len(message.data) == message.height * message.step
            assert store.generate_msgdef(connection.msgtype, ros_version=1)[1] == connection.digest, connection.msgtype
    print("converted from bag to MCAP to bag to folder: the same bytes, and rosbags reads the bag")

    bag2, names = root / "bag2", {"/camera/left": "/cam0/image_raw", "/camera/right": "/cam1/image_raw", "/imu": "/imu0"}
    renamed = ",".join(f"{before}={after}" for before, after in names.items())
    subprocess.run([program, "convert", root / "lz4.bag", bag2, "--quiet", "--rosbag2", "--rename", renamed, "--calibration", folder], check=True)
    with AnyReader([bag2]) as bag:
        read = collections.Counter(connection.topic for connection, _, _ in bag.messages())
        assert read == {c.topic: c.msgcount for c in bag.connections if c.msgcount}, read
        assert read["/cam0/image_raw"] == read["/cam1/image_raw"] == read["/cam0/camera_info"] == IMAGES and read["/imu0"] > IMAGES, read
    assert trajectory(program, bag2, root / "out", "--calibration", folder) == expected, "a folder of rosbag2: another trajectory"
    print("converted to a folder of rosbag2 with other names: rosbags reads all of it, and the trajectory is the same")

    def kept(recording):
        about = json.loads(subprocess.run([program, "info", recording, "--json"], check=True, capture_output=True, text=True).stdout)
        return {**{name: round(value, 12) for name, value in about["imu"].items() if "noise" in name or "walk" in name},
                **{name: round(about[name], 9) for name in ("time_offset_s", "baseline_m", "ground_truth_poses")}}
    shifted = root / "shifted"  # with noise and a time offset of its own, and truth
    shutil.copytree(folder, shifted)
    camera, imu = shifted / "mav0" / "cam0" / "sensor.yaml", shifted / "mav0" / "imu0" / "sensor.yaml"
    camera.write_text(camera.read_text() + "timeshift_cam_imu: 0.004\n")
    imu.write_text(re.sub(r"(_(density|random_walk): ).*", r"\g<1>0.0123", imu.read_text()))
    expected, before = kept(shifted), shifted
    assert expected["time_offset_s"] == 0.004 and expected["ground_truth_poses"] > IMAGES and 0.0123 in expected.values(), expected
    for name in ("kept.bag", "kept.mcap", "kept"):
        subprocess.run([program, "convert", before, root / name, "--quiet"], check=True)
        assert kept(root / name) == expected, f"{name}: {kept(root / name)} is not {expected}"
        before = root / name
    print("converted: noise, time offset and truth are kept by bag, record and folder")


def check_parts(program, recordings, folder):
    """One second of each recording, beginning at half a second, has the same images as that second of the folder."""
    def part(recording):
        text = subprocess.run([program, "info", recording, "--calibration", folder, "--start", "0.5", "--duration", "1", "--json"], check=True,
                              capture_output=True, text=True).stdout
        return [json.loads(text)[name] for name in ("frames", "first_image_ns", "last_image_ns")]
    expected = part(folder)
    assert expected[0] == 20, expected
    for recording in recordings:
        assert part(recording) == expected, f"{recording.name}: {part(recording)} is not {expected}"
    print(f"a part of each of {len(recordings)} by time: the same images")


def poses(flight, kind):
    """The folder's truth as messages of ROS 1 or ROS 2."""
    types = flight.types
    for row in rows(flight.folder / "state_groundtruth_estimate0" / "data.csv"):
        stamp, (x, y, z, qw, qx, qy, qz) = int(row[0]), map(float, row[1:8])
        header, q = flight.header(stamp, "world"), types["geometry_msgs/msg/Quaternion"](qx, qy, qz, qw)
        pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](x, y, z), q)
        vector, many = types["geometry_msgs/msg/Vector3"], np.zeros(36)
        if kind == "PoseStamped":
            message = types["geometry_msgs/msg/PoseStamped"](header, pose)
        elif kind == "TransformStamped":
            message = types["geometry_msgs/msg/TransformStamped"](header, "quad", types["geometry_msgs/msg/Transform"](vector(x, y, z), q))
        else:
            twist = types["geometry_msgs/msg/TwistWithCovariance"](types["geometry_msgs/msg/Twist"](vector(0, 0, 0), vector(0, 0, 0)), many)
            message = types["nav_msgs/msg/Odometry"](header, "quad", types["geometry_msgs/msg/PoseWithCovariance"](pose, many), twist)
        yield stamp, message.__msgtype__, flight.pack(message)


def check_eval(program, folder, root):
    """Truth from a topic of poses in a bag gives the same figures as truth from the folder."""
    def figures(truth, *arguments):
        done = subprocess.run([program, "eval", truth, root / "euroc" / "trajectory_tum.txt", "--json", *arguments], check=False,
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return {name: value for name, value in json.loads(done.stdout).items() if name != "coverage"}
    expected = figures(folder)
    for kind in ("PoseStamped", "TransformStamped", "Odometry"):
        for ros1 in (True, False):
            flight = Flight(folder, get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE), ros1)
            path = root / f"{kind}{'.bag' if ros1 else ''}"
            with rosbag1.Writer(path) if ros1 else rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.SQLITE3) as writer:
                connections = {}
                for stamp, name, data in poses(flight, kind):
                    for topic in ("/truth", "/other"):
                        if topic not in connections:
                            connections[topic] = writer.add_connection(topic, name, typestore=flight.store)
                    writer.write(connections["/truth"], stamp, data)
                writer.write(connections["/other"], stamp, data)
            assert figures(path, "--topic", "/truth") == expected, f"{path.name}: other figures than with the folder's truth"
            refused = subprocess.run([program, "eval", path, root / "euroc" / "trajectory_tum.txt"], check=False, capture_output=True, text=True)
            assert refused.returncode == 2 and "/other, /truth: say which with --topic" in refused.stderr, refused.stderr
    print("truth on topics of PoseStamped, TransformStamped, Odometry: the same figures")


def check_live(program, folder, root):
    """A bag played in wall time."""
    for name in ("lz4.bag", "sqlite"):
        out = root / f"live_{name}"
        done = subprocess.run([program, "live", "--source", f"replay:{root / name}@0.5", "--calibration", folder, "--out", out, "--quiet"], check=False,
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        stamps = {row[0] for row in rows(out / "trajectory.csv")}
        assert len(stamps) > IMAGES / 2 and stamps <= {row[0] for row in rows(root / "euroc" / "trajectory.csv")}, len(stamps)
    print("played by fbvins live: lz4.bag, sqlite")


def trajectory(program, recording, out, *arguments):
    done = subprocess.run([program, "run", recording, "--out", out, "--quiet", "--max-images", str(IMAGES), *arguments], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, f"{recording}: {done.stderr}"
    return (out / "trajectory.csv").read_bytes()


def write_all(root, folder):
    """Every recording, by name."""
    one, two = Flight(folder, get_typestore(Stores.ROS1_NOETIC), True), Flight(folder, get_typestore(Stores.ROS2_HUMBLE), False)
    pack, plugin = rosbag1.Writer.CompressionFormat, rosbag2.StoragePlugin
    write_ros1(root / "plain.bag", one)
    write_ros1(root / "bz2.bag", one, pack.BZ2)
    write_ros1(root / "lz4.bag", one, pack.LZ4)
    write_ros1(root / "rgb.bag", one, encoding="rgb8")
    for encoding in ("mono16", "mono12", "rgb16", "uyvy", "nv12"):
        write_ros1(root / f"{encoding}.bag", one, encoding=encoding)
    write_ros1(root / "compressed_images.bag", one, encoding="compressed")
    write_ros1(root / "out_of_order.bag", one, pack.LZ4, late=3_000_000)
    write_librealsense(root / "librealsense.bag", one)
    write_ros2(root / "sqlite", two, plugin.SQLITE3)
    write_ros2(root / "sqlite_packed", two, plugin.SQLITE3, packed=True)
    write_ros2(root / "ros2_mcap", two, plugin.MCAP)
    write_ros2(root / "ros2_mcap_packed", two, plugin.MCAP, packed=True)
    for name in ("sqlite_packed", "ros2_mcap", "ros2_mcap_packed"):  # as a recorder that was killed leaves them
        shutil.copytree(root / name, root / f"{name}_killed")
        (root / f"{name}_killed" / "metadata.yaml").unlink()
    shutil.copy(root / "plain.bag", root / "plain.bag.active")
    write_split(root / "ros2_split", two)
    write_mcap(root / "zstd.mcap", two, compression=CompressionType.ZSTD)
    write_mcap(root / "lz4.mcap", two, compression=CompressionType.LZ4)
    write_mcap(root / "unchunked.mcap", two, compression=CompressionType.NONE, use_chunking=False, use_summary_offsets=False)
    write_mcap(root / "ros1.mcap", one, encoding="ros1", compression=CompressionType.ZSTD)
    for images, name in (("mono8", "oak"), ("compressed", "oak_compressed")):
        write_mcap(root / f"{name}.mcap", one, encoding="ros1", images=images, names=OAK_TOPICS)
    return sorted(p for p in root.iterdir() if p.name not in ("flight", "euroc"))


def check_cuts(program, recording, folder, root):
    """A recording cut off at any byte: the intact part is read, or one sentence says why not."""
    whole, read = recording.read_bytes(), 0
    cut = root / ("cut" + recording.suffix)
    for i in range(CUTS):
        place = int(np.random.default_rng(i).integers(1, len(whole)))
        cut.write_bytes(whole[:place])
        done = subprocess.run([program, "info", cut, "--calibration", folder], check=False, capture_output=True, text=True)
        assert done.returncode in (0, 2), f"{recording.name} cut at {place}: {done.returncode} {done.stderr}"
        assert done.returncode == 0 or len(done.stderr.strip().splitlines()) == 1, done.stderr
        read += done.returncode == 0
    assert read > 0.8 * CUTS, f"{recording.name}: only {read} of {CUTS} beginnings were read"
    print(f"{recording.name}: cut at {CUTS} places, {read} read, the others refused with a sentence")


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        folder = root / "flight"
        subprocess.run([program, "simulate", "fast", "--seconds", "3", "--seed", "5", "--max-images", str(IMAGES), "--out", folder, "--quiet"],
                       check=True)
        expected = trajectory(program, folder, root / "euroc")
        assert expected.count(b"\n") == IMAGES + 1 and b"good" in expected
        recordings = write_all(root, folder)
        for recording in recordings:
            same = trajectory(program, recording, root / "out", "--calibration", folder) == expected
            assert same, f"{recording.name}: another trajectory than from the EuRoC folder"
            print(f"{recording.name}: the same bytes")
        check_what_cannot_be_run(program, folder, root)
        check_parts(program, recordings, folder)
        check_eval(program, folder, root)
        check_live(program, folder, root)
        check_tum_vi(program, folder, root)
        check_converted(program, folder, root, expected)
        for kind in ("lz4.bag", "bz2.bag", "zstd.mcap"):
            check_cuts(program, root / kind, folder, root)
    return 0


if __name__ == "__main__":
    sys.exit(main())

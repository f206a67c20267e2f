#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One flight, written in all bag formats by independent libraries (PyPI rosbags and mcap), gives the same trajectory from each.

usage: bags_by_others.py FBVINS PYTHON      exit 77 (skipped) where PYTHON lacks rosbags or mcap
"""
import csv
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
    from mcap.writer import CompressionType, Writer as McapWriter
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as lack:
    if len(sys.argv) > 2 and os.path.exists(sys.argv[2]) and not os.environ.get("FBVINS_TRIED"):
        os.environ["FBVINS_TRIED"] = "1"
        os.execv(sys.argv[2], [sys.argv[2], *sys.argv])
    print(f"skipped: {lack.name} is not there; ./dev test installs it (PyPI)")
    sys.exit(77)

IMAGES = 40
CUTS = int(os.environ.get("FBVINS_CUTS", "40"))
TOPICS = ("/cam0/image_raw", "/cam1/image_raw")


def rows(path):
    with open(path, encoding="utf-8", newline="") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


class Flight:
    """The contents of the EuRoC folder as messages of ROS 1 or ROS 2."""

    def __init__(self, folder, store, ros1):
        self.folder, self.types, self.ros1 = folder / "mav0", store.types, ros1
        self.store = store

    def header(self, stamp, frame):
        time = self.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        extra = {"seq": 0} if self.ros1 else {}
        return self.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **extra)

    def pack(self, message):
        serialise = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        return bytes(serialise(message, message.__msgtype__))

    def readings(self):
        vector, zero = self.types["geometry_msgs/msg/Vector3"], np.zeros(9)
        for row in rows(self.folder / "imu0" / "data.csv"):
            v = [float(x) for x in row[1:7]]
            message = self.types["sensor_msgs/msg/Imu"](
                header=self.header(int(row[0]), "imu"), orientation=self.types["geometry_msgs/msg/Quaternion"](0, 0, 0, 1),
                orientation_covariance=zero, angular_velocity=vector(*v[:3]), angular_velocity_covariance=zero,
                linear_acceleration=vector(*v[3:]), linear_acceleration_covariance=zero)
            yield int(row[0]), "/imu0", "sensor_msgs/msg/Imu", self.pack(message)

    def images(self, encoding):
        for camera, topic in enumerate(TOPICS):
            for stamp, name in rows(self.folder / f"cam{camera}" / "data.csv")[:IMAGES]:
                file = (self.folder / f"cam{camera}" / "data" / name).read_bytes()
                header = self.header(int(stamp), f"cam{camera}")
                if encoding == "compressed":
                    message = self.types["sensor_msgs/msg/CompressedImage"](header=header, format="png", data=np.frombuffer(file, np.uint8))
                    yield int(stamp), topic + "/compressed", message.__msgtype__, self.pack(message)
                    continue
                pixels = decode(file)
                height, width = pixels.shape
                grey = np.full_like(pixels, 128)
                data, channels = {"mono8": (pixels, 1), "rgb8": (np.repeat(pixels[..., None], 3, 2), 3),
                                  "mono16": (pixels.astype("<u2") * 256 + 17, 2), "mono12": (pixels.astype("<u2") * 16 + 7, 2),
                                  "rgb16": (np.repeat(pixels.astype("<u2")[..., None] * 256 + 9, 3, 2), 6),
                                  "uyvy": (np.stack([grey, pixels], 2), 2), "nv12": (np.vstack([pixels, grey[:height // 2]]), 1),
                                  "tiff": (pixels, 1)}[encoding]
                padding = np.zeros((len(data), 8 if encoding == "mono8" else 0), np.uint8)
                data = np.hstack([np.ascontiguousarray(data).view(np.uint8).reshape(len(data), -1), padding])
                message = self.types["sensor_msgs/msg/Image"](header=header, height=height, width=width,
                                                              encoding="mono16" if encoding == "mono12" else encoding, is_bigendian=0,
                                                              step=data.shape[1], data=data.reshape(-1))
                assert data.shape[1] == width * channels + padding.shape[1]
                yield int(stamp), topic, message.__msgtype__, self.pack(message)

    def messages(self, encoding="mono8"):
        last = int(rows(self.folder / "cam0" / "data.csv")[IMAGES - 1][0]) + 20_000_000
        everything = [m for m in self.readings() if m[0] <= last] + list(self.images(encoding))
        return sorted(everything, key=lambda m: m[0])


def decode(file):
    """Decodes a PNG of FBVINS's simulator (8-bit grey, one filter), so that no imaging library is needed."""
    import struct
    import zlib

    width, height = struct.unpack(">II", file[16:24])
    packed, at = b"", 8
    while at < len(file):
        length, kind = struct.unpack(">I4s", file[at:at + 8])
        packed += file[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, width + 1)
    assert set(lines[:, 0]) <= {0, 1}, "other filters than none and sub"
    return np.where(lines[:, :1] == 1, np.cumsum(lines[:, 1:], axis=1, dtype=np.uint32).astype(np.uint8), lines[:, 1:])


def write_ros1(path, flight, compression=None, encoding="mono8", late=0):
    writer = rosbag1.Writer(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for number, (stamp, topic, kind, data) in enumerate(flight.messages(encoding)):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=flight.store)
            writer.write(connections[topic], stamp + (number * 7919 % 13) * late, data)


def matrices(folder):
    """T_BC0 and T_BC1 of the flight."""
    texts = [(folder / "mav0" / camera / "sensor.yaml").read_text() for camera in ("cam0", "cam1")]
    return [np.array([float(x) for x in re.search(r"data: *\[(.*?)\]", text, re.DOTALL)[1].split(",")]).reshape(4, 4) for text in texts]


def quaternion(R):
    w = np.sqrt(1 + np.trace(R)) / 2
    return (R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w), w


def write_librealsense(path, flight):
    """As librealsense records: gyroscope and accelerometer have separate topics, the stamps of recording begin at zero, no frames
    are named, and a stream's transform converts the left camera's coordinates to its own. Messages that no reader needs are left
    out."""
    types, prefix = flight.types, "/device_0/sensor_"
    topics = {TOPICS[0]: prefix + "0/Infrared_1/image/data", TOPICS[1]: prefix + "0/Infrared_2/image/data"}
    T_BC0, T_BC1 = matrices(flight.folder.parent)
    streams = {prefix + "0/Infrared_1": np.eye(4), prefix + "0/Infrared_2": np.linalg.inv(T_BC1) @ T_BC0, prefix + "2/Gyro_0": T_BC0,
               prefix + "2/Accel_0": T_BC0}
    messages = [(1, f"{stream}/tf/0", types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](*T[:3, 3]),
                 types["geometry_msgs/msg/Quaternion"](*quaternion(T[:3, :3])))) for stream, T in streams.items()]
    everything = flight.messages()
    start = everything[0][0]
    for stamp, topic, kind, data in everything:
        message = flight.store.deserialize_ros1(data, kind)
        message.header.frame_id = "1"
        if topic in topics:
            message.encoding = "8UC1"
            messages.append((stamp - start + 2, topics[topic], message))
            continue
        zero = types["geometry_msgs/msg/Vector3"](0, 0, 0)
        for name, gyro, accel in (("Gyro_0", message.angular_velocity, zero), ("Accel_0", zero, message.linear_acceleration)):
            apart = types["sensor_msgs/msg/Imu"](**{**vars(message), "angular_velocity": gyro, "linear_acceleration": accel})
            messages.append((stamp - start + 2, f"{prefix}2/{name}/imu/data", apart))
    with rosbag1.Writer(path) as writer:
        connections = {}
        for stamp, topic, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=flight.store)
            writer.write(connections[topic], stamp, flight.pack(message))


def write_ros2(path, flight, plugin, packed=False, encoding="mono8", messages=None):
    writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    if packed:
        writer.set_compression(rosbag2.CompressionMode.MESSAGE, rosbag2.CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for stamp, topic, kind, data in messages or flight.messages(encoding):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=flight.store)
            writer.write(connections[topic], stamp, data)


def write_split(path, flight):
    """As rosbag2 splits a recording: several files, listed in their order in the metadata."""
    everything = flight.messages()
    path.mkdir()
    names = []
    for part in range(3):
        messages = everything[part * len(everything) // 3:(part + 1) * len(everything) // 3]
        bag = path.parent / f"{path.name}_part"
        write_ros2(bag, flight, rosbag2.StoragePlugin.MCAP, messages=messages)
        names.append(f"{path.name}_{9 + part}.mcap")  # 9, 10, 11: not in alphabetical order
        next(bag.glob("*.mcap")).rename(path / names[-1])
        metadata = (bag / "metadata.yaml").read_text()
        shutil.rmtree(bag)
    listed = "".join(f"\n  - {name}" for name in names)
    (path / "metadata.yaml").write_text(re.sub(r"(relative_file_paths:)(\n *- .*)+", r"\1" + listed, metadata))


# As McapRecorder of depthai-sdk names what it writes of an OAK: components' names, ROS 1 messages in MCAP.
OAK_TOPICS = dict(zip(TOPICS, ("/left/raw", "/right/raw"))) | {f"{topic}/compressed": f"/{side}/compressed" for topic, side in zip(TOPICS, ("left", "right"))} | {"/imu0": "/imu"}


def write_mcap(path, flight, encoding="cdr", images="mono8", names=None, **options):
    with open(path, "wb") as stream:
        writer = McapWriter(stream, chunk_size=2 << 20, **options)
        writer.start(profile="ros2" if encoding == "cdr" else "ros1")
        channels = {}
        for stamp, topic, kind, data in flight.messages(images):
            topic = topic if names is None else names[topic]
            if topic not in channels:
                name = kind if encoding == "cdr" else kind.replace("/msg/", "/")
                definition = flight.store.generate_msgdef(kind, ros_version=2 if encoding == "cdr" else 1)[0]
                schema = writer.register_schema(name, "ros2msg" if encoding == "cdr" else "ros1msg", definition.encode())
                channels[topic] = writer.register_channel(topic, encoding, schema)
            writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()


def write_messages_of_depthai(path):
    """As depthai 3 does beside its video: schemas of its own."""
    with open(path, "wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="", library="depthai")
        for topic, name in (("left", "dai.proto.img_frame.ImgFrame"), ("imu", "dai.proto.imu_data.IMUData")):
            channel = writer.register_channel(topic, "protobuf", writer.register_schema(name, "protobuf", b""))
            for k in range(20):
                writer.add_message(channel, k * 10**8, b"\x08\x01", k * 10**8)
        writer.finish()


def kalibr_files(folder, path):
    """The flight's calibration as Kalibr writes it."""
    lines = []
    for camera in ("cam0", "cam1"):
        text = (folder / "mav0" / camera / "sensor.yaml").read_text()
        numbers = {name: [float(x) for x in re.search(rf"{name}: *\[(.*?)\]", text, re.DOTALL)[1].split(",")]
                   for name in ("data", "intrinsics", "distortion_coefficients", "resolution")}
        T = np.linalg.inv(np.array(numbers["data"]).reshape(4, 4))
        T[3] = [0, 0, 0, 1]
        lines += [f"{camera}:", "  T_cam_imu:", *(f"  - {list(map(float, row))}" for row in T), "  camera_model: pinhole", "  distortion_model: radtan",
                  f"  distortion_coeffs: {numbers['distortion_coefficients']}", f"  intrinsics: {numbers['intrinsics']}",
                  f"  resolution: {[int(n) for n in numbers['resolution']]}"]
    path.mkdir()
    (path / "camchain.yaml").write_text("\n".join(lines) + "\n")
    imu = (folder / "mav0" / "imu0" / "sensor.yaml").read_text()
    names = {"gyroscope_noise_density": "gyroscope_noise_density", "gyroscope_random_walk": "gyroscope_random_walk",
             "accelerometer_noise_density": "accelerometer_noise_density", "accelerometer_random_walk": "accelerometer_random_walk",
             "rate_hz": "update_rate"}
    (path / "imu_config.yaml").write_text("".join(f"{new}: {re.search(rf'{old}: *([-+.e0-9]+)', imu)[1]}\n" for old, new in names.items()))


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

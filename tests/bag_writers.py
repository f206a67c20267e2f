# SPDX-License-Identifier: Apache-2.0
"""A EuRoC folder written as bags of ROS 1, ROS 2 and MCAP by independent libraries (PyPI rosbags and mcap)."""
import csv
import re
import shutil

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags import rosbag1, rosbag2

IMAGES = 40
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

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins live` in a ROS 2 graph with an independent peer: the Python package of CycloneDDS publishes a flight's images and IMU
readings, and receives what FBVINS publishes; `rosbags` encodes the same values, and the bytes must be the same.

usage: ros2_peer.py FBVINS [PYTHON [--other-dds]]      PYTHON: an interpreter that may have them (./dev test makes one)
--other-dds: the flight's topics by the program that the environment's FBVINS_DDS_PEER names, with another DDS: PEER DOMAIN MESSAGES
RECEIVED TOPIC=TYPE...; `!` after a type: transient local. It publishes MESSAGES on the loopback, at the times of their stamps, says
"published", and writes RECEIVED until SIGTERM. Both files: topic, type (MESSAGES), stamp in ns as 64 bits (MESSAGES), bytes; a text or
bytes begin with their length as 32 bits.
exit 77 (skipped) where cyclonedds and rosbags are not installed, FBVINS was built without CycloneDDS, or no such program is named
"""
import csv
import json
import os
import pathlib
import random
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time

try:
    import numpy as np
    from cyclonedds import builtin, domain, pub, qos, sub
    from mcap.reader import make_reader
    from ros2_dds import DOMAIN, LOOPBACK, STORE, Failure, bytes_topic, reliable, require, taken, wait_until, wire_topic, wire_type, write
    from ruamel.yaml import YAML
except ImportError as missing:
    if len(sys.argv) > 2 and sys.argv[2] and pathlib.Path(sys.argv[2]).exists():
        os.execv(sys.argv[2], [sys.argv[2], __file__, sys.argv[1], "", *sys.argv[3:]])
    print(f"skipped: cyclonedds and rosbags are not installed ({missing}); ./dev test installs them where PyPI can be reached")
    sys.exit(77)

OTHER_DDS = "--other-dds" in sys.argv
IMAGE_RATE_HZ = 30
SECONDS = 8
TYPES = {"/imu": "sensor_msgs/msg/Imu", "/camera/left": "sensor_msgs/msg/Image", "/camera/right": "sensor_msgs/msg/Image",
         "/fbvins/odometry": "nav_msgs/msg/Odometry", "/fbvins/path": "nav_msgs/msg/Path", "/tf": "tf2_msgs/msg/TFMessage",
         "/tf_static": "tf2_msgs/msg/TFMessage", "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
         "/fbvins/camera0/image_raw": "sensor_msgs/msg/Image", "/fbvins/camera0/camera_info": "sensor_msgs/msg/CameraInfo",
         "/fbvins/landmarks": "sensor_msgs/msg/PointCloud2",
         "ros_discovery_info": "rmw_dds_common/msg/ParticipantEntitiesInfo"}
# By ROS's own generator of type descriptions (rosidl 4.6.5), which rosbags does not follow for this type.
GRAPH_HASH = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"
LATCHED = ("/tf_static", "ros_discovery_info")
PUBLISHED = tuple(name for name in TYPES if name not in ("/imu", "/camera/left", "/camera/right"))


class Listener(threading.Thread):
    """Receives everything on the flight's topics, as bytes."""

    def __init__(self, participant, names):
        super().__init__(daemon=True)
        self.readers = {name: sub.DataReader(participant, bytes_topic(participant, wire_topic(name), TYPES[name]), qos=reliable(5000, name in LATCHED)) for name in names}
        self.messages = {name: [] for name in names}
        self.ended = threading.Event()

    def run(self):
        while not self.ended.wait(0.01):
            for name, reader in self.readers.items():
                self.messages[name] += taken(reader)


class InThisProcess:
    """The peer: CycloneDDS for Python."""

    def __init__(self, participant, messages, _folder):
        self.messages, self.participant = messages, participant
        self.listener = Listener(participant, PUBLISHED)
        self.listener.start()

    def publish(self):
        publish(self.participant, self.messages)

    def stop(self):
        self.listener.ended.set()
        self.listener.join()
        return self.listener.messages


class AnotherProgram:
    """The peer: FBVINS_DDS_PEER."""

    def __init__(self, _participant, messages, folder):
        self.received = folder / "received.bin"
        with open(folder / "messages.bin", "wb") as file:
            for name, stamp_ns, data in messages:
                for field in (wire_topic(name).encode(), wire_type(TYPES[name]).encode(), stamp_ns, data):
                    file.write(struct.pack("<q", field) if isinstance(field, int) else struct.pack("<I", len(field)) + field)
        topics = [f"{wire_topic(name)}={wire_type(TYPES[name])}{'!' if name in LATCHED else ''}" for name in PUBLISHED]
        self.program = subprocess.Popen([os.environ["FBVINS_DDS_PEER"], str(DOMAIN), folder / "messages.bin", self.received, *topics], stdout=subprocess.PIPE, text=True)

    def publish(self):
        require("published" in self.program.stdout.readline(), "the other program published nothing")

    def stop(self):
        self.program.terminate()
        self.program.wait(timeout=60)
        messages = {name: [] for name in PUBLISHED}
        names = {wire_topic(name): name for name in PUBLISHED}
        with open(self.received, "rb") as file:
            def field():
                size = file.read(4)
                return file.read(struct.unpack("<I", size)[0]) if size else None
            while (name := field()) is not None:
                messages[names[name.decode()]].append(field())
        return messages


def kalibr_files(flight, folder):
    """The recording's calibration in Kalibr's format."""
    yaml = YAML(typ="safe")

    def load(sensor):
        text = (flight / "mav0" / sensor / "sensor.yaml").read_text(encoding="utf-8")
        return yaml.load("\n".join(line for line in text.splitlines() if not line.startswith("%")))

    chain = {}
    for camera in ("cam0", "cam1"):
        s = load(camera)
        T_BC = np.array(s["T_BS"]["data"], float).reshape(4, 4)
        chain[camera] = {"camera_model": "pinhole", "intrinsics": s["intrinsics"], "distortion_model": "radtan",
                         "distortion_coeffs": s["distortion_coefficients"], "resolution": s["resolution"],
                         "T_cam_imu": np.linalg.inv(T_BC).tolist()}
    s = load("imu0")
    imu = {"imu0": {"rostopic": "/imu", "update_rate": s["rate_hz"], "accelerometer_noise_density": s["accelerometer_noise_density"],
                    "accelerometer_random_walk": s["accelerometer_random_walk"], "gyroscope_noise_density": s["gyroscope_noise_density"],
                    "gyroscope_random_walk": s["gyroscope_random_walk"]}}
    for name, value in (("camchain.yaml", chain), ("imu.yaml", imu)):
        with open(folder / name, "w", encoding="utf-8") as file:
            YAML().dump(value, file)


def messages_of(record):
    """Images and readings of a flight record: topic, stamp in ns, bytes."""
    with open(record, "rb") as file:
        return [(channel.topic, message.log_time, message.data) for _, channel, message in make_reader(file).iter_messages(topics=["/imu", "/camera/left", "/camera/right"])]


def publish(participant, messages):
    """At the times of their stamps."""
    writers = {name: pub.DataWriter(participant, bytes_topic(participant, wire_topic(name), TYPES[name]), qos=reliable(1000)) for name in ("/imu", "/camera/left", "/camera/right")}
    for name, writer in writers.items():
        wait_until(lambda w=writer: len(w.get_matched_subscriptions()) > 0, f"a subscription of {name}")
    time.sleep(0.5)  # FBVINS's readers become reliable ones once they discover these writers
    start, first = time.monotonic(), messages[0][1]
    for name, stamp_ns, data in messages:
        time.sleep(max(0.0, (stamp_ns - first) * 1e-9 - (time.monotonic() - start)))
        write(writers[name], data)


def check_bytes(messages):
    """Decoded and encoded again by rosbags, the messages have the bytes that were sent."""
    for name, all_of_it in messages.items():
        require(all_of_it, f"nothing was received on {name}")
        for data in random.Random(1).sample(all_of_it, min(len(all_of_it), 20 if name.endswith("image_raw") else 200)):
            value = STORE.deserialize_cdr(data, TYPES[name])
            again = bytes(STORE.serialize_cdr(value, TYPES[name]))
            require(again == bytes(data[:len(again)]) and not any(data[len(again):]), f"{name}: other bytes than rosbags writes for the same values")


def check_values(messages, out):
    with open(out / "live_tum.txt", encoding="utf-8") as file:
        poses = {round(float(row[0]) * 1e9): [float(x) for x in row[1:]] for row in csv.reader(file, delimiter=" ") if row[0] != "#"}
    count = 0
    for data in messages["/fbvins/odometry"]:
        m = STORE.deserialize_cdr(data, TYPES["/fbvins/odometry"])
        require((m.header.frame_id, m.child_frame_id) == ("odom", "base_link"), "frames of the odometry")
        p, q = m.pose.pose.position, m.pose.pose.orientation
        stamp = m.header.stamp.sec * 10**9 + m.header.stamp.nanosec
        nearest = min((abs(t - stamp), t) for t in poses)
        require(nearest[0] < 1000, "the pose of an odometry message is in no file")
        require(np.allclose([p.x, p.y, p.z, q.x, q.y, q.z, q.w], poses[nearest[1]], atol=1e-8), "a pose other than in live_tum.txt")
        count += 1
        if count >= 100:
            break
    require(len(messages["/fbvins/odometry"]) >= 0.95 * len(poses), "odometry at IMU rate")
    transforms = STORE.deserialize_cdr(messages["/tf"][-1], TYPES["/tf"]).transforms
    require(("odom", "base_link") in [(t.header.frame_id, t.child_frame_id) for t in transforms], "the transform odom -> base_link")
    fixed = STORE.deserialize_cdr(messages["/tf_static"][-1], TYPES["/tf_static"]).transforms
    require([(t.header.frame_id, t.child_frame_id) for t in fixed] == [("base_link", "imu_link"), ("imu_link", "camera0_optical"), ("imu_link", "camera1_optical")],
            "the fixed transforms")
    status = [STORE.deserialize_cdr(data, TYPES["/diagnostics"]).status[0] for data in messages["/diagnostics"]]
    require(any(s.message == "good" for s in status) and all(any(v.key == "images_dropped" for v in s.values) for s in status), "diagnostics")


def check_images(messages, sent):
    """Those that were sent, with the stamps of their sensors, and points in the frame of the odometry."""
    pixels = {stamp: STORE.deserialize_cdr(data, TYPES["/camera/left"]).data for name, stamp, data in sent if name == "/camera/left"}
    images = [STORE.deserialize_cdr(data, TYPES["/camera/left"]) for data in messages["/fbvins/camera0/image_raw"]]
    for image in images:
        stamp = image.header.stamp.sec * 10**9 + image.header.stamp.nanosec
        require(image.header.frame_id == "camera0_optical" and np.array_equal(image.data, pixels[stamp]), f"the image of {stamp}")
    info = STORE.deserialize_cdr(messages["/fbvins/camera0/camera_info"][-1], TYPES["/fbvins/camera0/camera_info"])
    require((info.width, info.height, info.header) == (images[-1].width, images[-1].height, images[-1].header), "camera_info beside the image")
    points = STORE.deserialize_cdr(messages["/fbvins/landmarks"][-1], TYPES["/fbvins/landmarks"])
    require(points.header.frame_id == "odom" and points.width > 20, "landmarks")


def check_node(messages, hashes):
    """What ROS's tools are told of the node: which topics it has, and the hashes of their types."""
    told = STORE.deserialize_cdr(messages["ros_discovery_info"][-1], TYPES["ros_discovery_info"]).node_entities_info_seq
    require([(n.node_namespace, n.node_name, len(n.reader_gid_seq), len(n.writer_gid_seq)) for n in told] == [("/", "fbvins", 3, len(PUBLISHED) + 1)],
            f"the node as it is told: {told}")
    for name in PUBLISHED:
        said = hashes.get("rt" + name if name.startswith("/") else name)
        wanted = STORE.hash_rihs01(TYPES[name]) if name.startswith("/") else GRAPH_HASH
        require(said == f"typehash={wanted};", f"{name}: the hash of its type is {said}, and not {wanted}")


def type_hashes(participant):
    """Of all publishers that say one, by topic."""
    said = {}
    for endpoint in builtin.BuiltinDataReader(participant, builtin.BuiltinTopicDcpsPublication).take(500):
        text = bytes(endpoint.qos[qos.Policy.Userdata].data).decode() if qos.Policy.Userdata in endpoint.qos else ""
        if "typehash=" in text:
            said[endpoint.topic_name] = text
    return said


def fly(program, folder):
    flight, record, out = folder / "flight", folder / "flight.mcap", folder / "out"
    subprocess.run([program, "simulate", "normal", "--seconds", str(SECONDS), "--seed", "1", "--quiet", "--set", f"image_rate_hz={IMAGE_RATE_HZ}", "--out", flight],
                   check=True, timeout=600)
    subprocess.run([program, "live", "--source", f"replay:{flight}", "--preload", "--quiet", "--record", record], check=True, timeout=600)
    kalibr_files(flight, folder)
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    participant = domain.DomainParticipant(DOMAIN)
    sent = messages_of(record)
    images = sum(name == "/camera/left" for name, _, _ in sent)
    peer = (AnotherProgram if OTHER_DDS else InThisProcess)(participant, sent, folder)
    with open(folder / "log.txt", "w", encoding="utf-8") as log:
        live = subprocess.Popen([program, "live", "--source", "ros2:/camera/left,/camera/right,/imu", "--ros2", str(DOMAIN), "--calibration", folder / "camchain.yaml",
                                 "--imu-calibration", folder / "imu.yaml", "--out", out, "--quiet"], stderr=log)
        try:
            peer.publish()
            time.sleep(1)
            hashes = type_hashes(participant)
            live.send_signal(signal.SIGINT)
            require(live.wait(timeout=60) == 0, "fbvins live failed: " + (folder / "log.txt").read_text(encoding="utf-8"))
        finally:
            live.kill()
    messages = peer.stop()
    said = (folder / "log.txt").read_text(encoding="utf-8")
    require(not said, "it said: " + said)
    counts = json.loads((out / "summary.json").read_text(encoding="utf-8"))["live"]
    require(counts["images"] == images, f"{images} images were sent and {counts['images']} arrived")
    require(counts["images_incomplete"] == 0, f"{counts['images_incomplete']} images arrived without their partner")
    print(f"{images} stereo images at {IMAGE_RATE_HZ} Hz: {counts['images']} arrived, {counts['images_dropped']} dropped; "
          f"{', '.join(f'{len(m)} messages on {name}' for name, m in messages.items())}")
    check_bytes(messages)
    check_values(messages, out)
    check_images(messages, sent)
    check_node(messages, hashes)


def main():
    program = sys.argv[1]
    if OTHER_DDS and not os.environ.get("FBVINS_DDS_PEER"):
        print("skipped: FBVINS_DDS_PEER names no program that speaks another DDS (Fast DDS: docs/ros2.md)")
        return 77
    probe = subprocess.run([program, "live", "--source", "ros2:/a,/b,/c"], capture_output=True, text=True, timeout=60, check=False)
    if "built without CycloneDDS" in probe.stderr:
        print("skipped: the program was built without CycloneDDS")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        try:
            fly(program, pathlib.Path(folder))
        except Failure as failure:
            print(f"FAIL: {failure}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

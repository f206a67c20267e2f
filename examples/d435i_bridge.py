#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a RealSense D435i to `fbvins live --source socket:PATH`, by Intel's Python package (pip install pyrealsense2 numpy).

usage: d435i_bridge.py SOCKET [SERIAL or FILE.bag]    runs until Ctrl-C, or the recording's end; waits for a camera that is unplugged, and
for fbvins, which may start later or anew
"""
import collections
import fcntl
import mmap
import os
import socket
import struct
import sys
import threading
import time

import numpy
import pyrealsense2 as rs

SLOTS = 16
SAME_INSTANT_NS = 2_000_000  # stamps of a pair differ by at most this
LONGEST_WAIT = 4  # images of one camera without any of the other
PATIENCE_S = 2  # of a connection: longer silence or blocking means that it is dead
IMU_NOISE = (2.44e-4, 1.9393e-5, 1.47e-3, 3.0e-3)  # densities from the BMI055's data sheet, random walks assumed (docs/d435i.md)


def rig(left, right, gyro):
    """FbvinsSocketRig (docs/socket.md) with the factory calibration."""
    def camera(profile):
        lens, where = profile.get_intrinsics(), profile.get_extrinsics_to(gyro)
        rotation = numpy.array(where.rotation).reshape(3, 3).T  # librealsense stores it by columns
        pose = numpy.hstack([rotation, numpy.array(where.translation).reshape(3, 1)])
        if lens.coeffs[4] or (any(lens.coeffs) and lens.model != rs.distortion.brown_conrady):
            sys.exit(f"the distortion model {lens.model} is not supported; calibrate with Kalibr")
        return struct.pack("<II20d", 0, 0, lens.fx, lens.fy, lens.ppx, lens.ppy, *lens.coeffs[:4], *pose.flatten())
    return camera(left) + camera(right) + struct.pack("<7d", *IMU_NOISE, gyro.fps(), left.fps(), 0)


def message(kind, body):
    return struct.pack("<II", kind, 8 + len(body)) + body


class StereoPairs:
    """Pairs two cameras' images by their stamps, by the rule of src/fbvins/live/frame_joiner.hpp: an image whose partner is lost leaves
    alone as soon as that is certain."""

    def __init__(self):
        self.waiting, self.pairs, self.alone, self.nearest_ns = (collections.deque(), collections.deque()), 0, 0, None

    def add(self, camera, t_ns, image):
        """camera: 0 left, 1 right. After it, next() until that is None."""
        own = self.waiting[camera]
        if not own or t_ns > own[-1][0]:
            own.append((t_ns, image))

    def next(self):
        """(stamp, left, right), one of the images None where it is lost."""
        left, right = self.waiting
        if left and right and abs(right[0][0] - left[0][0]) <= SAME_INSTANT_NS:
            self.pairs += 1
            return left[0][0], left.popleft()[1], right.popleft()[1]
        for camera, own, other in ((0, left, right), (1, right, left)):
            if own and (own[0][0] < other[0][0] if other else len(own) >= LONGEST_WAIT):
                t_ns, image = own.popleft()
                self.alone += 1
                if other:
                    self.nearest_ns = min(self.nearest_ns or other[0][0] - t_ns, other[0][0] - t_ns)
                return t_ns, *((image, None), (None, image))[camera]
        return None

    def report(self):
        """What is wrong since the last report, or None."""
        pairs, alone, nearest_ns = self.pairs, self.alone, self.nearest_ns
        self.pairs, self.alone, self.nearest_ns = 0, 0, None
        if alone == 0:
            return None
        apart = "" if nearest_ns is None else f"; the other camera's next image was at least {nearest_ns / 1e6:.3f} ms later"
        return f"{alone} images without their partner, {pairs} pairs{apart}"


class Sender:
    """One connection: sends hello, readings and frames; receives which slots are free again."""

    def __init__(self, path, width, height, calibration):
        self.size, self.sequence, self.lock = width * height, 0, threading.Lock()
        memory = os.memfd_create("images", os.MFD_ALLOW_SEALING)
        os.ftruncate(memory, SLOTS * 2 * self.size)
        fcntl.fcntl(memory, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
        self.slots = numpy.frombuffer(mmap.mmap(memory, SLOTS * 2 * self.size), numpy.uint8).reshape(SLOTS, 2, height, width)
        self.free = set(range(SLOTS))
        self.connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            self.connection.setsockopt(socket.SOL_SOCKET, option, struct.pack("ll", PATIENCE_S, 0))
        self.connection.connect(path)
        hello = struct.pack("<8sHHI32s6I", b"fb-vins", 1, 0, 1, b"D435i bridge", width, height, SLOTS, 2 * self.size, self.size, 0)
        socket.send_fds(self.connection, [message(1, hello + calibration)], [memory])
        os.close(memory)
        while self.hear(0) != 65:  # welcome
            pass

    def hear(self, flags=socket.MSG_DONTWAIT):
        """The type of the next message, or None."""
        try:
            said = self.connection.recv(32768, flags)
        except BlockingIOError:
            if flags == 0:
                raise ConnectionError("the estimator does not answer") from None
            return None
        kind = struct.unpack_from("<I", said)[0] if said else 4
        if kind == 4:
            raise ConnectionError(said[16:].split(b"\0")[0].decode() or "the estimator is gone")
        if kind == 66:
            released = struct.unpack_from("<Q", said, 8)[0]
            self.free |= {slot for slot in range(SLOTS) if released >> slot & 1}
        return kind

    def reading(self, t_ns, gyro, accel):
        with self.lock:
            self.connection.send(message(2, struct.pack("<IIq6d", 1, 0, t_ns, *gyro, *accel)))

    def frame(self, t_ns, left, right):
        with self.lock:
            while self.hear() is not None:
                pass
            self.sequence += 1
            if not self.free:
                return  # the gap in `sequence` tells the estimator of the frame
            slot = self.free.pop()
            for camera, image in enumerate((left, right)):
                if image is not None:
                    self.slots[slot, camera] = image
            which = (left is not None) + 2 * (right is not None)
            self.connection.send(message(3, struct.pack("<qQII", t_ns, self.sequence, slot, which)))


class Link:
    """The connection to fbvins, which may start later, end, and start again. Meanwhile images and readings are dropped."""

    def __init__(self, path, *rig_and_size):
        self.path, self.arguments, self.sender, self.dropped, self.told = path, rig_and_size, None, 0, None

    def keep_open(self):
        """Tries once where there is no connection; true: there is one."""
        if self.sender is None:
            try:
                self.sender = Sender(self.path, *self.arguments)
                self.tell(f"connected to {self.path}" + (f", {self.dropped} images were dropped" if self.dropped else ""))
                self.dropped = 0
            except OSError as error:
                self.tell(f"waiting for fbvins at {self.path}: {error}")
        return self.sender is not None

    def tell(self, sentence):
        if sentence != self.told:
            print(sentence, file=sys.stderr, flush=True)
        self.told = sentence

    def send(self, what, *values):
        sender = self.sender
        if sender is None:
            self.dropped += what == "frame"
            return
        try:
            getattr(sender, what)(*values)
        except OSError as error:
            self.sender = None
            sender.connection.close()
            self.tell(f"the connection to {self.path} has ended: {error}")

    def close(self):
        sender, self.sender = self.sender, None
        if sender:
            sender.connection.close()


class Camera:
    """The streams of one device: pairs of images, and the accelerometer's value at every reading of the gyroscope."""

    def __init__(self, device, path):
        self.sensors, chosen = [], {}
        wanted = {("infrared", 1): rs.format.y8, ("infrared", 2): rs.format.y8, ("gyro", 0): rs.format.motion_xyz32f,
                  ("accel", 0): rs.format.motion_xyz32f}
        for sensor in device.query_sensors():
            mine = {}
            for profile in sensor.get_stream_profiles():
                key = (profile.stream_type().name, profile.stream_index() if profile.stream_type() == rs.stream.infrared else 0)
                if wanted.get(key) == profile.format() and self.distance(profile) < self.distance(mine.get(key)):
                    mine[key] = profile.as_video_stream_profile() if key[0] == "infrared" else profile.as_motion_stream_profile()
            for option, value in ((rs.option.emitter_enabled, 0), (rs.option.global_time_enabled, 1), (rs.option.enable_motion_correction, 1)):
                if mine and sensor.supports(option) and not sensor.is_option_read_only(option):
                    sensor.set_option(option, value)
            chosen.update(mine)
            if mine:
                self.sensors.append((sensor, list(mine.values())))
        if chosen.keys() != wanted.keys():
            raise RuntimeError(f"the camera has no {wanted.keys() - chosen.keys()}")
        left, right, gyro = (chosen[key] for key in list(wanted)[:3])
        self.link = Link(path, left.width(), left.height(), rig(left, right, gyro))
        self.pairs, self.accel, self.gyro = StereoPairs(), collections.deque(maxlen=100), collections.deque(maxlen=1000)
        self.lock, self.failure = threading.Lock(), None

    def start(self):
        for sensor, profiles in self.sensors:
            sensor.open(profiles)
            sensor.start(self.take)

    @staticmethod
    def distance(profile):
        """How far a profile is from the wanted one: 640 x 480 at 30 Hz, of an IMU the fastest."""
        if profile is None:
            return float("inf")
        if not profile.is_video_stream_profile():
            return -profile.fps()
        video = profile.as_video_stream_profile()
        return abs(video.width() - 640) + abs(video.height() - 480) + abs(video.fps() - 30)

    def take(self, frame):
        try:
            with self.lock:
                profile, t_ns = frame.get_profile(), round(frame.get_timestamp() * 1e3) * 1000
                if frame.is_video_frame():
                    self.take_image(profile.stream_index(), t_ns, numpy.asanyarray(frame.get_data()).copy())
                elif frame.is_motion_frame():
                    v = frame.as_motion_frame().get_motion_data()
                    (self.gyro if profile.stream_type() == rs.stream.gyro else self.accel).append((t_ns, numpy.array([v.x, v.y, v.z])))
                    self.send_readings()
        except Exception as error:  # else it would be lost in a thread of the library
            self.failure = error

    def take_image(self, camera, t_ns, image):
        self.pairs.add(camera - 1, t_ns, image)
        while frame := self.pairs.next():
            self.link.send("frame", *frame)

    def send_readings(self):
        while self.gyro and len(self.accel) > 1 and self.accel[-1][0] >= self.gyro[0][0]:
            t_ns, rate = self.gyro.popleft()
            while len(self.accel) > 2 and self.accel[1][0] <= t_ns:
                self.accel.popleft()
            (t0, before), (t1, after) = self.accel[0], self.accel[1]
            if t0 <= t_ns <= t1 and t1 - t0 < 50_000_000:
                self.link.send("reading", t_ns, rate, before + (t_ns - t0) / (t1 - t0) * (after - before))

    def report(self):
        with self.lock:
            return self.pairs.report()

    def stop(self):
        for sensor, _ in self.sensors:
            try:
                sensor.stop()
                sensor.close()
            except RuntimeError:  # unplugged
                pass
        self.link.close()


def find(context, which):
    return next((d for d in context.query_devices() if which in ("", d.get_info(rs.camera_info.serial_number))), None)


def main(path, which=""):
    context, recorded = rs.context(), which.endswith(".bag")
    while True:
        device = context.load_device(which) if recorded else find(context, which)
        if device is None:
            time.sleep(0.5)
            continue
        over = threading.Event()
        context.set_devices_changed_callback(lambda event: event.was_removed(device) and over.set())
        if recorded:
            device.set_status_changed_callback(lambda status: status == rs.playback_status.stopped and over.set())
        camera = Camera(device, path)
        while not camera.link.keep_open() and not over.wait(0.5):
            pass
        camera.start()
        next_report_s = 0
        while not over.wait(0.2) and camera.failure is None:
            camera.link.keep_open()
            if time.monotonic() >= next_report_s:
                next_report_s, wrong = time.monotonic() + 5, camera.report()
                if wrong:
                    print(wrong, file=sys.stderr, flush=True)
        camera.stop()
        print(f"the camera's stream has ended: {camera.failure or 'unplugged, or the end of its recording'}", file=sys.stderr)
        if recorded:
            return


if __name__ == "__main__":
    main(*sys.argv[1:])

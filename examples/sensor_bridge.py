# SPDX-License-Identifier: Apache-2.0
"""What the bridges of cameras share: the connection to `fbvins live --source socket:PATH` (docs/socket.md), pairs of images by their
stamps, and one IMU made of a gyroscope and an accelerometer. Needs numpy."""
import collections
import fcntl
import mmap
import os
import re
import socket
import struct
import sys
import threading

import numpy

SLOTS = 16
SAME_INSTANT_NS = 3_000_000  # stamps of a pair differ by at most this, as in recordings
LONGEST_WAIT = 4  # images of one camera without any of the other
PATIENCE_S = 2  # of a connection: longer silence or blocking means that it is dead
LONGEST_STEP_NS = 50_000_000  # between two readings of the accelerometer
RIG_BYTES = 392
RADTAN, EQUIDISTANT = 0, 1  # FbvinsSocketCamera::model


def which_and_mode(arguments):
    """Of a bridge's arguments after the socket, [DEVICE] [WIDTHxHEIGHT[@HZ] or @HZ]: the device, or "", and (width, height, hz), 0 where
    it is not said; None without a mode."""
    rest = list(arguments)
    said = re.fullmatch(r"(?:(\d+)x(\d+))?(?:@(\d+))?", rest[-1]) if rest and rest[-1] else None
    mode = tuple(int(n or 0) for n in said.groups()) if said and rest.pop() else None
    if len(rest) > 1:
        sys.exit(f"too many arguments: {' '.join(arguments)}")
    return rest[0] if rest else "", mode


def camera_bytes(model, focal_px, centre_px, distortion, T_BC):
    """FbvinsSocketCamera; T_BC: three rows of four, or a 4 x 4 matrix."""
    return struct.pack("<II20d", model, 0, *focal_px, *centre_px, *distortion, *numpy.asarray(T_BC, float)[:3].flatten())


def rig_bytes(left, right, imu_noise, imu_hz, image_hz, time_offset_s=0.0):
    """FbvinsSocketRig. imu_noise: gyroscope's density and random walk, then the accelerometer's."""
    return left + right + struct.pack("<7d", *imu_noise, imu_hz, image_hz, time_offset_s)


def message(kind, body):
    return struct.pack("<II", kind, 8 + len(body)) + body


class StereoPairs:
    """Pairs two cameras' images by their stamps, by the rule of src/fbvins/live/frame_joiner.hpp: an image whose partner is lost leaves
    alone as soon as that is certain; a right one that is too far from a left one to be its partner, and nearer than half an interval, is
    dropped."""

    def __init__(self):
        self.waiting, self.pairs, self.alone, self.dropped, self.nearest_ns = (collections.deque(), collections.deque()), 0, 0, 0, None
        self.left_stamps, self.last_left = collections.deque(maxlen=3), None

    def add(self, camera, t_ns, image):
        """camera: 0 left, 1 right. After it, next() until that is None."""
        own = self.waiting[camera]
        if own and t_ns <= own[-1][0]:
            return
        own.append((t_ns, image))
        if camera == 0:
            self.left_stamps.append(t_ns)

    def is_stray(self, t_ns):
        """Whether a right image alone is too near to a left one to be another moment."""
        stamps = list(self.left_stamps)
        interval = min((b - a for a, b in zip(stamps, stamps[1:])), default=0)  # a lost image makes one interval as long as two
        return any(2 * abs(t_ns - left) <= interval for left in (self.last_left, *(t for t, _ in list(self.waiting[0])[:1])) if left is not None)

    def next(self):
        """(stamp, left, right), one of the images None where it is lost."""
        left, right = self.waiting
        if left and right and abs(right[0][0] - left[0][0]) <= SAME_INSTANT_NS:
            self.pairs += 1
            self.last_left = left[0][0]
            return left[0][0], left.popleft()[1], right.popleft()[1]
        for camera, own, other in ((0, left, right), (1, right, left)):
            if own and (own[0][0] < other[0][0] if other else len(own) >= LONGEST_WAIT):
                t_ns, image = own.popleft()
                if other:
                    self.nearest_ns = min(self.nearest_ns or other[0][0] - t_ns, other[0][0] - t_ns)
                if camera == 1 and self.is_stray(t_ns):
                    self.dropped += 1
                    return self.next()
                self.alone += 1
                self.last_left = t_ns if camera == 0 else self.last_left
                return t_ns, *((image, None), (None, image))[camera]
        return None

    def report(self):
        """What is wrong since the last report, or None."""
        pairs, alone, dropped, nearest_ns = self.pairs, self.alone, self.dropped, self.nearest_ns
        self.pairs, self.alone, self.dropped, self.nearest_ns = 0, 0, 0, None
        if alone + dropped == 0:
            return None
        apart = "" if nearest_ns is None else f"; the other camera's next image was at least {nearest_ns / 1e6:.3f} ms later"
        return f"{alone} images without their partner, {dropped} dropped, {pairs} pairs{apart}"


class Sender:
    """One connection: sends hello, readings and frames; receives which slots are free again. Without a calibration (empty) the
    estimator must have one."""

    def __init__(self, path, width, height, calibration, name="sensor bridge"):
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
        hello = struct.pack("<8sHHI32s6I", b"fb-vins", 1, 4, bool(calibration), name.encode(), width, height, SLOTS, 2 * self.size, self.size, 0)
        socket.send_fds(self.connection, [message(1, hello + (calibration or bytes(RIG_BYTES)))], [memory])
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

    def device(self, facts):
        """FbvinsSocketDevice: facts by their keys (docs/socket.md); None is not known."""
        value = {True: "yes", False: "no"}
        lines = (f"{key}={value[fact] if isinstance(fact, bool) else fact}\n" for key, fact in facts.items() if fact is not None)
        with self.lock:
            self.connection.send(message(6, "".join(lines).encode("ascii", "replace")[:2039].ljust(2040, b"\0")))

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
        self.facts = {}

    def keep_open(self):
        """Tries once where there is no connection; true: there is one."""
        if self.sender is None:
            try:
                self.sender = Sender(self.path, *self.arguments)
                self.tell(f"connected to {self.path}" + (f", {self.dropped} images were dropped" if self.dropped else ""))
                self.dropped = 0
                if self.facts:
                    self.send("device", self.facts)
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

    def describe(self, facts):
        """What is known of the device, for `fbvins live --check`; sent when it changes, and with each new connection."""
        if facts != self.facts:
            self.facts = facts
            self.send("device", facts)

    def close(self):
        sender, self.sender = self.sender, None
        if sender:
            sender.connection.close()


class MergedImu:
    """The accelerometer's value at every reading of the gyroscope, between the two around it; where these are too far apart, none."""

    def __init__(self):
        self.accel, self.gyro = collections.deque(maxlen=100), collections.deque(maxlen=1000)

    def add_gyro(self, t_ns, value):
        self.gyro.append((t_ns, value))

    def add_accel(self, t_ns, value):
        self.accel.append((t_ns, numpy.asarray(value, float)))

    def ready(self):
        """Yields (stamp, rate, acceleration)."""
        while self.gyro and len(self.accel) > 1 and self.accel[-1][0] >= self.gyro[0][0]:
            t_ns, rate = self.gyro.popleft()
            while len(self.accel) > 2 and self.accel[1][0] <= t_ns:
                self.accel.popleft()
            (t0, before), (t1, after) = self.accel[0], self.accel[1]
            if t0 <= t_ns <= t1 and t1 - t0 < LONGEST_STEP_NS:
                yield t_ns, rate, before + (t_ns - t0) / (t1 - t0) * (after - before)

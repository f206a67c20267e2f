#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends the IMU of a Stereolabs ZED 2, 2i or Mini to `fbvins live --source v4l2:/dev/video0,socket:PATH`, which takes its images (both
cameras side by side) as those of any video device. By the camera's HID reports, as Stereolabs's zed-open-capture documents them; needs
numpy and access to /dev/hidraw* (packaging/70-fbvins-cameras.rules). Never tried with a device (docs/devices.md).

usage: zed_imu.py SOCKET WIDTHxHEIGHT [/dev/hidrawN]    the size of one image; runs until Ctrl-C; waits for a camera that is unplugged
"""
import collections
import fcntl
import glob
import math
import os
import pathlib
import select
import struct
import sys
import time

from sensor_bridge import Link

VENDOR, ZED_MINI, ZED_2, ZED_2I = "2B03", "F681", "F781", "F881"
REPORT = struct.Struct("<BBQ6h")  # id, not valid, ticks, gyroscope, accelerometer; more follows
REPORT_BYTES = 64
TICK_NS = 39062.5
RADPS, MPS2 = math.radians(1000) / 32768, 8 * 9.8189 / 32768
STREAM, REQUEST, PING = 0x32, 0x21, 0xF2
PING_S, SILENT_S = 1, 2
SLEW = 1e-3  # of the clock's offset: at most a millisecond a second


def feature(device, *bytes_):
    """HIDIOCSFEATURE; a file that is no HID device (tests) has none."""
    try:
        fcntl.ioctl(device, 3 << 30 | len(bytes_) << 16 | ord("H") << 8 | 0x06, bytes(bytes_))
    except OSError as error:
        if error.errno != 25:  # ENOTTY
            raise


class HostClock:
    """The device's stamps on CLOCK_MONOTONIC, on which video devices stamp: the offset is that of the reading that came fastest in the
    last ten seconds, and changes slowly, so that the interval between two readings stays that of the sensor."""

    def __init__(self):
        self.fastest, self.offset_ns, self.last_ns = collections.deque(maxlen=10), None, None

    def stamp(self, device_ns, host_ns):
        second, offset = device_ns // 1_000_000_000, host_ns - device_ns
        if self.fastest and self.fastest[-1][0] == second:
            self.fastest[-1] = (second, min(offset, self.fastest[-1][1]))
        else:
            self.fastest.append((second, offset))
        wanted = min(o for _, o in self.fastest)
        if self.last_ns is None or not 0 < device_ns - self.last_ns < 1_000_000_000:
            self.offset_ns = wanted
        else:
            most = int(SLEW * (device_ns - self.last_ns))
            self.offset_ns += max(-most, min(most, wanted - self.offset_ns))
        self.last_ns = device_ns
        return device_ns + self.offset_ns


def reading(report):
    """(device's time in ns, rate in rad/s, acceleration in m/s^2) of a report; None where it holds none."""
    if len(report) < REPORT.size:
        return None
    kind, not_valid, ticks, *values = REPORT.unpack_from(report)
    if kind not in (0, 1) or not_valid:
        return None
    return round(ticks * TICK_NS), [RADPS * v for v in values[:3]], [MPS2 * v for v in values[3:]]


def find():
    """The first ZED's hidraw device, or None."""
    for path in sorted(glob.glob("/sys/class/hidraw/hidraw*")):
        try:
            told = pathlib.Path(path, "device", "uevent").read_text(encoding="ascii", errors="replace").upper()
        except OSError:
            continue
        if any(f"{VENDOR.zfill(8)}:{product.zfill(8)}" in told for product in (ZED_MINI, ZED_2, ZED_2I)):
            return "/dev/" + pathlib.Path(path).name
    return None


def send(path, link):
    """Until the device is gone or silent."""
    device = os.open(path, os.O_RDWR)
    try:
        feature(device, STREAM, 1)
        clock, next_ping_s = HostClock(), 0
        while select.select([device], [], [], SILENT_S)[0]:
            report = os.read(device, REPORT_BYTES)
            host_ns = time.monotonic_ns()
            if not report:
                return
            if found := reading(report):
                link.send("reading", clock.stamp(found[0], host_ns), found[1], found[2])
            if host_ns >= next_ping_s * 1e9:
                next_ping_s = host_ns / 1e9 + PING_S
                feature(device, REQUEST, PING)  # without it the stream ends
                link.keep_open()
    finally:
        os.close(device)


def main(path, size, device=None):
    width, height = (int(n) for n in size.split("x"))
    link, told = Link(path, width, height, b"", "ZED IMU"), None
    while True:
        link.keep_open()
        try:
            found = device or find()
            if found is None:
                raise FileNotFoundError("no ZED is there")
            send(found, link)
            said = f"{found}: no reading comes"
        except OSError as error:
            said = str(error)
        if said != told:
            print(f"waiting for a ZED: {said}", file=sys.stderr, flush=True)
        told = said
        time.sleep(0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])

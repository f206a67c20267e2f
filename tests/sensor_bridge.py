#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of what the bridges of cameras share (examples/sensor_bridge.py): how images are paired, how readings are merged, and a
connection whose other end starts late, ends and starts again.

usage: sensor_bridge.py [PYTHON]    PYTHON: one that has numpy, when this one has not
"""
import os
import pathlib
import socket
import struct
import sys
import tempfile
import threading

import with_numpy  # noqa: F401  first: another Python may have numpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))
import sensor_bridge as bridge  # noqa: E402

PERIOD_NS = 33_333_000


def given(*images):
    """What leaves for images such as "L1" or "R2.1" (stamps in tens of milliseconds): as in frame_joiner_test.cpp."""
    pairs, out = bridge.StereoPairs(), []
    for image in images:
        pairs.add("LR".index(image[0]), round(float(image[1:]) * 1e7), image)
        while frame := pairs.next():
            t_ns, left, right = frame
            out.append(f"{t_ns // 10_000_000}{'' if right else 'L'}{'' if left else 'R'}")
    return " ".join(out)


def pairing():
    assert given("L1", "R1", "R2", "L2", "L3", "R3.1") == "1 2 3"
    assert given("L1", "L2", "R1", "L3", "R2", "R3") == "1 2 3"
    assert given("L1", "R1", "L2", "L3", "R3", "R4", "L5", "R5") == "1 2L 3 4R 5"
    assert given(*(f"R{k}" for k in range(1, 9)), "L8") == "1R 2R 3R 4R 5R 6R 7R 8"
    assert given("L3", "L2", "L3", "R3") == "3"
    assert given("L1", "R1", "L2", "R2.4", "L3", "R3", "R3.6", "L4", "L5", "R5") == "1 2L 3 4L 5"


def stamps_that_differ():
    """For eight seconds the right camera's stamps are later; nothing may pile up."""
    for apart_ns, wanted_pairs in ((0, 240), (1_200, 240), (-2_900_000, 240), (5_000_000, 0)):
        pairs, got, most = bridge.StereoPairs(), 0, 0
        for k in range(240):
            for camera in (0, 1):
                pairs.add(camera, k * PERIOD_NS + camera * apart_ns, object())
                while frame := pairs.next():
                    got += frame[1] is not None and frame[2] is not None
                most = max(most, sum(len(own) for own in pairs.waiting))
        assert got == wanted_pairs, (apart_ns, got)
        assert most <= 2 * bridge.LONGEST_WAIT, most
        report = pairs.report()
        assert (report is None) == (wanted_pairs > 0), report
        if report:
            assert "5.000 ms later" in report and "240 images without their partner, 23" in report, report


def merging():
    """The accelerometer's value at the gyroscope's stamps; none across a gap."""
    imu = bridge.MergedImu()
    got = []
    for t_ms in range(0, 400, 5):
        if not 100 < t_ms < 200 and t_ms % 10 == 0:
            imu.add_accel(t_ms * 1_000_000, (t_ms, 0, 9.81))
        imu.add_gyro(t_ms * 1_000_000, (0, 0, t_ms))
        got += [(t_ns // 1_000_000, rate[2], accel[0]) for t_ns, rate, accel in imu.ready()]
    assert all(t == rate and abs(t - accel) < 1e-9 for t, rate, accel in got), got
    stamps = [t for t, _, _ in got]
    assert stamps == sorted(stamps) and not any(100 < t < 200 for t in stamps), stamps
    assert len(stamps) > 50, stamps


class Estimator:
    """The other end of the socket: answers hello, and counts what comes."""

    def __init__(self, path):
        self.server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.server.bind(path)
        self.server.listen(1)
        self.kinds = []
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self):
        connection, _ = self.server.accept()
        with connection:
            hello, descriptors, _, _ = socket.recv_fds(connection, 32768, 1)
            for descriptor in descriptors:
                os.close(descriptor)
            assert struct.unpack_from("<I", hello)[0] == 1
            connection.send(struct.pack("<II", 65, 8))
            while len(self.kinds) < 3 and (said := connection.recv(32768)):
                self.kinds.append(struct.unpack_from("<I", said)[0])

    def end(self, path):
        self.thread.join()
        self.server.close()
        os.unlink(path)


def reconnecting():
    with tempfile.TemporaryDirectory() as folder:
        path = str(pathlib.Path(folder, "s"))
        link, image = bridge.Link(path, 8, 6, b""), numpy.zeros((6, 8), numpy.uint8)
        assert not link.keep_open()
        link.send("frame", 0, image, image)
        assert link.dropped == 1
        for _ in range(2):
            estimator = Estimator(path)
            assert link.keep_open()
            link.send("reading", 1, (0, 0, 0), (0, 0, 9.81))
            link.send("frame", 2, image, None)
            link.send("frame", 3, image, image)
            estimator.end(path)
            assert estimator.kinds == [2, 3, 3], estimator.kinds
            link.send("frame", 4, image, image)
            assert not link.keep_open()
        link.close()


def arguments():
    for said, wanted in (((), ("", None)), (("123",), ("123", None)), (("848x480@60",), ("", (848, 480, 60))), (("123", "848x480"), ("123", (848, 480, 0))),
                         (("a.bag", "@20"), ("a.bag", (0, 0, 20)))):
        assert bridge.which_and_mode(said) == wanted, (said, bridge.which_and_mode(said))
    try:
        bridge.which_and_mode(("123", "456"))
    except SystemExit as error:
        assert "too many" in str(error)
    else:
        raise AssertionError("two devices")


if __name__ == "__main__":
    for test in (pairing, stamps_that_differ, merging, reconnecting, arguments):
        test()
        print(f"ok {test.__name__}")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of examples/orbbec_bridge.py and examples/zed_imu.py without a device: rig and messages by stand-ins for Orbbec's package, or by
its own calibration structures where that is installed; reports of a ZED by a pipe.

usage: other_bridges.py [PYTHON]    PYTHON: one that has numpy, when this one has not; FBVINS_ORBBEC names one that has pyorbbecsdk, too
"""
import os
import pathlib
import struct
import sys
import threading
import types

import with_numpy  # noqa: F401  first: another Python may have numpy
import numpy

try:
    import pyorbbecsdk as ob
except ImportError:
    other = os.environ.get("FBVINS_ORBBEC")
    if other and other != sys.executable:
        os.execv(other, [other, sys.argv[0]])
    ob = sys.modules["pyorbbecsdk"] = types.ModuleType("pyorbbecsdk")
    ob.OBCameraDistortionModel = types.SimpleNamespace(BROWN_CONRADY=2, BROWN_CONRADY_K6=4, INVERSE_BROWN_CONRADY=3, KANNALA_BRANDT4=5)
    ob.OBPropertyID = types.SimpleNamespace(OB_PROP_LASER_CONTROL_INT=1, OB_PROP_LASER_BOOL=2, OB_PROP_IR_AE_MAX_EXPOSURE_INT=3)
    ob.OBPermissionType = types.SimpleNamespace(PERMISSION_WRITE=2)
    ob.OBCameraIntrinsic = ob.OBCameraDistortion = ob.OBExtrinsic = types.SimpleNamespace

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))
import orbbec_bridge  # noqa: E402
import zed_imu  # noqa: E402

R_BC = numpy.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def filled(made, **values):
    for name, value in values.items():
        try:
            setattr(made, name, value)
        except AttributeError:  # the library's own structure has read-only arrays
            return types.SimpleNamespace(**values)
    return made


def profile(x_mm, distortion=(0.0,) * 8, model=None):
    model = ob.OBCameraDistortionModel.BROWN_CONRADY if model is None else model
    d = filled(ob.OBCameraDistortion(), model=model, **dict(zip(("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), distortion)))
    i = filled(ob.OBCameraIntrinsic(), fx=420.0, fy=421.0, cx=322.0, cy=239.0, width=640, height=480)
    where = filled(ob.OBExtrinsic(), rot=R_BC, transform=[x_mm, 5.0, -2.0])
    return types.SimpleNamespace(get_intrinsic=lambda: i, get_distortion=lambda: d, get_extrinsic_to=lambda gyro: where, get_width=lambda: 640,
                                 get_height=lambda: 480, get_fps=lambda: 30)


def orbbec_rig():
    body = orbbec_bridge.rig(profile(10), profile(60), None)
    assert len(body) == 392
    for camera, x_m in ((0, 0.01), (168, 0.06)):
        model, _, *values = struct.unpack_from("<II20d", body, camera)
        assert model == 0 and values[:8] == [420, 421, 322, 239, 0, 0, 0, 0], values
        assert numpy.allclose(numpy.array(values[8:]).reshape(3, 4), numpy.hstack([R_BC, [[x_m], [0.005], [-0.002]]])), values
    assert struct.unpack_from("<7d", body, 336)[4:] == (200, 30, 0)
    bent = orbbec_bridge.lens(profile(0, (0.1, -0.05, 0.001, 0, 0, 0, 0, 0)))
    assert bent[0] == 0 and numpy.allclose(bent[1], [420, 421, 322, 239, 0.1, -0.05, 0.001, 0]), bent
    model, values = orbbec_bridge.lens(profile(0, (1.9, -3.1, 0.0004, -0.0003, 5.0, 1.6, -2.4, 4.6), ob.OBCameraDistortionModel.BROWN_CONRADY_K6))
    assert model == 1 and abs(values[0] - 420) < 25, values


def orbbec_streams():
    sent = []
    streams = orbbec_bridge.Streams(types.SimpleNamespace(send=lambda *message: sent.append(message)), True)

    def frame(t_us, **more):
        return types.SimpleNamespace(get_global_timestamp_us=lambda: t_us, get_timestamp_us=lambda: 0, **more)

    def image(t_us, grey):
        return frame(t_us, get_data=lambda: bytes([grey]) * 12, get_height=lambda: 3, get_width=lambda: 4)

    def motion(t_us, x):
        return frame(t_us, get_x=lambda: x, get_y=lambda: 0.0, get_z=lambda: 9.81)

    def come(left=None, right=None, accel=None, gyro=None):
        streams.take(types.SimpleNamespace(get_left_ir_frame=lambda: left, get_right_ir_frame=lambda: right, get_accel_frame=lambda: accel,
                                           get_gyro_frame=lambda: gyro))
    for k in range(3):
        come(right=image(1_000_000 + 33_000 * k + 40, 10 * k + 1))
        come(left=image(1_000_000 + 33_000 * k, 10 * k))
    for k in range(20):
        come(accel=motion(1_000_000 + 5000 * k, 1.0), gyro=motion(1_000_000 + 5000 * k + 100, 2.0))
    assert streams.failure is None, streams.failure
    frames = [m for m in sent if m[0] == "frame"]
    assert [(f[1], f[2][0, 0], f[3][2, 3]) for f in frames] == [(1_000_000_000 + k * 33_000_000, 10 * k, 10 * k + 1) for k in range(3)], frames
    readings = [m for m in sent if m[0] == "reading"]
    assert len(readings) >= 18 and all(m[2][0] == 2.0 and m[3][0] == 1.0 for m in readings), len(readings)


def orbbec_settings():
    done = {}
    device = types.SimpleNamespace(set_int_property=done.__setitem__, set_bool_property=done.__setitem__, is_property_supported=lambda p, _: True,
                                   get_device_info=lambda: types.SimpleNamespace(get_name=lambda: "Gemini 335", get_firmware_version=lambda: "1.4.60",
                                                                                 get_connection_type=lambda: "USB3.2"))
    assert orbbec_bridge.settle(device) == {"emitter": "off", "longest_exposure_ms": 8.0}
    id_ = ob.OBPropertyID
    assert done == {id_.OB_PROP_LASER_CONTROL_INT: 0, id_.OB_PROP_IR_AE_MAX_EXPOSURE_INT: 8000}, done
    assert orbbec_bridge.facts(device, (640, 480, 30), False)["usb"] == "3.2"
    device.is_property_supported = lambda p, _: False
    assert orbbec_bridge.settle(device) == {"emitter": "unknown", "longest_exposure_ms": None}


def report(ticks, gyro, accel, not_valid=0):
    return struct.pack("<BBQ6h", 1, not_valid, ticks, *gyro, *accel).ljust(64, b"\0")


def zed_reports():
    t_ns, rate, accel = zed_imu.reading(report(25_600, (32767, 0, -16384), (0, 4096, -32768)))
    assert t_ns == 1_000_000_000
    assert numpy.allclose(rate, [17.4527, 0, -8.72665], atol=1e-3) and numpy.allclose(accel, [0, 9.8189, -78.5512], atol=1e-4), (rate, accel)
    assert zed_imu.reading(report(1, (0,) * 3, (0,) * 3, not_valid=1)) is None
    assert zed_imu.reading(b"\1\0short") is None


def zed_clock():
    """The device's clock runs 50 ppm fast and 7 s ahead; reports come 0.5 to 4.5 ms late."""
    rng, clock, worst_ns, steps = numpy.random.default_rng(1), zed_imu.HostClock(), 0, []
    last = None
    for k in range(24_000):
        true_ns = 2_500_000 * k
        stamp = clock.stamp(round(7e9 + true_ns * (1 + 50e-6)), true_ns + 500_000 + round(4e6 * rng.random()))
        if k > 2000:  # the first one may have been slow
            worst_ns = max(worst_ns, abs(stamp - true_ns - 500_000))
            steps.append(stamp - last)
        last = stamp
    assert worst_ns < 700_000, worst_ns
    assert abs(numpy.array(steps) - 2_500_000).max() < 5_000, "the interval is the sensor's"


def zed_stream():
    sent, (out, into) = [], os.pipe()
    link = types.SimpleNamespace(send=lambda *message: sent.append(message), keep_open=lambda: True)
    path = f"/proc/self/fd/{out}"
    writer = threading.Thread(target=lambda: [os.write(into, report(64 * k, (k, 0, 0), (0, 0, 4096))) for k in range(100)] and os.close(into))
    writer.start()
    fifo, zed_imu.SILENT_S = os.open, 0.5
    zed_imu.os.open = lambda name, flags: os.dup(out) if name == path else fifo(name, flags)
    try:
        zed_imu.send(path, link)
    finally:
        zed_imu.os.open = fifo
        writer.join()
        os.close(out)
    assert len(sent) == 100 and sent[0][0] == "reading"
    steps = {b[1] - a[1] for a, b in zip(sent, sent[1:])}
    assert all(abs(step - 2_500_000) <= 2_501 for step in steps), steps


if __name__ == "__main__":
    for test in (orbbec_rig, orbbec_streams, orbbec_settings, zed_reports, zed_clock, zed_stream):
        test()
        print(f"ok {test.__name__}")

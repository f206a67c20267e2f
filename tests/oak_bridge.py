#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of examples/oak_bridge.py without a device: the lens that it fits to the device's, and, where Luxonis's package is installed,
the rig that it makes of a calibration in that package's own form, and images and readings in its messages.

usage: oak_bridge.py [PYTHON]    PYTHON: one that has numpy, when this one has not; FBVINS_DEPTHAI names one that has depthai, too
"""
import os
import pathlib
import struct
import sys
import types

import with_numpy  # noqa: F401  first: another Python may have numpy
import numpy

try:
    import depthai as dai
except ImportError:
    other = os.environ.get("FBVINS_DEPTHAI")
    if other and other != sys.executable:
        os.execv(other, [other, sys.argv[0]])
    dai = None
    sockets = types.SimpleNamespace(CAM_B="B", CAM_C="C")
    sys.modules["depthai"] = types.ModuleType("depthai")
    sys.modules["depthai"].CameraBoardSocket = sockets

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))
import lens_fit  # noqa: E402
import oak_bridge as bridge  # noqa: E402

K = numpy.array([[399.0, 0, 322.5], [0, 398.5, 201.3], [0, 0, 1]])
RATIONAL = [1.9, -3.1, 0.0004, -0.0003, 5.0, 1.6, -2.4, 4.6, 0.0001, -0.0001, 0.0002, 0.0001, 0.0, 0.0]
PLAIN = [0.0] * 14
BASELINE_M = 0.075


def lens():
    """A rational lens and a straight one, by the equidistant one within a fraction of a pixel."""
    for k in (RATIONAL, PLAIN):
        rays, pixels = lens_fit.rays_in_view(K, k, bridge.WIDTH, bridge.HEIGHT)
        assert pixels[:, 0].min() < 25 and pixels[:, 0].max() > 615 and pixels[:, 1].min() < 25 and pixels[:, 1].max() > 375
        fitted, error_px = lens_fit.fitted_equidistant(K, k, bridge.WIDTH, bridge.HEIGHT)
        assert error_px < 0.2, (k, error_px)
        apart = numpy.hypot(*(lens_fit.equidistant_pixels(fitted, rays) - pixels).T)
        assert apart.max() < 1, apart.max()
        print(f"  lens of {sum(c != 0 for c in k)} coefficients: {error_px:.3f} px, at most {apart.max():.2f}")
    beyond = [-0.9] + [0.0] * 13  # turns back within the image: what lies beyond is left out
    rays, _ = lens_fit.rays_in_view(K, beyond, bridge.WIDTH, bridge.HEIGHT)
    assert numpy.hypot(*rays.T).max() < 0.62, numpy.hypot(*rays.T).max()


def calibration():
    """The library's calibration of two cameras, the IMU 2 cm ahead of the left one, its axes turned."""
    handler = dai.CalibrationHandler()
    left, right = bridge.CAMERAS
    eye = numpy.eye(3).tolist()
    for which in (left, right):
        handler.setCameraIntrinsics(which, (numpy.diag([2, 2, 1]) @ K).tolist(), dai.Size2f(1280, 800))
        handler.setDistortionCoefficients(which, RATIONAL)
        handler.setCameraType(which, dai.CameraModel.Perspective)
    handler.setCameraExtrinsics(right, left, eye, [100 * BASELINE_M, 0, 0])
    handler.setImuExtrinsics(left, R_CI.tolist(), [0, 0, 2.0])
    return handler


R_CI = numpy.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])


def rig():
    """T_BC from the calibration in the library's own form: p_C = R_CI p_I + (0, 0, 2 cm)."""
    body = bridge.rig(calibration(), 30)
    assert len(body) == 392
    T = []
    for camera in (0, 168):
        model, _, *values = struct.unpack_from("<II20d", body, camera)
        assert model == 1 and abs(values[0] - 399) < 20 and abs(values[2] - 322.5) < 3, values
        T.append(numpy.array(values[8:]).reshape(3, 4))
    for k in (0, 1):
        assert numpy.allclose(T[k][:, :3], R_CI.T, atol=1e-6), T[k]
    assert numpy.allclose(T[0][:, 3], R_CI.T @ [0, 0, -0.02], atol=1e-6), T[0]
    apart = R_CI @ (T[1][:, 3] - T[0][:, 3])
    assert numpy.allclose(apart, [BASELINE_M, 0, 0], atol=1e-6), apart
    assert struct.unpack_from("<7d", body, 336)[4:] == (200, 30, 0)


def streams():
    """The library's messages in, frames and readings out."""
    sent = []
    flow = bridge.Streams(types.SimpleNamespace(send=lambda *message: sent.append(message)))
    at = lambda ns: types.SimpleNamespace(total_seconds=lambda: ns * 1e-9)  # noqa: E731
    for k in range(3):
        for number in (1, 0):
            image = numpy.full((bridge.HEIGHT, bridge.WIDTH), 10 * k + number, numpy.uint8)
            stamp = 1_000_000_000 + k * 33_000_000 + number * 40_000
            flow.take_image(number, types.SimpleNamespace(getTimestamp=lambda _, s=stamp: at(s), getFrame=lambda i=image: i))
    for k in range(20):
        axis = lambda x, t=1_000_000_000 + k * 5_000_000: types.SimpleNamespace(x=x, y=0.0, z=9.81, getTimestamp=lambda: at(t))  # noqa: E731
        flow.take_motion(types.SimpleNamespace(acceleroMeter=axis(1.0), gyroscope=axis(2.0)))
    frames = [m for m in sent if m[0] == "frame"]
    assert [(f[1], f[2][0, 0], f[3][0, 0]) for f in frames] == [(1_000_000_000 + k * 33_000_000, 10 * k, 10 * k + 1) for k in range(3)]
    readings = [m for m in sent if m[0] == "reading"]
    assert len(readings) >= 18 and all(m[2][0] == 2.0 and m[3][0] == 1.0 for m in readings), len(readings)


if __name__ == "__main__":
    tests = (lens, rig, streams) if dai else (lens,)
    for test in tests:
        test()
        print(f"ok {test.__name__}")
    if not dai:
        print("depthai is not installed: calibration and messages were left out; FBVINS_DEPTHAI may name a Python that has it")

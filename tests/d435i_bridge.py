#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs examples/d435i_bridge.py between librealsense's software device and `fbvins live`, in wall time (30 s): there are poses, also
after the camera was unplugged and plugged in again; `--check` says what the device is, and what to do; streams that stop are started again;
`--source d435i` starts the bridge by itself.

usage: d435i_bridge.py FBVINS    skipped (77) where Python has no pyrealsense2; FBVINS_REALSENSE names a Python that has
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

try:
    import numpy
    import pyrealsense2 as rs
except ImportError:
    other = os.environ.get("FBVINS_REALSENSE")
    if other and other != sys.executable:
        os.execv(other, [other, *sys.argv])
    print("SKIPPED: pyrealsense2 and numpy are not installed; FBVINS_REALSENSE may name a Python that has them")
    sys.exit(77)

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"
sys.path.insert(0, str(EXAMPLES))
import d435i_bridge  # noqa: E402
import socket_sender as world  # noqa: E402  a wall, and cameras that sway in front of it


class SoftwareCamera:
    """As it comes out of its box: at a port of USB 2, with an old firmware and no calibration of its IMU."""

    def __init__(self):
        self.device = rs.software_device()
        for key, value in ((rs.camera_info.name, "Intel RealSense D435I"), (rs.camera_info.serial_number, "123456"),
                           (rs.camera_info.firmware_version, "5.12.7.100"), (rs.camera_info.recommended_firmware_version, "5.16.0.1"),
                           (rs.camera_info.usb_type_descriptor, "2.1"), (rs.camera_info.physical_port, "2-1-3")):
            self.device.register_info(key, value)
        self.stereo, self.motion = self.device.add_sensor("Stereo Module"), self.device.add_sensor("Motion Module")
        for option, value in ((rs.option.emitter_enabled, 1), (rs.option.enable_auto_exposure, 1), (rs.option.auto_exposure_limit, 33000),
                              (rs.option.auto_exposure_limit_toggle, 0)):
            span = rs.option_range()
            span.min, span.max, span.step, span.default = 0, 200000, 1, value
            self.stereo.add_option(option, span)
        self.stereo.set_metadata(rs.frame_metadata_value.actual_exposure, 4500)
        lens = rs.intrinsics()
        lens.width, lens.height, lens.fx, lens.fy = world.WIDTH, world.HEIGHT, world.FOCAL_PX, world.FOCAL_PX
        lens.ppx, lens.ppy, lens.model, lens.coeffs = world.WIDTH / 2, world.HEIGHT / 2, rs.distortion.brown_conrady, [0.0] * 5
        self.video = [self.stereo.add_video_stream(self.video_stream(index, lens)) for index in (1, 2)]
        self.gyro, self.accel = (self.motion.add_motion_stream(self.motion_stream(kind, uid))
                                 for kind, uid in ((rs.stream.gyro, 3), (rs.stream.accel, 4)))
        for camera, x_m in zip(self.video, (0.0, world.BASELINE_M)):
            where = rs.extrinsics()
            where.rotation, where.translation = [1.0, 0, 0, 0, 1, 0, 0, 0, 1], [x_m, 0, 0]
            camera.register_extrinsics_to(self.gyro, where)

    @staticmethod
    def video_stream(index, lens):
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid, stream.fmt = rs.stream.infrared, index, index, rs.format.y8
        stream.width, stream.height, stream.fps, stream.bpp, stream.intrinsics = lens.width, lens.height, 20, 1, lens
        return stream

    @staticmethod
    def motion_stream(kind, uid):
        stream = rs.motion_stream()
        stream.type, stream.uid, stream.fps, stream.fmt = kind, uid, world.IMU_HZ, rs.format.motion_xyz32f
        return stream

    def fly(self, seconds, silent=(float("inf"), 0)):
        """silent: from and until when no image comes."""
        rows, start_s, kept = world.wall(), time.time(), []
        for k in range(int(seconds * world.IMU_HZ)):
            t_s = k / world.IMU_HZ
            time.sleep(max(0.0, start_s + t_s - time.time()))
            x_m, force = world.motion(t_s)
            self.move(self.accel, start_s + t_s, k, (force, -9.81, 0.0), kept)
            self.move(self.gyro, start_s + t_s, k, (0.0, 0.0, 0.0), kept)
            if k % world.READINGS_A_FRAME == 0 and not silent[0] < t_s < silent[1]:
                for camera, at in zip(self.video, (x_m, x_m + world.BASELINE_M)):
                    self.show(camera, start_s + t_s, k, world.view(rows, at), kept)
            del kept[:-400]  # the library does not copy pixels and numbers, so they must stay alive

    def show(self, profile, t_s, number, pixels, kept):
        frame = rs.software_video_frame()
        frame.pixels, frame.stride, frame.bpp = numpy.frombuffer(pixels, numpy.uint8), world.WIDTH, 1
        frame.timestamp, frame.domain, frame.frame_number = t_s * 1e3, rs.timestamp_domain.global_time, number
        frame.profile = profile.as_video_stream_profile()
        kept.append(frame)
        self.stereo.on_video_frame(frame)

    def move(self, profile, t_s, number, values, kept):
        frame, data = rs.software_motion_frame(), rs.vector()
        data.x, data.y, data.z = values
        frame.data, frame.timestamp, frame.domain, frame.frame_number = data, t_s * 1e3, rs.timestamp_domain.global_time, number
        frame.profile = profile.as_motion_stream_profile()
        kept.append(frame)
        self.motion.on_motion_frame(frame)


def plug_in(path, seconds):
    """A camera that is plugged in for `seconds`."""
    software = SoftwareCamera()
    bridge = d435i_bridge.Camera(software.device, str(path))
    while not bridge.link.keep_open():
        time.sleep(0.2)
    bridge.start()
    flight = threading.Thread(target=software.fly, args=(seconds,))
    flight.start()
    flight.join()
    bridge.stop()
    assert bridge.failure is None, bridge.failure


def start(program, path, *arguments):
    live = subprocess.Popen([program, "live", "--source", f"socket:{path}", *arguments], stdout=subprocess.PIPE, text=True)
    while not path.exists():
        assert live.poll() is None
        time.sleep(0.05)
    return live


def flies(program, folder):
    path, out = folder / "s", folder / "out"
    live = start(program, path, "--out", out, "--quiet")
    try:
        plug_in(path, 7)
        plug_in(path, 6)
        time.sleep(0.5)
        live.send_signal(signal.SIGINT)
        assert live.wait(timeout=60) == 0, "there are poses"
    finally:
        live.kill()
    poses = (out / "trajectory_tum.txt").read_text(encoding="ascii").splitlines()
    print(f"{len(poses)} poses of 260 images; the camera was plugged in twice")
    assert len(poses) > 120, f"{len(poses)} poses of 260 images"


def is_checked(program, folder):
    """The first minute with a camera out of its box; its streams stop once."""
    path = folder / "checked"
    live = start(program, path, "--check", "9")
    software = SoftwareCamera()
    camera, over, watch = d435i_bridge.Camera(software.device, str(path)), threading.Event(), d435i_bridge.Watch()
    watch.cameras = 1
    serving = threading.Thread(target=d435i_bridge.serve, args=(camera, over, watch))
    serving.start()
    try:
        while camera.link.sender is None:
            time.sleep(0.05)
        software.fly(8.5, silent=(2, 5))
        said, _ = live.communicate(timeout=240)  # the doctor, on a busy machine
    finally:
        live.kill()
        over.set()
        serving.join()
    print(said)
    assert live.returncode == 1
    for words in ("note   Intel RealSense D435I, firmware 5.12.7.100, and its library recommends 5.16.0.1",
                  "WRONG  USB 2.1: too slow", "ok     driver: in user space (RSUSB)",
                  "ok     stamps of images and readings are on one clock (global time)", "ok     images of 640x480@20",
                  "ok     the dot projector is off", "ok     exposure 4.5 ms, at most 8.0 ms",
                  "note   the IMU has no calibration on the device", "note   the time offset between images and IMU is taken as 0",
                  "WRONG  0 resets of the USB device, 1 stalls of its streams"):
        assert words in said, words


# The bridge as `fbvins live` starts it, with the software device in the place of all that are plugged in.
PLUGGED_IN = """
import importlib.util, sys, threading, time
spec = importlib.util.spec_from_file_location("this_test", {test!r})
test = importlib.util.module_from_spec(spec)
spec.loader.exec_module(test)
software = test.SoftwareCamera()

class Context:
    def query_devices(self):
        return [software.device]

    def set_devices_changed_callback(self, callback):
        threading.Timer(2, software.fly, (8,)).start()

test.rs.context = Context
test.d435i_bridge.main(*sys.argv[1:])
"""


def is_started(program, folder):
    bridges, out = folder / "bridges", folder / "started"
    bridges.mkdir()
    (bridges / "d435i_bridge.py").write_text(PLUGGED_IN.format(test=os.path.abspath(__file__)), encoding="ascii")
    live = subprocess.Popen([program, "live", "--source", "d435i:123456:640x480@20", "--out", out, "--quiet"], stderr=subprocess.PIPE, text=True,
                            env={**os.environ, "FBVINS_BRIDGES": str(bridges), "FBVINS_PYTHON": sys.executable})
    try:
        time.sleep(12)
        live.send_signal(signal.SIGTERM)
        _, said = live.communicate(timeout=60)
    finally:
        live.kill()
    print(said)
    assert live.returncode == 0 and "d435i: D435i bridge is connected" in said, said
    poses = (out / "trajectory_tum.txt").read_text(encoding="ascii").splitlines()
    assert len(poses) > 60, f"{len(poses)} poses of 160 images"


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        is_started(program, pathlib.Path(folder))
        flies(program, pathlib.Path(folder))
        is_checked(program, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

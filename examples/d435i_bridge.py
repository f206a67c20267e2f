#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a RealSense D435i to `fbvins live --source socket:PATH`, by Intel's Python package (pip install pyrealsense2 numpy).

usage: d435i_bridge.py SOCKET [SERIAL or FILE.bag]    runs until Ctrl-C, or the recording's end; waits for a camera that is unplugged, and
for fbvins, which may start later or anew
"""
import sys
import threading
import time

import numpy
import pyrealsense2 as rs

from sensor_bridge import RADTAN, Link, MergedImu, StereoPairs, camera_bytes, rig_bytes

IMU_NOISE = (2.44e-4, 1.9393e-5, 1.47e-3, 3.0e-3)  # densities from the BMI055's data sheet, random walks assumed (docs/d435i.md)


def rig(left, right, gyro):
    """FbvinsSocketRig (docs/socket.md) with the factory calibration."""
    def camera(profile):
        lens, where = profile.get_intrinsics(), profile.get_extrinsics_to(gyro)
        rotation = numpy.array(where.rotation).reshape(3, 3).T  # librealsense stores it by columns
        pose = numpy.hstack([rotation, numpy.array(where.translation).reshape(3, 1)])
        if lens.coeffs[4] or (any(lens.coeffs) and lens.model != rs.distortion.brown_conrady):
            sys.exit(f"the distortion model {lens.model} is not supported; calibrate with Kalibr")
        return camera_bytes(RADTAN, (lens.fx, lens.fy), (lens.ppx, lens.ppy), lens.coeffs[:4], pose)
    return rig_bytes(camera(left), camera(right), IMU_NOISE, gyro.fps(), left.fps())


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
        self.link = Link(path, left.width(), left.height(), rig(left, right, gyro), "D435i bridge")
        self.pairs, self.imu = StereoPairs(), MergedImu()
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
                    add = self.imu.add_gyro if profile.stream_type() == rs.stream.gyro else self.imu.add_accel
                    add(t_ns, numpy.array([v.x, v.y, v.z]))
                    for reading in self.imu.ready():
                        self.link.send("reading", *reading)
        except Exception as error:  # else it would be lost in a thread of the library
            self.failure = error

    def take_image(self, camera, t_ns, image):
        self.pairs.add(camera - 1, t_ns, image)
        while frame := self.pairs.next():
            self.link.send("frame", *frame)

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

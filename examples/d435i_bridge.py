#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a RealSense D435i or D455 to `fbvins live --source socket:PATH`, by Intel's Python package (pip install pyrealsense2 numpy).

`fbvins live --source d435i` starts it where the program was built without librealsense.

usage: d435i_bridge.py SOCKET [SERIAL or FILE.bag] [WIDTHxHEIGHT[@HZ]]    runs until Ctrl-C, or the recording's end; waits for a camera
that is unplugged, and for fbvins, which may start later or anew. Without a size: the one nearest to 640x480@30.
"""
import sys
import threading
import time

import numpy
import pyrealsense2 as rs

from sensor_bridge import RADTAN, Link, MergedImu, StereoPairs, camera_bytes, rig_bytes, which_and_mode

IMU_NOISE = (2.44e-4, 1.9393e-5, 1.47e-3, 3.0e-3)  # densities from the BMI055's data sheet, random walks assumed (docs/d435i.md)
LONGEST_EXPOSURE_US = 8000  # of automatic exposure, where the camera has such a limit
OTHER_MODES = ("640x480@30", "848x480@30", "848x480@60")
SILENT_S = 2  # without an image, though the camera is there: its streams are started again; if that does not help, the camera


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


def switch(sensor, option, value):
    if sensor.supports(option) and not sensor.is_option_read_only(option):
        sensor.set_option(option, value)


def limit_exposure(sensor):
    """A lower limit that somebody has set is kept."""
    limit, toggle = rs.option.auto_exposure_limit, rs.option.auto_exposure_limit_toggle
    if sensor.supports(limit) and sensor.get_option(limit) > LONGEST_EXPOSURE_US:
        switch(sensor, limit, LONGEST_EXPOSURE_US)
        switch(sensor, toggle, 1)


def is_identity(motion):
    """Of an IMU's scale and bias: a device without a calibration has this, or nothing."""
    values = numpy.array(motion.data, float).reshape(3, 4)
    return not values.any() or numpy.allclose(values, numpy.eye(3, 4), atol=1e-12)


def mode_of(profile):
    return f"{profile.width()}x{profile.height()}@{profile.fps()}"


class Seen:
    """What images say of themselves: exposure, dot projector, clock."""

    def __init__(self):
        self.exposure_us, self.emitter, self.clock = None, set(), None

    def take(self, frame):
        value = rs.frame_metadata_value
        if frame.supports_frame_metadata(value.actual_exposure):
            self.exposure_us = frame.get_frame_metadata(value.actual_exposure)
        if frame.supports_frame_metadata(value.frame_emitter_mode):
            self.emitter.add(frame.get_frame_metadata(value.frame_emitter_mode) != 0)
        names = {rs.timestamp_domain.global_time: "global", rs.timestamp_domain.hardware_clock: "device", rs.timestamp_domain.system_time: "arrival"}
        self.clock = names.get(frame.get_frame_timestamp_domain())

    def emitter_word(self, sensor):
        if self.emitter:
            return "alternating" if len(self.emitter) == 2 else "on" if True in self.emitter else "off"
        option = rs.option.emitter_enabled
        return ("on" if sensor.get_option(option) else "off") if sensor.supports(option) else "unknown"


class Camera:
    """The streams of one device: pairs of images, and the accelerometer's value at every reading of the gyroscope."""

    def __init__(self, device, path, wanted=None):
        """wanted: (width, height, frames a second or 0); None: any size near 640 x 480."""
        self.device, self.wanted, self.sensors, self.offered, chosen = device, wanted or (640, 480, 30), [], set(), {}
        kinds = {("infrared", 1): rs.format.y8, ("infrared", 2): rs.format.y8, ("gyro", 0): rs.format.motion_xyz32f,
                 ("accel", 0): rs.format.motion_xyz32f}
        for sensor in device.query_sensors():
            mine = {}
            for profile in sensor.get_stream_profiles():
                key = (profile.stream_type().name, profile.stream_index() if profile.stream_type() == rs.stream.infrared else 0)
                if kinds.get(key) == profile.format():
                    self.note(key, profile)
                    if self.distance(profile) < self.distance(mine.get(key)):
                        mine[key] = profile.as_video_stream_profile() if key[0] == "infrared" else profile.as_motion_stream_profile()
            if mine:
                for option, value in ((rs.option.emitter_enabled, 0), (rs.option.emitter_on_off, 0), (rs.option.global_time_enabled, 1),
                                      (rs.option.enable_motion_correction, 1)):
                    switch(sensor, option, value)
                limit_exposure(sensor)
                self.sensors.append((sensor, list(mine.values())))
            chosen.update(mine)
        if chosen.keys() != kinds.keys():
            raise RuntimeError(f"the camera has no {kinds.keys() - chosen.keys()}")
        self.left, right, self.gyro, self.accel = (chosen[key] for key in kinds)
        if wanted and (self.left.width(), self.left.height(), self.left.fps() if wanted[2] else 0) != wanted:
            sys.exit(f"the camera has no mode {wanted[0]}x{wanted[1]}" + (f"@{wanted[2]}" if wanted[2] else "") + f", but {self.modes()}")
        self.link = Link(path, self.left.width(), self.left.height(), rig(self.left, right, self.gyro), "D435i bridge")
        self.pairs, self.imu, self.seen = StereoPairs(), MergedImu(), Seen()
        self.lock, self.failure, self.image_s = threading.Lock(), None, time.monotonic()

    def start(self):
        with self.lock:  # what it had before it stopped is of no use
            self.pairs, self.imu, self.image_s = StereoPairs(), MergedImu(), time.monotonic()
        for sensor, profiles in self.sensors:
            sensor.open(profiles)
            sensor.start(self.take)

    def distance(self, profile):
        """How far a profile is from the wanted one; of an IMU the fastest is wanted."""
        if profile is None:
            return float("inf")
        if not profile.is_video_stream_profile():
            return -profile.fps()
        video = profile.as_video_stream_profile()
        return abs(video.width() - self.wanted[0]) + abs(video.height() - self.wanted[1]) + abs(video.fps() - (self.wanted[2] or 30))

    def note(self, key, profile):
        if key == ("infrared", 1):
            video = profile.as_video_stream_profile()
            self.offered.add((video.width(), video.height(), video.fps()))

    def modes(self):
        return " ".join(f"{w}x{h}@{hz}" for w, h, hz in sorted(self.offered))

    def take(self, frame):
        try:
            with self.lock:
                profile, t_ns = frame.get_profile(), round(frame.get_timestamp() * 1e3) * 1000
                if frame.is_video_frame():
                    self.seen.take(frame)
                    self.image_s = time.monotonic()
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

    def is_silent(self):
        return time.monotonic() - self.image_s > SILENT_S

    def info(self, which):
        return self.device.get_info(which) if self.device.supports(which) else None

    def longest_exposure_ms(self, sensor):
        """What is set: a fixed exposure, or the limit of the automatic one."""
        automatic, limit, toggle = rs.option.enable_auto_exposure, rs.option.auto_exposure_limit, rs.option.auto_exposure_limit_toggle
        if sensor.supports(automatic) and not sensor.get_option(automatic) and sensor.supports(rs.option.exposure):
            return sensor.get_option(rs.option.exposure) / 1e3
        if sensor.supports(limit) and (not sensor.supports(toggle) or sensor.get_option(toggle)):
            return sensor.get_option(limit) / 1e3
        return None

    def facts(self):
        """What `fbvins live --check` judges (docs/socket.md)."""
        info = rs.camera_info
        stereo = next(sensor for sensor, profiles in self.sensors if any(p.is_video_stream_profile() for p in profiles))
        port, own = self.info(info.physical_port), mode_of(self.left)
        return {"model": self.info(info.name), "firmware": self.info(info.firmware_version),
                "recommended_firmware": self.info(info.recommended_firmware_version), "usb": self.info(info.usb_type_descriptor),
                "driver": None if port is None else "kernel" if port.startswith("/") else "user space", "clock": self.seen.clock,
                "emitter": self.seen.emitter_word(stereo), "mode": own,
                "other_modes": " ".join(m for m in self.modes().split() if m != own and m in OTHER_MODES) or None,
                "set_mode": "--source d435i:MODE",
                "exposure_ms": None if self.seen.exposure_us is None else self.seen.exposure_us / 1e3,
                "longest_exposure_ms": self.longest_exposure_ms(stereo),
                "imu_calibrated": not all(is_identity(p.get_motion_intrinsics()) for p in (self.gyro, self.accel))}

    def stop(self, close=True):
        for sensor, _ in self.sensors:
            try:
                sensor.stop()
                sensor.close()
            except RuntimeError:  # unplugged
                pass
        if close:
            self.link.close()


def find(context, which):
    return next((d for d in context.query_devices() if which in ("", d.get_info(rs.camera_info.serial_number))), None)


def who_is_missing(context, which):
    there = [d.get_info(rs.camera_info.serial_number) for d in context.query_devices() if d.supports(rs.camera_info.serial_number)]
    wanted = f"the RealSense camera {which}" if which else "a RealSense camera"
    return f"waiting for {wanted}: " + (f"there is {', '.join(there)}" if there else "none is plugged in, or may be opened by this user (udev rules)")


class Watch:
    """Over all cameras that come and go: how often, and how often streams stopped while the camera was there."""

    def __init__(self, recorded=False):
        self.cameras, self.stalls, self.stalled_s, self.recorded = 0, 0, float("-inf"), recorded

    def describe(self, camera):
        camera.link.describe({**camera.facts(), "resets": self.cameras - 1, "stalls": self.stalls})

    def restart_stalled(self, camera):
        """Starts streams that have stopped again; those that stop again within ten seconds: the camera as a whole."""
        if self.recorded or not camera.is_silent():
            return
        self.stalls += 1
        print("the camera is there, and no image comes: its streams are started again", file=sys.stderr, flush=True)
        again, self.stalled_s = time.monotonic() - self.stalled_s < 10, time.monotonic()
        camera.stop(close=False)
        if not again:
            return camera.start()
        camera.failure = "it is reset"
        try:
            camera.device.hardware_reset()
        except RuntimeError as error:  # unplugged, or a software device
            camera.failure = error


def serve(camera, over, watch):
    """Until the camera is gone."""
    while not camera.link.keep_open() and not over.wait(0.5):
        pass
    camera.start()
    next_report_s, next_facts_s = 0, time.monotonic() + 1
    while not over.wait(0.2) and camera.failure is None:
        camera.link.keep_open()
        watch.restart_stalled(camera)
        if time.monotonic() >= next_facts_s and camera.failure is None:
            next_facts_s = time.monotonic() + 1
            watch.describe(camera)
        if time.monotonic() >= next_report_s:
            next_report_s, wrong = time.monotonic() + 5, camera.report()
            if wrong:
                print(wrong, file=sys.stderr, flush=True)
    camera.stop()
    print(f"the camera's stream has ended: {camera.failure or 'unplugged, or the end of its recording'}", file=sys.stderr)


def main(path, *arguments):
    which, wanted = which_and_mode(arguments)
    if wanted and not wanted[0]:
        wanted = (640, 480, wanted[2])
    context, recorded, told = rs.context(), which.endswith(".bag"), None
    watch = Watch(recorded)
    while True:
        device = context.load_device(which) if recorded else find(context, which)
        if device is None:
            missing = who_is_missing(context, which)
            if missing != told:
                print(missing, file=sys.stderr, flush=True)
            told = missing
            time.sleep(0.5)
            continue
        told, over = None, threading.Event()
        context.set_devices_changed_callback(lambda event: event.was_removed(device) and over.set())
        if recorded:
            device.set_status_changed_callback(lambda status: status == rs.playback_status.stopped and over.set())
        watch.cameras += 1
        serve(Camera(device, path, wanted), over, watch)
        if recorded:
            return


if __name__ == "__main__":
    main(*sys.argv[1:])

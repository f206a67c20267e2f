#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends an Orbbec stereo camera with an IMU (Gemini 330 series) to `fbvins live --source socket:PATH`, by Orbbec's Python package
(pip install pyorbbecsdk2 numpy). The laser is switched off; the calibration is the device's own. Never tried with a device
(docs/devices.md). `fbvins live --source orbbec` starts it.

usage: orbbec_bridge.py SOCKET [SERIAL] [WIDTHxHEIGHT[@HZ]]    runs until Ctrl-C; waits for a device that is unplugged, and for fbvins
"""
import re
import sys
import threading
import time

import numpy
import pyorbbecsdk as ob

from lens_fit import WORST_FIT_PX, fitted_equidistant
from sensor_bridge import EQUIDISTANT, RADTAN, Link, MergedImu, StereoPairs, camera_bytes, rig_bytes, which_and_mode

MODE, IMU_HZ = (640, 480, 30), 200
IMU_NOISE = (1.22e-4, 1.9393e-5, 1.57e-3, 3.0e-3)  # densities from the BMI270's data sheet, random walks assumed
LONGEST_EXPOSURE_US = 8000
SILENT_S = 3


def lens(profile):
    """(model, fx fy cx cy k1 k2 k3 k4 or k1 k2 p1 p2) of a camera's stream. The images of these devices are rectified as a rule: no
    distortion."""
    i, d = profile.get_intrinsic(), profile.get_distortion()
    k = [d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6]
    plain = [i.fx, i.fy, i.cx, i.cy]
    if d.model == ob.OBCameraDistortionModel.KANNALA_BRANDT4:
        return EQUIDISTANT, plain + [d.k1, d.k2, d.k3, d.k4]
    if not any(k[4:]) and d.model != ob.OBCameraDistortionModel.INVERSE_BROWN_CONRADY or not any(k):
        return RADTAN, plain + k[:4]
    K = numpy.array([[i.fx, 0, i.cx], [0, i.fy, i.cy], [0, 0, 1]])
    fitted, error_px = fitted_equidistant(K, k + [0.0] * 6, profile.get_width(), profile.get_height())
    if d.model == ob.OBCameraDistortionModel.INVERSE_BROWN_CONRADY or not error_px < WORST_FIT_PX:
        sys.exit(f"no lens model of four coefficients fits the device's ({d.model}, {error_px:.2f} px); calibrate with `fbvins calibrate`, "
                 "and give `fbvins live` the file")
    return EQUIDISTANT, list(fitted)


def rig(left, right, gyro):
    """FbvinsSocketRig (docs/socket.md) with the device's calibration, of which lengths are in mm; B is the gyroscope."""
    def camera(profile):
        model, values = lens(profile)
        where = profile.get_extrinsic_to(gyro)
        T_BC = numpy.hstack([numpy.array(where.rot, float).reshape(3, 3), numpy.array(where.transform, float).reshape(3, 1) / 1e3])
        return camera_bytes(model, values[:2], values[2:4], values[4:], T_BC)
    return rig_bytes(camera(left), camera(right), IMU_NOISE, IMU_HZ, left.get_fps())


class Streams:
    """Turns the device's frames into frames and readings of the socket. Each pipeline has a thread of its own."""

    def __init__(self, link, is_global):
        self.link, self.pairs, self.imu, self.lock = link, StereoPairs(), MergedImu(), threading.Lock()
        self.is_global, self.heard_s, self.failure = is_global, time.monotonic(), None

    def stamp_ns(self, frame):
        return 1000 * (frame.get_global_timestamp_us() if self.is_global else frame.get_timestamp_us())

    def take(self, frames):
        try:
            with self.lock:
                for camera, frame in ((0, frames.get_left_ir_frame()), (1, frames.get_right_ir_frame())):
                    if frame is not None:
                        self.take_image(camera, frame)
                accel, gyro = frames.get_accel_frame(), frames.get_gyro_frame()
                if accel is not None:
                    self.imu.add_accel(self.stamp_ns(accel), (accel.get_x(), accel.get_y(), accel.get_z()))
                if gyro is not None:
                    self.imu.add_gyro(self.stamp_ns(gyro), (gyro.get_x(), gyro.get_y(), gyro.get_z()))
                for reading in self.imu.ready():
                    self.link.send("reading", *reading)
        except Exception as error:  # else it would be lost in a thread of the library
            self.failure = error

    def take_image(self, camera, frame):
        self.heard_s = time.monotonic()
        image = numpy.frombuffer(frame.get_data(), numpy.uint8).reshape(frame.get_height(), frame.get_width()).copy()
        self.pairs.add(camera, self.stamp_ns(frame), image)
        while pair := self.pairs.next():
            self.link.send("frame", *pair)


def settle(device):
    """Switches the laser off and limits the automatic exposure; returns what is known of both."""
    id_, write = ob.OBPropertyID, ob.OBPermissionType.PERMISSION_WRITE
    emitter = "unknown"
    for property_, switch in ((id_.OB_PROP_LASER_CONTROL_INT, device.set_int_property), (id_.OB_PROP_LASER_BOOL, device.set_bool_property)):
        if emitter == "unknown" and device.is_property_supported(property_, write):
            switch(property_, 0)
            emitter = "off"
    limited = device.is_property_supported(id_.OB_PROP_IR_AE_MAX_EXPOSURE_INT, write)
    if limited:
        device.set_int_property(id_.OB_PROP_IR_AE_MAX_EXPOSURE_INT, LONGEST_EXPOSURE_US)
    return {"emitter": emitter, "longest_exposure_ms": LONGEST_EXPOSURE_US / 1e3 if limited else None}


def facts(device, mode, is_global):
    """What `fbvins live --check` judges (docs/socket.md)."""
    info = device.get_device_info()
    usb = re.search(r"USB(\d[\d.]*)", info.get_connection_type())
    return {"model": info.get_name(), "firmware": info.get_firmware_version(), "usb": usb and usb[1], "clock": "global" if is_global else "device",
            "mode": "{}x{}@{}".format(*mode), "set_mode": "--source orbbec:MODE"}


def fly(device, path, mode):
    """Until the device is gone."""
    known = settle(device)
    is_global = device.is_global_timestamp_supported()
    if is_global:
        device.enable_global_timestamp(True)
    cameras, images = ob.Pipeline(device), ob.Config()
    for sensor in (ob.OBSensorType.LEFT_IR_SENSOR, ob.OBSensorType.RIGHT_IR_SENSOR):
        images.enable_video_stream(sensor, *mode, ob.OBFormat.Y8)
    inertial, motion = ob.Pipeline(device), ob.Config()
    motion.enable_accel_stream(sample_rate=ob.OBAccelSampleRate.SAMPLE_RATE_200_HZ)
    motion.enable_gyro_stream(sample_rate=ob.OBGyroSampleRate.SAMPLE_RATE_200_HZ)
    for config in (images, motion):  # pairs are made here
        config.set_frame_aggregate_output_mode(ob.OBFrameAggregateOutputMode.ANY_SITUATION)
    of = {profile.get_type(): profile for config in (images, motion) for profile in profiles(config)}
    kind = ob.OBStreamType
    link = Link(path, *mode[:2], rig(of[kind.LEFT_IR_STREAM], of[kind.RIGHT_IR_STREAM], of[kind.GYRO_STREAM]), "Orbbec bridge")
    link.describe({**facts(device, mode, is_global), **known})
    streams = Streams(link, is_global)
    cameras.start(images, streams.take)
    inertial.start(motion, streams.take)
    next_report_s = 0
    while streams.failure is None and time.monotonic() - streams.heard_s < SILENT_S:
        link.keep_open()
        if time.monotonic() >= next_report_s:
            with streams.lock:
                next_report_s, wrong = time.monotonic() + 5, streams.pairs.report()
            if wrong:
                print(wrong, file=sys.stderr, flush=True)
        time.sleep(0.2)
    for pipeline in (cameras, inertial):
        pipeline.stop()
    link.close()
    print(f"the camera's stream has ended: {streams.failure or 'no image comes'}", file=sys.stderr, flush=True)


def profiles(config):
    """The streams that are enabled, each as what it is."""
    listed = config.get_enabled_stream_profile_list()
    for i in range(listed.get_count()):
        profile = listed.get_stream_profile_by_index(i)
        for is_one, as_one in (("is_video_stream_profile", "as_video_stream_profile"), ("is_gyro_stream_profile", "as_gyro_stream_profile")):
            if getattr(profile, is_one)():
                profile = getattr(profile, as_one)()
                break
        yield profile


def main(path, *arguments):
    which, mode = which_and_mode(arguments)
    wanted = tuple(said or own for said, own in zip(mode or MODE, MODE))
    context, told = ob.Context(), None
    while True:
        try:
            devices = context.query_devices()
            if devices.get_count() == 0:
                raise ob.OBError("there is none")
            told = None
            fly(devices.get_device_by_serial_number(which) if which else devices.get_device_by_index(0), path, wanted)
        except ob.OBError as error:
            if str(error) != told:
                print(f"waiting for an Orbbec camera: {error}", file=sys.stderr, flush=True)
            told = str(error)
        time.sleep(0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])

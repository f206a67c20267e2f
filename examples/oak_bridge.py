#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a Luxonis OAK-D (or another OAK with two global-shutter mono cameras and an IMU) to `fbvins live --source socket:PATH`, by
Luxonis's Python package (pip install "depthai>=3" numpy). Dot projector and flood light are switched off; the calibration is the
device's own. Never tried with a device (docs/devices.md).

`fbvins live --source oak` starts it.

usage: oak_bridge.py SOCKET [DEVICE] [[640x400]@HZ]    runs until Ctrl-C; waits for a device that is unplugged, and for fbvins. DEVICE: its
id or address, as Luxonis's library names it
"""
import sys
import time

import depthai as dai
import numpy

from lens_fit import WORST_FIT_PX, fitted_equidistant
from sensor_bridge import EQUIDISTANT, Link, MergedImu, StereoPairs, camera_bytes, rig_bytes, which_and_mode

WIDTH, HEIGHT, IMAGE_HZ, IMU_HZ = 640, 400, 30, 200
CAMERAS = (dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C)  # left and right
IMU_NOISE = (1.22e-4, 1.9393e-5, 1.57e-3, 3.0e-3)  # densities from the BMI270's data sheet, random walks assumed
SILENT_S = 3


def camera(calibration, which):
    """FbvinsSocketCamera by the device's calibration (dai.CalibrationHandler)."""
    K = numpy.array(calibration.getCameraIntrinsics(which, WIDTH, HEIGHT))
    k = calibration.getDistortionCoefficients(which)
    if calibration.getDistortionModel(which) == dai.CameraModel.Fisheye:
        lens = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *k[:4]]
    else:
        lens, error_px = fitted_equidistant(K, k, WIDTH, HEIGHT)
        if not error_px < WORST_FIT_PX:
            sys.exit(f"{which.name}: no lens model of four coefficients fits the device's to {WORST_FIT_PX} px ({error_px:.2f}); "
                     "calibrate with `fbvins calibrate`, and give `fbvins live` the file")
    T_BC = calibration.getCameraToImuExtrinsics(which, False, dai.LengthUnit.METER)
    return camera_bytes(EQUIDISTANT, lens[:2], lens[2:4], lens[4:], T_BC)


def rig(calibration, image_hz):
    left, right = (camera(calibration, which) for which in CAMERAS)
    return rig_bytes(left, right, IMU_NOISE, IMU_HZ, image_hz)


def stamp_ns(moment):
    """Of the library's clock, which is this machine's, for images and readings alike."""
    return round(moment.total_seconds() * 1e6) * 1000


def facts(device, image_hz):
    """What `fbvins live --check` judges (docs/socket.md)."""
    speed = {"HIGH": "2.0", "SUPER": "3.0", "SUPER_PLUS": "3.1"}
    return {"model": device.getDeviceName(), "usb": speed.get(device.getUsbSpeed().name), "driver": "user space", "clock": "global",
            "emitter": "off", "mode": f"{WIDTH}x{HEIGHT}@{image_hz:g}"}


def build(pipeline, image_hz):
    """The queues of left and right images and of the IMU."""
    images = []
    for which in CAMERAS:
        node = pipeline.create(dai.node.Camera).build(which, sensorFps=image_hz)
        out = node.requestOutput((WIDTH, HEIGHT), type=dai.ImgFrame.Type.GRAY8, enableUndistortion=False)
        images.append(out.createOutputQueue(maxSize=8, blocking=False))
    imu = pipeline.create(dai.node.IMU)
    imu.enableIMUSensor([dai.IMUSensor.ACCELEROMETER_RAW, dai.IMUSensor.GYROSCOPE_RAW], IMU_HZ)
    imu.setBatchReportThreshold(1)
    imu.setMaxBatchReports(20)
    return images, imu.out.createOutputQueue(maxSize=100, blocking=False)


class Streams:
    """Turns the device's messages into frames and readings."""

    def __init__(self, link):
        self.link, self.pairs, self.imu = link, StereoPairs(), MergedImu()

    def take_image(self, camera_number, message):
        t_ns = stamp_ns(message.getTimestamp(dai.CameraExposureOffset.MIDDLE))
        self.pairs.add(camera_number, t_ns, numpy.asarray(message.getFrame()).reshape(HEIGHT, WIDTH).copy())
        while frame := self.pairs.next():
            self.link.send("frame", *frame)

    def take_motion(self, packet):
        accel, gyro = packet.acceleroMeter, packet.gyroscope
        self.imu.add_accel(stamp_ns(accel.getTimestamp()), (accel.x, accel.y, accel.z))
        self.imu.add_gyro(stamp_ns(gyro.getTimestamp()), (gyro.x, gyro.y, gyro.z))
        for reading in self.imu.ready():
            self.link.send("reading", *reading)


def fly(device, path, image_hz):
    """Until the device is gone."""
    for switch_off in (device.setIrLaserDotProjectorIntensity, device.setIrFloodLightIntensity):
        switch_off(0)
    link = Link(path, WIDTH, HEIGHT, rig(device.readCalibration(), image_hz), "OAK bridge")
    link.describe(facts(device, image_hz))
    with dai.Pipeline(device) as pipeline:
        images, motion = build(pipeline, image_hz)
        streams = Streams(link)
        pipeline.start()
        next_report_s, heard_s = 0, time.monotonic()
        while pipeline.isRunning() and time.monotonic() - heard_s < SILENT_S:
            link.keep_open()
            came = False
            for number, queue in enumerate(images):
                while (message := queue.tryGet()) is not None:
                    came = True
                    streams.take_image(number, message)
            while (message := motion.tryGet()) is not None:
                for packet in message.packets:
                    streams.take_motion(packet)
            if came:
                heard_s = time.monotonic()
            if time.monotonic() >= next_report_s:
                next_report_s, wrong = time.monotonic() + 5, streams.pairs.report()
                if wrong:
                    print(wrong, file=sys.stderr, flush=True)
            time.sleep(0.001)
    link.close()


def main(path, *arguments):
    which, mode = which_and_mode(arguments)
    if mode and mode[:2] not in ((0, 0), (WIDTH, HEIGHT)):
        sys.exit(f"images are of {WIDTH}x{HEIGHT}; say @HZ alone for another rate")
    image_hz = mode and mode[2] or IMAGE_HZ
    told = None
    print(f"looking for {which or 'an OAK'}", file=sys.stderr, flush=True)  # the library itself waits for seconds
    while True:
        try:
            with (dai.Device(dai.DeviceInfo(which)) if which else dai.Device()) as device:
                told = None
                fly(device, path, image_hz)
        except RuntimeError as error:  # there is no device, or it was unplugged
            if str(error) != told:
                print(f"waiting for an OAK: {error}", file=sys.stderr, flush=True)
            told = str(error)
        time.sleep(0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])

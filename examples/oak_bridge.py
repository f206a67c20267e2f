#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a Luxonis OAK-D (or another OAK with two global-shutter mono cameras and an IMU) to `fbvins live --source socket:PATH`, by
Luxonis's Python package (pip install "depthai>=3" numpy). Dot projector and flood light are switched off; the calibration is the
device's own. Never tried with a device (docs/devices.md).

usage: oak_bridge.py SOCKET [FRAMES_A_SECOND]    runs until Ctrl-C; waits for a device that is unplugged, and for fbvins
"""
import sys
import time

import depthai as dai
import numpy

from sensor_bridge import EQUIDISTANT, Link, MergedImu, StereoPairs, camera_bytes, rig_bytes

WIDTH, HEIGHT, IMAGE_HZ, IMU_HZ = 640, 400, 30, 200
CAMERAS = (dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C)  # left and right
IMU_NOISE = (1.22e-4, 1.9393e-5, 1.57e-3, 3.0e-3)  # densities from the BMI270's data sheet, random walks assumed
WORST_FIT_PX = 0.5  # of the lens model, root mean square
SILENT_S = 3


def device_pixels(k, rays):
    """Pixels of rays (x, y on the plane z = 1) in units of the focal length, by the rational model of 14 coefficients."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = (list(k) + [0.0] * 14)[:12]
    x, y = rays[:, 0], rays[:, 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return numpy.stack([x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + s1 * r2 + s2 * r2 * r2,
                        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + s3 * r2 + s4 * r2 * r2], axis=1)


def equidistant_pixels(lens, rays):
    """lens: fx, fy, cx, cy, k1 to k4."""
    r = numpy.maximum(numpy.hypot(rays[:, 0], rays[:, 1]), 1e-12)
    a = numpy.arctan(r)
    bent = a * (1 + a**2 * (lens[4] + a**2 * (lens[5] + a**2 * (lens[6] + a**2 * lens[7])))) / r
    return lens[:2] * (rays * bent[:, None]) + lens[2:4]


def rays_in_view(K, k):
    """Rays of a grid that the device's model maps into the image, where it is one to one, and their pixels."""
    u = numpy.linspace(-2, 2, 161)
    rays = numpy.stack(numpy.meshgrid(u, u), axis=2).reshape(-1, 2)
    outwards = numpy.stack([(device_pixels(k, share * rays) * rays).sum(axis=1) for share in numpy.linspace(0, 1, 41)])
    grows = (numpy.diff(outwards, axis=0) >= 0).all(axis=0)
    bent = device_pixels(k, rays)
    pixels = bent * (K[0, 0], K[1, 1]) + (K[0, 2], K[1, 2])
    inside = grows & (pixels >= 0).all(axis=1) & (pixels[:, 0] < WIDTH) & (pixels[:, 1] < HEIGHT)
    return rays[inside], pixels[inside]


def fitted_equidistant(K, k):
    """The equidistant lens next to the device's rational model, of which the estimator has no counterpart: (lens, error in px)."""
    rays, pixels = rays_in_view(K, k)
    lens = numpy.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], 0, 0, 0, 0], float)
    for _ in range(20):
        error = (equidistant_pixels(lens, rays) - pixels).ravel()
        steps = numpy.diag([1e-3] * 4 + [1e-6] * 4)
        J = numpy.stack([(equidistant_pixels(lens + d, rays) - pixels).ravel() - error for d in steps], axis=1) / numpy.diag(steps)
        lens = lens - numpy.linalg.lstsq(J, error, rcond=None)[0]
    error = equidistant_pixels(lens, rays) - pixels
    return lens, float(numpy.sqrt((error**2).sum(axis=1).mean()))


def camera(calibration, which):
    """FbvinsSocketCamera by the device's calibration (dai.CalibrationHandler)."""
    K = numpy.array(calibration.getCameraIntrinsics(which, WIDTH, HEIGHT))
    k = calibration.getDistortionCoefficients(which)
    if calibration.getDistortionModel(which) == dai.CameraModel.Fisheye:
        lens = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *k[:4]]
    else:
        lens, error_px = fitted_equidistant(K, k)
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


def main(path, image_hz=IMAGE_HZ):
    told = None
    while True:
        try:
            with dai.Device() as device:
                told = None
                fly(device, path, float(image_hz))
        except RuntimeError as error:  # there is no device, or it was unplugged
            if str(error) != told:
                print(f"waiting for an OAK: {error}", file=sys.stderr, flush=True)
            told = str(error)
        time.sleep(0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])

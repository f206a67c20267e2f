#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Files of other programs, each written from the facts of its format with numbers of this test's own: read where they are given, or
named with what to do. docs/experiments/reach.md says which kinds; --table prints each with its answer.

usage: foreign_files.py FBVINS [--table]
"""
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

PROGRAM = sys.argv[1]
F, C, D, SIZE = (458.654, 457.296), (367.215, 248.375), (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05), (752, 480)
F1, C1, D1 = (457.587, 456.134), (379.999, 255.238), (-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05)
T_BC = [[[0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975], [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768],
         [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949], [0, 0, 0, 1]],
        [[0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556], [0.999598781151, 0.0130119051815, 0.0251588363115, 0.0453689425024],
         [-0.0253898008918, 0.0179005838253, 0.999517347078, 0.00786212447038], [0, 0, 0, 1]]]


def inverse(T):
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    return [[*R[i], -sum(R[i][k] * T[k][3] for k in range(3))] for i in range(3)] + [[0, 0, 0, 1]]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def flat(T):
    return [x for row in T for x in row]


def rows_of(T, indent="  "):
    return "\n".join(f"{indent}- {row}" for row in T)


def opencv(name, T, rows=4, columns=4, tag="!!opencv-matrix"):
    data = ", ".join(str(x) for row in T[:rows] for x in row[:columns])
    return f"{name}: {tag}\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [{data}]\n"


T_C1C0 = product(inverse(T_BC[1]), T_BC[0])
NOISE = "gyroscope_noise_density: 1.6968e-04\ngyroscope_random_walk: 1.9393e-05\naccelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"


def kalibr(distortion="radtan", coefficients=(D, D1), model="pinhole", extra="", inverse_of=inverse, key="T_cam_imu"):
    out = ""
    for k, (f, c) in enumerate(((F, C), (F1, C1))):
        out += (f"cam{k}:\n  camera_model: {model}\n  intrinsics: {[*f, *c]}\n  distortion_model: {distortion}\n  distortion_coeffs: {list(coefficients[k])}\n"
                f"  resolution: {list(SIZE)}\n  rostopic: /cam{k}/image_raw\n  {key}:\n{rows_of(inverse_of(T_BC[k]))}\n{extra}")
        if k == 1:
            out += f"  T_cn_cnm1:\n{rows_of(T_C1C0)}\n"
    return out


def vins_fusion(folder):
    for k, (f, c, d) in enumerate(((F, C, D), (F1, C1, D1))):
        (folder / f"cam{k}_pinhole.yaml").write_text(
            "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\n"
            f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ndistortion_parameters:\n   k1: {d[0]}\n   k2: {d[1]}\n   p1: {d[2]}\n   p2: {d[3]}\n"
            f"projection_parameters:\n   fx: {f[0]}\n   fy: {f[1]}\n   cx: {c[0]}\n   cy: {c[1]}\n", encoding="utf-8")
    return ("%YAML:1.0\nimu: 1\nnum_of_cam: 2\nimu_topic: \"/imu0\"\nimage0_topic: \"/cam0/image_raw\"\nimage1_topic: \"/cam1/image_raw\"\noutput_path: \"/tmp\"\n"
            f"cam0_calib: \"cam0_pinhole.yaml\"\ncam1_calib: \"cam1_pinhole.yaml\"\nimage_width: {SIZE[0]}\nimage_height: {SIZE[1]}\nestimate_extrinsic: 0\n"
            + opencv("body_T_cam0", T_BC[0]) + opencv("body_T_cam1", T_BC[1]) +
            "acc_n: 0.1\ngyr_n: 0.01\nacc_w: 0.001\ngyr_w: 0.0001\ng_norm: 9.81\ntd: 0.0\nestimate_td: 0\n")


def vins_mono(_):
    R = [row[:3] for row in T_BC[0][:3]]
    return ("%YAML:1.0\nimu_topic: \"/imu0\"\nimage_topic: \"/cam0/image_raw\"\nmodel_type: PINHOLE\ncamera_name: camera\n"
            f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ndistortion_parameters:\n   k1: {D[0]}\n   k2: {D[1]}\n   p1: {D[2]}\n   p2: {D[3]}\n"
            f"projection_parameters:\n   fx: {F[0]}\n   fy: {F[1]}\n   cx: {C[0]}\n   cy: {C[1]}\nestimate_extrinsic: 0\n"
            + opencv("extrinsicRotation", R, 3, 3) + opencv("extrinsicTranslation", [[T_BC[0][i][3]] for i in range(3)], 3, 1) +
            "acc_n: 0.08\ngyr_n: 0.004\nacc_w: 0.00004\ngyr_w: 2.0e-6\ng_norm: 9.81007\ntd: 0.0\nrolling_shutter: 0\n")


def orb_slam3(_):
    names = [("fx", F[0]), ("fy", F[1]), ("cx", C[0]), ("cy", C[1]), ("k1", D[0]), ("k2", D[1]), ("p1", D[2]), ("p2", D[3])]
    second = [("fx", F1[0]), ("fy", F1[1]), ("cx", C1[0]), ("cy", C1[1]), ("k1", D1[0]), ("k2", D1[1]), ("p1", D1[2]), ("p2", D1[3])]
    return ("%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\n" + "".join(f"Camera1.{n}: {v}\n" for n, v in names)
            + "".join(f"Camera2.{n}: {v}\n" for n, v in second) + f"Camera.width: {SIZE[0]}\nCamera.height: {SIZE[1]}\nCamera.fps: 20\nCamera.RGB: 1\nStereo.ThDepth: 60.0\n"
            + opencv("Stereo.T_c1_c2", inverse(T_C1C0)) + opencv("IMU.T_b_c1", T_BC[0])
            + "IMU.NoiseGyro: 1.7e-4\nIMU.NoiseAcc: 2.0e-3\nIMU.GyroWalk: 1.9393e-05\nIMU.AccWalk: 3.0e-03\nIMU.Frequency: 200.0\nORBextractor.nFeatures: 1200\n")


def orb_slam2(_):
    names = [("fx", F[0]), ("fy", F[1]), ("cx", C[0]), ("cy", C[1]), ("k1", D[0]), ("k2", D[1]), ("p1", D[2]), ("p2", D[3]), ("bf", 47.9), ("width", 752), ("height", 480)]
    return "%YAML:1.0\n" + "".join(f"Camera.{n}: {v}\n" for n, v in names) + "Camera.fps: 20.0\nCamera.RGB: 1\nThDepth: 35\nORBextractor.nFeatures: 1200\n"


def kimera(folder):
    for name, k, f, c, d in (("Left", 0, F, C, D), ("Right", 1, F1, C1, D1)):
        (folder / f"{name}CameraParams.yaml").write_text(
            f"%YAML:1.0\ncamera_id: {name.lower()}_cam\nT_BS:\n  cols: 4\n  rows: 4\n  data: {flat(T_BC[k])}\nrate_hz: 20\nresolution: {list(SIZE)}\ncamera_model: pinhole\n"
            f"intrinsics: {[*f, *c]}\ndistortion_model: radial-tangential\ndistortion_coefficients: {list(d)}\n", encoding="utf-8")
    (folder / "ImuParams.yaml").write_text("%YAML:1.0\nimu_preintegration_type: 1\nrate_hz: 200\ngyroscope_noise_density: 1.6968e-04\ngyroscope_random_walk: 1.9393e-05\n"
                                           "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\nT_BS:\n  cols: 4\n  rows: 4\n"
                                           f"  data: {flat([[float(i == j) for j in range(4)] for i in range(4)])}\nimu_time_shift: 0.0\nn_gravity: [0.0, 0.0, -9.81]\n", encoding="utf-8")
    return (folder / "LeftCameraParams.yaml").read_text(encoding="utf-8")


def openvins(folder):
    (folder / "kalibr_imucam_chain.yaml").write_text("%YAML:1.0\n" + kalibr(key="T_imu_cam", inverse_of=lambda T: T), encoding="utf-8")
    (folder / "kalibr_imu_chain.yaml").write_text("%YAML:1.0\nimu0:\n  T_i_b:\n" + rows_of([[float(i == j) for j in range(4)] for i in range(4)], "    ") +
                                                  "\n" + "".join(f"  {line}\n" for line in NOISE.splitlines()) + "  model: kalibr\n  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: 200.0\n", encoding="utf-8")
    return "%YAML:1.0\nverbosity: \"INFO\"\nuse_fej: true\nmax_cameras: 2\nrelative_config_imu: \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n"


def quaternion(T):
    w = math.sqrt(max(0.0, 1 + T[0][0] + T[1][1] + T[2][2])) / 2
    return [(T[2][1] - T[1][2]) / 4 / w, (T[0][2] - T[2][0]) / 4 / w, (T[1][0] - T[0][1]) / 4 / w, w]


def basalt(_):
    def pose(T):
        return dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), [T[i][3] for i in range(3)] + quaternion(T)))
    value = {"T_imu_cam": [pose(T) for T in T_BC],
             "intrinsics": [{"camera_type": "ds", "intrinsics": {"fx": 355.1, "fy": 354.2, "cx": c[0], "cy": c[1], "xi": -0.2, "alpha": 0.55}} for c in (C, C1)],
             "resolution": [list(SIZE)] * 2, "calib_accel_bias": [0.0] * 9, "calib_gyro_bias": [0.0] * 12, "imu_update_rate": 200.0,
             "accel_noise_std": [0.016] * 3, "gyro_noise_std": [0.000282] * 3, "accel_bias_std": [0.001] * 3, "gyro_bias_std": [0.0001] * 3, "cam_time_offset_ns": 0}
    return json.dumps({"value0": value}, indent=1)


def camera_info(_, name="plumb_bob", d=(*D, 0.0)):
    R, P = [1, 0, 0, 0, 1, 0, 0, 0, 1], [435.2, 0, 367.4, 0, 0, 435.2, 252.2, 0, 0, 0, 1, 0]
    def matrix(key, rows, cols, data):
        return f"{key}:\n  rows: {rows}\n  cols: {cols}\n  data: {list(data)}\n"
    return (f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ncamera_name: left\n" + matrix("camera_matrix", 3, 3, [F[0], 0, C[0], 0, F[1], C[1], 0, 0, 1])
            + f"distortion_model: {name}\n" + matrix("distortion_coefficients", 1, len(d), d) + matrix("rectification_matrix", 3, 3, R) + matrix("projection_matrix", 3, 4, P))


def oak(imu=True):
    def camera(k, f, c):
        to_body = inverse(T_BC[k])
        return [k + 1, {"cameraType": 1, "width": SIZE[0], "height": SIZE[1], "distortionCoeff": [*(D if k == 0 else D1), *[0.0] * 10],
                        "intrinsicMatrix": [[f[0], 0, c[0]], [0, f[1], c[1]], [0, 0, 1]],
                        "extrinsics": {"rotationMatrix": [row[:3] for row in (T_C1C0 if k == 0 else to_body)[:3]], "specTranslation": dict(x=0, y=0, z=0), "toCameraSocket": 2 if k == 0 else -1,
                                       "translation": dict(zip("xyz", [100 * T_C1C0[i][3] for i in range(3)] if k == 0 else [0, 0, 0]))}}]
    return json.dumps({"boardName": "OAK", "cameraData": [camera(0, F, C), camera(1, F1, C1)],
                       "imuExtrinsics": {"rotationMatrix": [row[:3] for row in T_BC[0][:3]] if imu else [], "specTranslation": dict(x=0, y=0, z=0),
                                         "toCameraSocket": 1 if imu else -1, "translation": dict(zip("xyz", [100 * T_BC[0][i][3] for i in range(3)]))}, "version": 7})


def table(header, rows, separator=","):
    return header + "".join(separator.join(str(x) for x in row) + "\n" for row in rows)


def poses(stamp, order="xyzw", n=60):
    """Rows of a circle, about the stamps 1 s to 3 s."""
    for i in range(n):
        a = 0.02 * i
        q = dict(zip("xyzw", (0.0, 0.0, math.sin(a / 2), math.cos(a / 2))))
        yield [stamp(1.0 + i / 30), round(math.cos(a), 6), round(math.sin(a), 6), 0.01 * i, *(round(q[k], 8) for k in order)]


def ns(t):
    return int(t * 1e9) + 1403636579000000000


def seconds(t):
    return f"{1403636579 + t:.6f}"


READ = None
FILES = [
    # Calibrations: name, writer, "calibration" or "imu", words of the answer or READ.
    ("Kalibr camchain-imucam.yaml", "camchain-imucam.yaml", lambda _: kalibr(), "calibration", READ),
    ("the same, plumb_bob with k3", "chain5.yaml", lambda _: kalibr("plumb_bob", [(*D, 0.0), (*D1, 0.0)]), "calibration", READ),
    ("the same, RadTan", "radtan.yaml", lambda _: kalibr("RadTan"), "calibration", READ),
    ("the same, equidistant", "equi.yaml", lambda _: kalibr("equidistant", [(0.01, 0.002, -0.001, 0.0002)] * 2), "calibration", READ),
    ("the same, fisheye", "fisheye.yaml", lambda _: kalibr("fisheye", [(0.01, 0.002, -0.001, 0.0002)] * 2), "calibration", READ),
    ("the same, eight coefficients", "rational.yaml", lambda _: kalibr("rational_polynomial", [(*D, 0.01, 0.02, -0.01, 0.003)] * 2), "calibration", READ),
    ("the same, fourteen with thin prism", "thin.yaml", lambda _: kalibr("radtan", [(*D, 0, 0, 0, 0, 0.01, 0.01, 0.02, 0.01, 0, 0)] * 2), "calibration", "thin prism"),
    ("the same, fov", "fov.yaml", lambda _: kalibr("fov", [(0.9,)] * 2), "calibration", "fov"),
    ("the same without T_cam_imu (camchain.yaml)", "camchain.yaml", lambda _: kalibr(key="T_other"), "calibration", "T_cam_imu"),
    ("Kalibr imu.yaml", "imu.yaml", lambda _: NOISE + "rostopic: /imu0\nupdate_rate: 200.0\n", "imu", READ),
    ("the same as --calibration", "imu_as_chain.yaml", lambda _: NOISE + "rostopic: /imu0\nupdate_rate: 200.0\n", "calibration", "--imu-calibration"),
    ("Kalibr target.yaml", "april.yaml", lambda _: "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n", "calibration", "--target"),
    ("imu_utils", "mynteye_imu_param.yaml", lambda _: "%YAML:1.0\n---\ntype: IMU\nname: own\nGyr:\n   unit: \" rad/s\"\n   avg-axis:\n      gyr_n: 1.7e-03\n      gyr_w: 2.1e-05\n"
     "   x-axis:\n      gyr_n: 1.6e-03\n      gyr_w: 2.0e-05\nAcc:\n   unit: \" m/s^2\"\n   avg-axis:\n      acc_n: 1.9e-02\n      acc_w: 4.9e-04\n", "imu", READ),
    ("allan_variance_ros imu.yaml", "allan.yaml", lambda _: "#Accelerometer\naccelerometer_noise_density: 0.0025\naccelerometer_random_walk: 0.0002\n\n#Gyroscope\n"
     "gyroscope_noise_density: 0.00018\ngyroscope_random_walk: 0.00002\n\nrostopic: '/imu0' #Make sure this is correct\nupdate_rate: 200.0 #Make sure this is correct\n", "imu", READ),
    ("VINS-Fusion", "euroc_stereo_imu_config.yaml", vins_fusion, "calibration", READ),
    ("VINS-Mono", "euroc_config.yaml", vins_mono, "calibration", READ),
    ("camodocal's camera alone", "cam_left.yaml", lambda folder: (vins_fusion(folder), (folder / "cam0_pinhole.yaml").read_text())[1], "calibration", "camodocal"),
    ("ORB-SLAM3", "EuRoC.yaml", orb_slam3, "calibration", READ),
    ("ORB-SLAM2, without an IMU", "EuRoC2.yaml", orb_slam2, "calibration", "IMU"),
    ("Kimera-VIO", "LeftCameraParams.yaml", kimera, "calibration", READ),
    ("OpenVINS estimator_config.yaml", "estimator_config.yaml", openvins, "calibration", READ),
    ("Basalt calibration.json", "calibration.json", basalt, "calibration", READ),
    ("Basalt configuration", "euroc_config.json", lambda _: json.dumps({"value0": {"config.optical_flow_type": "frame_to_frame", "config.vio_max_states": 3}}), "calibration", "Basalt"),
    ("ROS camera_info file", "left.yaml", camera_info, "calibration", "camera_info"),
    ("the same, equidistant", "left_eq.yaml", lambda _: camera_info(_, "equidistant", (0.01, 0.002, -0.001, 0.0002)), "calibration", "camera_info"),
    ("a camera_info message as `rostopic echo` prints it", "echo.yaml", lambda _: f"header:\n  seq: 1\n  frame_id: left\nheight: {SIZE[1]}\nwidth: {SIZE[0]}\ndistortion_model: plumb_bob\n"
     f"D: {[*D, 0.0]}\nK: {[F[0], 0.0, C[0], 0.0, F[1], C[1], 0.0, 0.0, 1.0]}\nbinning_x: 0\nbinning_y: 0\n", "calibration", "camera_info"),
    ("OAK's calibration", "oak.json", lambda _: oak(), "calibration", READ),
    ("the same with no IMU calibrated", "oak2.json", lambda _: oak(False), "calibration", "IMU"),
    ("RealSense's IMU (rs-imu-calibration)", "calibration_rs.json", lambda _: json.dumps({"imus": [{
        "accelerometer": {"scale_and_alignment": [1.01, 0, 0, 0, 1.02, 0, 0, 0, 0.99], "bias": [0.1, 0.2, -0.1]},
        "gyroscope": {"scale_and_alignment": [1, 0, 0, 0, 1, 0, 0, 0, 1], "bias": [0.001, -0.002, 0.003]}}]}), "calibration", "--imu-calibration"),
    ("RealSense's settings", "high_accuracy.json", lambda _: json.dumps({"controls-laserpower": "150", "param-depthunits": "1000", "stream-width": "848"}), "calibration", "settings"),
    ("Open3D's intrinsics of a RealSense", "intrinsic.json", lambda _: json.dumps({"width": 640, "height": 480, "intrinsic_matrix": [615.1, 0, 0, 0, 615.3, 0, 320.1, 240.2, 1]}), "calibration", "without"),
    ("rs-enumerate-devices -c", "d435i.txt", lambda _: "Intrinsic of \"Infrared 1\" / 848x480 / {Y8}\n  Width:      \t848\n  Height:     \t480\n  PPX:        \t424.4\n  PPY:        \t237.8\n"
     "  Fx:         \t420.8\n  Fy:         \t420.8\n  Distortion: \tBrown Conrady\n  Coeffs:     \t0  \t0  \t0  \t0  \t0\n", "calibration", "RealSense"),
    ("pyrealsense2's intrinsics as JSON", "infra1.json", lambda _: json.dumps({"width": 848, "height": 480, "ppx": 424.4, "ppy": 237.8, "fx": 420.8, "fy": 420.8, "model": "distortion.brown_conrady", "coeffs": [0] * 5}), "calibration", "RealSense"),
    ("OKVIS", "config_fpga_p2_euroc.yaml", lambda _: "%YAML:1.0\ncameras:\n     - {T_SC:\n        " + str(flat(T_BC[0])) + f",\n        image_dimension: {list(SIZE)},\n        distortion_coefficients: {list(D)},\n"
     f"        distortion_type: radialtangential,\n        focal_length: {list(F)},\n        principal_point: {list(C)}}}\nimu_params:\n  a_max: 176.0\n", "calibration", "OKVIS"),
    ("ROVIO", "rovio.info", lambda _: "Common\n{\n  doVECalibration true\n  depthType 1\n}\nCamera0\n{\n  CalibrationFile ;\n  qCM_x 0.00666398307551\n  qCM_w -0.999\n  MrMC_x -0.0111\n}\n", "calibration", "ROVIO"),
    ("maplab's ncamera", "ncamera.yaml", lambda _: f"label: rig\ncameras:\n  - camera:\n      label: left\n      type: pinhole\n      intrinsics:\n        rows: 4\n        cols: 1\n        data: {[*F, *C]}\n"
     f"    T_B_C:\n      rows: 4\n      cols: 4\n      data: {flat(T_BC[0])}\n", "calibration", "maplab"),
    ("DSO's camera.txt", "camera.txt", lambda _: f"RadTan {F[0]} {F[1]} {C[0]} {C[1]} {D[0]} {D[1]} {D[2]} {D[3]}\n752 480\ncrop\n640 480\n", "calibration", "DSO"),
    ("DM-VIO's camchain", "dmvio.yaml", lambda _: kalibr(), "calibration", READ),
    ("ZED's SN.conf", "SN12345.conf", lambda _: "[LEFT_CAM_HD]\nfx=699.1\nfy=699.2\ncx=640.1\ncy=360.2\nk1=-0.17\nk2=0.02\n\n[RIGHT_CAM_HD]\nfx=700.1\nfy=700.2\ncx=641.0\ncy=361.0\nk1=-0.17\nk2=0.02\n", "calibration", "ZED"),
    ("OpenCV's stereo calibration", "intrinsics.yml", lambda _: "%YAML:1.0\n---\n" + opencv("M1", [[F[0], 0, C[0]], [0, F[1], C[1]], [0, 0, 1]], 3, 3) + opencv("D1", [[*D, 0.0]], 1, 5)
     + opencv("M2", [[F1[0], 0, C1[0]], [0, F1[1], C1[1]], [0, 0, 1]], 3, 3) + opencv("D2", [[*D1, 0.0]], 1, 5), "calibration", "OpenCV"),
    ("the same with K and R, T", "stereo.yml", lambda _: "%YAML:1.0\n---\nimage_width: 752\n" + opencv("K1", [[F[0], 0, C[0]], [0, F[1], C[1]], [0, 0, 1]], 3, 3) + opencv("D1", [[*D]], 1, 4)
     + opencv("K2", [[F1[0], 0, C1[0]], [0, F1[1], C1[1]], [0, 0, 1]], 3, 3) + opencv("D2", [[*D1]], 1, 4) + opencv("R", [row[:3] for row in T_C1C0[:3]], 3, 3)
     + opencv("T", [[T_C1C0[i][3]] for i in range(3)], 3, 1), "calibration", "OpenCV's calibration of a stereo pair"),
    ("Kalibr's results-imucam.txt", "results-imucam.txt", lambda _: "Calibration results\n===================\nNormalized Residuals\n----------------------------\n"
     "Reprojection error (cam0):     mean 0.5, median 0.4, std: 0.3\n\nTransformation (cam0):\n-----------------------\nT_ci:  (imu0 to cam0): \n[[ 0.01 0.99 -0.02 0.06]]\n", "calibration", "camchain-imucam.yaml"),
    ("MATLAB's stereoParameters", "stereoParams.txt", lambda _: f"  stereoParameters with properties:\n\n   CameraParameters1: [1x1 cameraParameters]\n    TranslationOfCamera2: [-110.07 0.39 -0.85]\n", "calibration", "MATLAB"),
    ("Bouguet's Calib_Results.m", "Calib_Results.m", lambda _: f"% Intrinsic and Extrinsic Camera Parameters\nfc = [ {F[0]} ; {F[1]} ];\ncc = [ {C[0]} ; {C[1]} ];\nalpha_c = 0.0;\n", "calibration", "Bouguet"),
    ("Kalibr's chain with tabs", "tabs.yaml", lambda _: kalibr().replace("  camera_model", "\tcamera_model"), "calibration", "tabs.yaml:2: begins with a tab"),
    ("the same with a camera twice", "twice.yaml", lambda _: kalibr() + kalibr()[kalibr().index("cam1:"):], "calibration", "'cam1' is there twice, first in line"),
    ("the same with a focal length as a share", "share.yaml", lambda _: kalibr().replace(str(F[0]), "0.610").replace(str(F[1]), "0.953"), "calibration", "intrinsics: focal lengths of 0.61 and 0.953 px"),
    ("OpenCV's calibration of one camera", "out_camera_data.xml", lambda _: "<?xml version=\"1.0\"?>\n<opencv_storage>\n<camera_matrix type_id=\"opencv-matrix\">\n<rows>3</rows><cols>3</cols><dt>d</dt><data>\n"
     f"{F[0]} 0. {C[0]} 0. {F[1]} {C[1]} 0. 0. 1.</data></camera_matrix>\n<distortion_coefficients type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols><dt>d</dt><data>0 0 0 0 0</data></distortion_coefficients>\n</opencv_storage>\n", "calibration", "OpenCV"),
    ("COLMAP's cameras.txt", "cameras.txt", lambda _: "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n1 OPENCV 752 480 458.6 457.3 367.2 248.4 -0.28 0.07 0.0002 0.00002\n", "calibration", "COLMAP"),
    ("Spectacular AI's calibration", "sai.json", lambda _: json.dumps({"cameras": [{"focalLengthX": F[0], "focalLengthY": F[1], "model": "brown-conrady", "imuToCamera": inverse(T_BC[0])}]}), "calibration", "Spectacular"),
    ("KITTI's calib.txt", "calib.txt", lambda _: "P0: 718.856 0 607.1928 0 0 718.856 185.2157 0 0 0 1 0\nP1: 718.856 0 607.1928 -386.1448 0 718.856 185.2157 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n", "calibration", "KITTI"),
    ("Nerfstudio's transforms.json", "transforms.json", lambda _: json.dumps({"camera_model": "OPENCV", "fl_x": F[0], "fl_y": F[1], "cx": C[0], "cy": C[1], "w": 752, "h": 480, "frames": []}), "calibration", "Nerfstudio"),
    # Trajectories, which `fbvins info` and `eval` read.
    ("TUM's trajectory", "tum.txt", lambda _: table("# timestamp tx ty tz qx qy qz qw\n", poses(seconds), " "), "eval", READ),
    ("EuRoC's truth", "data.csv", lambda _: table("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n", poses(ns, "wxyz")), "eval", READ),
    ("VINS-Fusion's vio.csv", "vio.csv", lambda _: table("", ([*row, 0.1, 0.2, 0.0, ""] for row in poses(ns, "wxyz"))), "eval", READ),
    ("ORB-SLAM3's f_*.txt", "f_dataset.txt", lambda _: table("", ([f"{row[0]:.6f}", *row[1:]] for row in poses(ns)), " "), "eval", READ),
    ("OpenVINS' state_est.txt", "state_est.txt", lambda _: table("# timestamp(s) q p v bg ba cam_imu_dt num_cam\n", ([row[0], *row[4:8], *row[1:4], *[0.0] * 9] for row in poses(seconds)), " "), "eval", READ),
    ("Kimera-VIO's traj_vio.csv", "traj_vio.csv", lambda _: table("#timestamp,x,y,z,qw,qx,qy,qz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n", ([*row, *[0.0] * 9] for row in poses(ns, "wxyz"))), "eval", READ),
    ("Basalt's trajectory.txt", "trajectory.txt", lambda _: table("# timestamp tx ty tz qx qy qz qw\n", poses(seconds), " "), "eval", READ),
    ("KITTI's poses", "00.txt", lambda _: table("", ([1, 0, 0, row[1], 0, 1, 0, row[2], 0, 0, 1, row[3]] for row in poses(seconds)), " "), "info", "KITTI"),
    ("COLMAP's images.txt", "images.txt", lambda _: "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n1 1 0 0 0 0.1 0.2 0.3 1 0001.png\n\n", "info", "COLMAP"),
    ("g2o's graph", "poses.g2o", lambda _: "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0.1 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1 0.1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n", "info", "g2o"),
    # What is no calibration and no trajectory.
    ("a log of PX4", "log.ulg", lambda _: b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 123), "info", "PX4"),
    ("a log of ArduPilot", "00000001.BIN", lambda _: b"\xa3\x95\x80" + bytes(90), "info", "ArduPilot"),
    ("a film (MP4)", "flight.mp4", lambda _: struct.pack(">I", 32) + b"ftypisom" + bytes(24), "info", "film"),
    ("a cloud of points (PLY)", "map.ply", lambda _: "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "info", "points"),
    ("a cloud of points (PCD)", "map.pcd", lambda _: "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n", "info", "points"),
    ("HDF5", "flight.h5", lambda _: b"\x89HDF\r\n\x1a\n" + bytes(64), "info", "HDF5"),
    ("an archive (tar.gz)", "mh01.tar.gz", lambda _: b"\x1f\x8b\x08" + bytes(64), "info", "archive"),
    ("ORB-SLAM's vocabulary", "ORBvoc.txt", lambda _: "10 6  0 0 \n0 0 252 188 188 242 169 109 85 143 187 191 164 25 222 255 72 27 129 215 237 16 58 111 219 51 219 211 85 127 192 112 134 34  0\n", "info", "vocabulary"),
]


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False)


def answer(recording, truth, path, use):
    if use == "calibration":
        return run("info", recording, "--calibration", path)
    if use == "imu":
        return run("info", recording, "--imu-calibration", path)
    return run("eval", truth, path) if use == "eval" else run("info", path)


def main():
    faults, rows = [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        recording = folder / "recording"
        made = run("simulate", "--seconds", 2, "--max-images", 3, "--out", recording, "--quiet")
        assert made.returncode == 0, made.stderr
        chain_file = folder / "chain.yaml"
        chain_file.write_text(kalibr(), encoding="utf-8")
        truth = folder / "truth.txt"
        truth.write_text(table("", poses(seconds), " "), encoding="utf-8")
        for number, (what, name, writer, use, expected) in enumerate(FILES):
            place = folder / str(number)
            place.mkdir()
            content = writer(place)
            path = place / name
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
            done, known = answer(recording, truth, path, use), run("info", path)
            said = (done.stdout + done.stderr).strip()
            if expected is READ:
                good = done.returncode == 0
            else:
                good = expected in said and (use == "info" or done.returncode == 2) and "missing or empty" not in said
            if not good or done.returncode < 0 or "internal" in said:
                faults.append(f"{what} ({name}, {use}): exit {done.returncode}\n  {said[-400:]}")
            if known.returncode != 0 or not known.stdout.strip():
                faults.append(f"{what} ({name}): fbvins info does not know it\n  {(known.stdout + known.stderr)[-300:]}")
            rows.append((what, use, "read" if expected is READ else said.splitlines()[-1].split(str(place) + "/")[-1]))
        # With the recording's own cameras a place and a clock of the IMU count as they do with Kalibr's chain.
        placed = folder / "placed.yaml"
        placed.write_text("imu0:\n  T_i_b:\n" + rows_of([[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) + "\n  time_offset: 0.004\n  update_rate: 200.0\n"
                          + "".join(f"  {line}\n" for line in NOISE.splitlines()), encoding="utf-8")
        shown = run("info", recording, "--imu-calibration", placed, "--json")
        assert shown.returncode == 0, shown
        about = json.loads(shown.stdout)
        assert about["time_offset_s"] == -0.004, about
        # A chain that contradicts itself is read, with a warning.
        chain = kalibr()
        at = chain.index("T_cn_cnm1")
        (folder / "contradicts.yaml").write_text(chain[:at] + chain[at:].replace(str(T_C1C0[0][3]), "-0.2"), encoding="utf-8")
        doubted = run("info", recording, "--calibration", folder / "contradicts.yaml")
        assert doubted.returncode == 0 and "apart by the one, 0.1101 m by the other" in doubted.stderr, doubted
        assert "contradicts" not in run("info", recording, "--calibration", chain_file).stderr
        # Folders of other systems.
        for make in (kimera, openvins):
            place = folder / make.__name__
            place.mkdir()
            (place / "estimator_config.yaml").write_text(make(place), encoding="utf-8") if make is openvins else make(place)
            assert "baseline 0.1101 m" in run("info", recording, "--calibration", place).stdout, make
        # Lenses of camera_info, of which a folder has no places, and a bag without /tf_static neither.
        pair = f"{folder / 'l.yaml'},{folder / 'r.yaml'}"
        for side in "lr":
            (folder / f"{side}.yaml").write_text(camera_info(None), encoding="utf-8")
        refused = run("info", recording, "--calibration", pair)
        assert refused.returncode == 2 and "camera_info file of ROS, without the camera's place" in refused.stderr, refused
        (folder / "r.yaml").unlink()
        refused = run("run", recording, "--calibration", pair, "--out", folder / "none")
        assert refused.returncode == 2 and f"{folder / 'r.yaml'}: no such file" in refused.stderr, refused
        # A calibration that cannot be used is no success, whatever else is known of the recording.
        for kind, path in (("--calibration", folder / "truth.txt"), ("--imu-calibration", folder / "nothing.yaml")):
            refused = run("info", recording, kind, path)
            assert refused.returncode == 2 and str(path) in refused.stderr, refused
        (recording / "mav0" / "cam0" / "data.csv").write_text("#timestamp [ns],filename\n", encoding="utf-8")
        refused = run("info", recording)
        assert refused.returncode == 2 and "cam0" in refused.stderr, refused
    if "--table" in sys.argv:
        for what, use, said in rows:
            print(f"| {what} | {'' if use in ('eval', 'info') else '--imu-' if use == 'imu' else '--'}{use if use != 'imu' else 'calibration'} | {said} |")
    assert len(FILES) >= 50, len(FILES)
    print("\n".join(faults) or f"{len(FILES)} files of others: {sum(f[4] is READ for f in FILES)} read, the others named")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

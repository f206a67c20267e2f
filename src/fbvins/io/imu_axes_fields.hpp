// SPDX-License-Identifier: Apache-2.0
// Not public: scale and axes of an IMU (ImuIntrinsics) in calibration files, as Kalibr, OpenVINS, RealSense and Basalt write
// them.
//
//   ImuIntrinsics axes = read_imu_axes(yaml, yaml.root());   // none of the fields: an IMU without errors
//
// Kalibr (`--imu-models scale-misalignment`), x in the frame of the IMU, which is that of the accelerometer:
//   gyroscope = M C_gyro_i w + A C_gyro_i f, accelerometer = M f; fields gyroscopes: M, A, C_gyro_i; accelerometers: M
// OpenVINS: gyroscope = Tw R_IMUtoGYRO w + Tg f, accelerometer = Ta R_IMUtoACC f
// RealSense and Basalt say what is made of a reading: S reading - b; (1 + S) reading - b.
// Kalibr's files have no biases: gyroscope_bias and accelerometer_bias beside the noise are fields of ours.
#pragma once

#include <string>

#include "fbvins/io/yaml_reader.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Of Kalibr's or OpenVINS' fields in the map of an IMU; complains where they are no axes that an IMU has.
ImuIntrinsics read_imu_axes(YamlReader& yaml, const YAML::Node& map);
/// As Kalibr's fields, each line after `indent`; empty for an IMU without errors. `exact`: M and C_gyro_i as one matrix, to the
/// last bit; else M is triangular, as Kalibr's.
std::string imu_axes_text(const ImuIntrinsics& axes, const std::string& indent, bool exact);

/// Whether it is the file of RealSense's rs-imu-calibration.py, which has no noise figures.
bool is_realsense_imu(const YamlReader& yaml);
ImuIntrinsics read_realsense_imu(YamlReader& yaml);

/// Basalt's calib_gyro_bias and calib_accel_bias.
ImuIntrinsics read_basalt_axes(YamlReader& yaml, const YAML::Node& map);

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/calibration_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/imu_axes_fields.hpp"

namespace fbvins {
namespace {

/// With a point: Kalibr wants floating point numbers, and PyYAML takes 458 for an integer, 1e-5 for a word.
std::string kalibr_number(double value) {
  std::string out = fmt::format("{:.17g}", value);
  if (out.find('.') == std::string::npos) out.insert(std::min(out.find('e'), out.size()), ".0");
  return out;
}

std::string kalibr_list(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += (out.empty() ? "" : ", ") + kalibr_number(value);
  return "[" + out + "]";
}

template <class To, class From>
std::string matrix(const std::string& name, const Pose<To, From>& T) {
  const Mat3 R = T.R();
  std::string out = fmt::format("  {}:\n", name);
  for (int row = 0; row < 3; ++row) out += "  - " + kalibr_list({R(row, 0), R(row, 1), R(row, 2), T.p[row]}) + "\n";
  return out + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

/// pinhole-radtan, pinhole-radtan5, pinhole-rational.
bool takes_opencv(const std::string& model) { return model.starts_with("pinhole-ra"); }

std::string basalt_lens(const Camera& camera) {
  const std::array<double, 4> f = camera.intrinsics();
  const std::vector<double> k = camera.distortion();
  std::string out = fmt::format("\"fx\": {:.17g}, \"fy\": {:.17g}, \"cx\": {:.17g}, \"cy\": {:.17g}", f[0], f[1], f[2], f[3]);
  const auto add = [&](const char* name, double value) { out += fmt::format(", \"{}\": {:.17g}", name, value); };
  const std::string model = camera.model_name();
  if (model == "ds") add("xi", k[0]), add("alpha", k[1]);
  if (model == "eucm") add("alpha", k[0]), add("beta", k[1]);
  if (model == "pinhole-equidistant")
    for (int i = 0; i < 4; ++i) add(fmt::format("k{}", i + 1).c_str(), k[i]);
  if (!takes_opencv(model)) return out;
  std::vector<double> eight = k;
  eight.resize(8, 0.0);
  constexpr const char* kNames[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  for (std::size_t i = 0; i < eight.size(); ++i) add(kNames[i], eight[i]);
  // Basalt ends the model where it stops growing; 0: it searches for the radius itself.
  add("rpmax", 0);
  return out;
}

const char* basalt_name(const std::string& model) {
  if (takes_opencv(model)) return "pinhole-radtan8";
  if (model == "pinhole-equidistant") return "kb4";
  return model == "ds" ? "ds" : "eucm";
}

struct BasaltAxes {
  std::vector<double> accel, gyro;  ///< calib_accel_bias and calib_gyro_bias
};

/// (1 + S) reading - b; of the accelerometer S is lower triangular, and the gyroscope feels no force.
Result<BasaltAxes> basalt_axes(const ImuIntrinsics& axes) {
  const Mat3 accel = axes.accel.inverse(), gyro = axes.gyro.inverse(), S = accel - Mat3::Identity(), G = gyro - Mat3::Identity();
  const Vec3 ba = accel * axes.bias.accel_mps2, bg = gyro * axes.bias.gyro_radps;
  constexpr double kNone = 1e-9;
  if (Vec3(S(0, 1), S(0, 2), S(1, 2)).cwiseAbs().maxCoeff() > kNone || axes.gyro_by_force.cwiseAbs().maxCoeff() > kNone)
    return Error{ErrorCode::unsupported,
                 "Basalt has no model of an accelerometer turned against the IMU, nor of a gyroscope that feels forces"};
  return BasaltAxes{{ba.x(), ba.y(), ba.z(), S(0, 0), S(1, 0), S(2, 0), S(1, 1), S(2, 1), S(2, 2)},
                    {bg.x(), bg.y(), bg.z(), G(0, 0), G(1, 0), G(2, 0), G(0, 1), G(1, 1), G(2, 1), G(0, 2), G(1, 2), G(2, 2)}};
}

std::string three(double value) { return yaml_list({value, value, value}); }

}  // namespace

RigCalibration rig_calibration(const CameraCalibration& cameras) {
  RigCalibration out;
  for (const CalibratedCamera& camera : cameras.cameras) {
    out.cameras.push_back(camera.camera);
    out.T_CnC0.push_back(camera.T_CnC0);
  }
  return out;
}

RigCalibration rig_calibration(const CameraCalibration& cameras, const CameraImuResult& imu, const ImuNoise& noise) {
  RigCalibration out = rig_calibration(cameras);
  for (std::size_t k = 0; k < imu.cameras.size(); ++k) {
    const CameraOnImu& camera = imu.cameras[k];
    out.T_BC.push_back(camera.T_BC);
    out.cameras[k].set_own_times({camera.later_s, 0});
  }
  out.time_offset_s = imu.time_offset_s, out.line_delay_s = imu.line_delay_s;
  out.imu_noise = noise;
  if (imu.axes_sigma.gyro != Mat3::Zero()) out.imu_noise.axes = {.gyro = imu.axes.gyro, .accel = imu.axes.accel};
  return out;
}

RigCalibration rig_calibration(const StereoRig& rig) {
  RigCalibration out;
  for (int i = 0; i < rig.camera_count(); ++i) {
    out.cameras.push_back(rig.camera(i));
    out.T_CnC0.push_back((rig.T_BC(i).inverse() * rig.T_BC0()).cast_frames<Cn, C0>());
    out.T_BC.push_back(rig.T_BC(i).cast_frames<B, Cn>());
  }
  out.time_offset_s = rig.time_offset_s;
  out.imu_noise = rig.imu_noise;
  out.line_delay_s = rig.line_delay_s;
  return out;
}

std::string to_kalibr_camchain(const RigCalibration& rig) {
  std::string out;
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const KalibrCamera camera = kalibr_camera(rig.cameras[k]);
    out += fmt::format("cam{}:\n", k);
    if (!rig.T_BC.empty()) out += matrix("T_cam_imu", rig.T_BC[k].inverse());
    if (k > 0) out += matrix("T_cn_cnm1", rig.T_CnC0[k] * rig.T_CnC0[k - 1].inverse());
    out += fmt::format(
        "  camera_model: {}\n  distortion_coeffs: {}\n  distortion_model: {}\n  intrinsics: {}\n  resolution: [{}, {}]\n"
        "  rostopic: /cam{}/image_raw\n",
        camera.model, kalibr_list(camera.coefficients), camera.distortion, kalibr_list(camera.intrinsics), rig.cameras[k].width(),
        rig.cameras[k].height(), k);
    out += mask_text(rig.cameras[k], "  ");
    const CameraTimes& own = rig.cameras[k].own_times();
    if (const double delay_s = rig.line_delay_s + own.line_delay_s; delay_s != 0)
      out += fmt::format("  line_delay: {}\n", kalibr_number(delay_s));
    if (!rig.T_BC.empty()) out += fmt::format("  timeshift_cam_imu: {}\n", kalibr_number(rig.time_offset_s + own.time_offset_s));
  }
  return out;
}

std::string to_kalibr_imu(const ImuNoise& noise) {
  const ImuNoise usual;
  std::string ranges;  // which Kalibr does not know
  if (noise.max_gyro_radps != usual.max_gyro_radps)
    ranges += fmt::format("gyroscope_range: {}\n", kalibr_number(noise.max_gyro_radps));
  if (noise.max_accel_mps2 != usual.max_accel_mps2)
    ranges += fmt::format("accelerometer_range: {}\n", kalibr_number(noise.max_accel_mps2));
  return ranges +
         fmt::format(
             "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\ngyroscope_noise_density: {}\n"
             "gyroscope_random_walk: {}\nrostopic: /imu0\nupdate_rate: {}\n",
             kalibr_number(noise.accel_noise_density_mps2_rthz), kalibr_number(noise.accel_random_walk_mps3_rthz),
             kalibr_number(noise.gyro_noise_density_radps_rthz), kalibr_number(noise.gyro_random_walk_radps2_rthz),
             kalibr_number(noise.rate_hz)) +
         imu_axes_text(noise.axes, "", false);
}

std::string to_kalibr_rig(const RigCalibration& rig) {
  std::string imu = "imu0:\n";
  const std::string figures = to_kalibr_imu(rig.imu_noise);
  for (std::size_t at = 0; at < figures.size(); at = figures.find('\n', at) + 1)
    imu += "  " + figures.substr(at, figures.find('\n', at) + 1 - at);  // with its own indentation
  return to_kalibr_camchain(rig) + imu;
}

Result<std::string> to_basalt(const RigCalibration& rig) {
  std::string poses, lenses, sizes, vignettes;
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const std::string model = rig.cameras[k].model_name();
    if (model == "omni-radtan") return Error{ErrorCode::unsupported, "Basalt has no model of omni-radtan lenses"};
    const Pose<Cn, C0> T = rig.T_CnC0[k];
    const Pose<B, Cn> T_BC = rig.T_BC.empty() ? Pose<B, Cn>(T.inverse().q, T.inverse().p) : rig.T_BC[k];
    const char* comma = k > 0 ? ",\n" : "\n";
    poses += fmt::format(
        "{}      {{\"px\": {:.17g}, \"py\": {:.17g}, \"pz\": {:.17g}, \"qx\": {:.17g}, \"qy\": {:.17g}, \"qz\": {:.17g}, \"qw\": {:.17g}}}",
        comma, T_BC.p.x(), T_BC.p.y(), T_BC.p.z(), T_BC.q.x(), T_BC.q.y(), T_BC.q.z(), T_BC.q.w());
    lenses += fmt::format("{}      {{\"camera_type\": \"{}\", \"intrinsics\": {{{}}}}}", comma, basalt_name(model),
                          basalt_lens(rig.cameras[k]));
    sizes += fmt::format("{}[{}, {}]", k > 0 ? ", " : "", rig.cameras[k].width(), rig.cameras[k].height());
  }
  const ImuNoise& n = rig.imu_noise;
  const Result<BasaltAxes> axes = basalt_axes(n.axes);
  if (!axes) return axes.error();
  return fmt::format(
      "{{\n  \"value0\": {{\n    \"T_imu_cam\": [{}\n    ],\n    \"intrinsics\": [{}\n    ],\n    \"resolution\": [{}],\n"
      "    \"calib_accel_bias\": {},\n    \"calib_gyro_bias\": {},\n    \"imu_update_rate\": {:.17g},\n"
      "    \"accel_noise_std\": {},\n    \"gyro_noise_std\": {},\n    \"accel_bias_std\": {},\n    \"gyro_bias_std\": {},\n"
      "    \"cam_time_offset_ns\": {},\n    \"vignette\": []\n  }}\n}}\n",
      poses, lenses, sizes, yaml_list(axes->accel), yaml_list(axes->gyro), n.rate_hz, three(n.accel_noise_density_mps2_rthz),
      three(n.gyro_noise_density_radps_rthz), three(n.accel_random_walk_mps3_rthz), three(n.gyro_random_walk_radps2_rthz),
      std::llround(1e9 * rig.time_offset_s));
}

Result<std::string> to_ros_camera_info(const RigCalibration& rig, int camera) {
  const Camera& c = rig.cameras[camera];
  const std::string model = c.model_name();
  if (!model.starts_with("pinhole")) return Error{ErrorCode::unsupported, fmt::format("ROS has no model of {} lenses", model)};
  const std::array<double, 4> f = c.intrinsics();
  const auto [ros_model, d] = opencv_coefficients(c);
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: cam{}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: {}\n"
      "distortion_model: {}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  data: {}\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: {}\n",
      c.width(), c.height(), camera, yaml_list({f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1}), ros_model, d.size(), yaml_list(d),
      yaml_list({f[0], 0, f[2], 0, 0, f[1], f[3], 0, 0, 0, 1, 0}));
}

}  // namespace fbvins

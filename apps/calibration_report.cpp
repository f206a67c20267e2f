// SPDX-License-Identifier: Apache-2.0
#include "apps/calibration_report.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "apps/calibration_page.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/core/angle.hpp"

namespace fbvins::app {
namespace {

using Json = nlohmann::ordered_json;
Json parameters_json(const std::vector<CalibratedParameter>& parameters) {
  Json out = Json::object();
  for (const CalibratedParameter& p : parameters) out[p.name] = {{"value", p.value}, {"sigma", p.sigma}, {"unit", p.unit}};
  return out;
}

Json matrix_json(const Eigen::MatrixXd& m) {
  Json out = Json::array();
  for (Eigen::Index row = 0; row < m.rows(); ++row) {
    out.push_back(Json::array());
    for (Eigen::Index column = 0; column < m.cols(); ++column) out.back().push_back(m(row, column));
  }
  return out;
}

template <class To, class From>
Json pose_json(const Pose<To, From>& T) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = T.R();
  m.topRightCorner<3, 1>() = T.p;
  return matrix_json(m);
}

Json board_json(const Board& board) {
  const char* kind = board.kind == BoardKind::aprilgrid ? "aprilgrid"
                     : board.kind == BoardKind::charuco ? "charuco"
                                                        : "checkerboard";
  return {{"kind", kind}, {"columns", board.columns}, {"rows", board.rows}, {"size_m", board.size_m}, {"spacing", board.spacing}};
}

Json camera_json(const CalibratedCamera& c) {
  Json out = {{"model", c.camera.model_name()},
              {"resolution", {c.camera.width(), c.camera.height()}},
              {"T_cam_cam0", pose_json(c.T_CnC0)}};
  const ReprojectionStatistics& s = c.statistics;
  out["reprojection"] = {{"rms_px", s.rms_px},   {"largest_px", s.largest_px},     {"views", s.views},
                         {"corners", s.corners}, {"corners_left_out", s.left_out}, {"coverage", s.coverage}};
  for (const auto& [model, px] : c.held_out_px) out["held_out_px"][model] = std::isfinite(px) ? Json(px) : Json();
  return out;
}

Json imu_json(const CameraImuResult& imu) {
  Json out;
  for (const CameraOnImu& c : imu.cameras)
    out["cameras"].push_back({{"T_imu_cam", pose_json(c.T_BC)},
                              {"covariance", matrix_json(c.covariance)},
                              {"later_s", c.later_s},
                              {"later_sigma_s", c.later_sigma_s},
                              {"rms_px", c.rms_px},
                              {"views", c.views},
                              {"corners", c.corners},
                              {"outliers", c.outliers}});
  out["time_offset_s"] = imu.time_offset_s;
  out["time_offset_sigma_s"] = imu.time_offset_sigma_s;
  out["line_delay_s"] = imu.line_delay_s;
  out["line_delay_sigma_s"] = imu.line_delay_sigma_s;
  out["gravity_in_board_mps2"] = {imu.gravity_T.x(), imu.gravity_T.y(), imu.gravity_T.z()};
  out["measured_gravity_mps2"] = imu.measured_gravity_mps2;
  out["measured_gravity_sigma_mps2"] = imu.measured_gravity_sigma_mps2;
  out["board_scale"] = imu.board_scale;
  out["board_scale_sigma"] = imu.board_scale_sigma;
  out["corner_sigma_px"] = imu.corner_sigma_px;
  out["image_factor"] = imu.image_factor;
  out["stamp_jitter_s"] = imu.stamp_jitter_s;
  out["gyro_rms_sigmas"] = imu.gyro_rms_sigmas;
  out["accel_rms_sigmas"] = imu.accel_rms_sigmas;
  out["readings"] = imu.readings;
  out["readings_refused"] = imu.readings_refused;
  out["duration_s"] = imu.duration_s;
  out["parameters"] = parameters_json(imu.parameters);
  out["covariance"] = matrix_json(imu.covariance);
  for (const BiasAt& b : imu.biases)
    out["biases"].push_back({{"t_ns", b.t.ns},
                             {"gyro_radps", {b.bias.gyro_radps.x(), b.bias.gyro_radps.y(), b.bias.gyro_radps.z()}},
                             {"accel_mps2", {b.bias.accel_mps2.x(), b.bias.accel_mps2.y(), b.bias.accel_mps2.z()}}});
  return out;
}

RigCalibration rig_of(const CalibrationOutcome& outcome) {
  return outcome.imu ? rig_calibration(outcome.cameras, *outcome.imu, outcome.imu_noise) : rig_calibration(outcome.cameras);
}

std::string lines_of(const std::vector<CalibratedParameter>& parameters) {
  std::string out;
  for (const CalibratedParameter& p : parameters)
    out += fmt::format("  {:<22} {:>14.6f} +- {:<10.2g} {}\n", p.name, p.value, p.sigma, p.unit);
  return out;
}

}  // namespace

std::vector<std::string> all_remarks(const CalibrationOutcome& outcome) {
  std::vector<std::string> out = outcome.cameras.remarks;
  if (outcome.imu) out.insert(out.end(), outcome.imu->remarks.begin(), outcome.imu->remarks.end());
  out.insert(out.end(), outcome.remarks.begin(), outcome.remarks.end());
  return out;
}

std::vector<CalibratedParameter> camera_parameters(const CameraCalibration& cameras) {
  std::map<std::string, std::pair<double, const char*>> values;
  for (std::size_t k = 0; k < cameras.cameras.size(); ++k) {
    const CalibratedCamera& camera = cameras.cameras[k];
    const std::vector<std::string> names = lens_parameter_names(camera.camera.model());
    const std::vector<double> lens = lens_parameters(camera.camera.model());
    for (std::size_t i = 0; i < lens.size(); ++i) values[fmt::format("cam{}.{}", k, names[i])] = {lens[i], i < 4 ? "px" : ""};
    const Vec3 r = so3_log(camera.T_CnC0.q);
    for (int i = 0; i < 3; ++i) {
      values[fmt::format("cam{}.p{}", k, "xyz"[i])] = {camera.T_CnC0.p[i], "m"};
      values[fmt::format("cam{}.r{}", k, "xyz"[i])] = {r[i], "rad"};
    }
  }
  std::vector<CalibratedParameter> out;
  for (const std::string& name : cameras.names)
    out.push_back({name, values[name].second, values[name].first, cameras.sigma(name)});
  return out;
}

std::string calibration_text(const CalibrationOutcome& outcome) {
  const CameraCalibration& found = outcome.cameras;
  std::string out = fmt::format("{}; {} of {} stamps used; noise of a corner {:.3f} px\n", outcome.board.describe(),
                                found.poses.size(), found.stamps, found.noise_px);
  for (std::size_t k = 0; k < found.cameras.size(); ++k) {
    const CalibratedCamera& c = found.cameras[k];
    out +=
        fmt::format("cam{}: {}, {} x {}; {} views, {} corners, {} left out; residual {:.3f} px, {:.0f} % of the image covered\n",
                    k, c.camera.model_name(), c.camera.width(), c.camera.height(), c.statistics.views, c.statistics.corners,
                    c.statistics.left_out, c.statistics.rms_px, 100 * c.statistics.coverage);
    for (const auto& [model, px] : c.held_out_px) out += fmt::format("  held-out error of {:<20} {:.4f} px\n", model, px);
  }
  for (std::size_t k = 1; k < found.cameras.size(); ++k) {
    const Pose<Cn, C0>& T = found.cameras[k].T_CnC0;
    out += fmt::format("cam0 to cam{}: baseline {:.3f} mm, turned by {:.4f} degrees\n", k, 1e3 * T.p.norm(),
                       kDegreesPerRad * so3_log(T.q).norm());
  }
  out += "cameras (cam1.p, cam1.r: T_cam1_cam0)\n" + lines_of(camera_parameters(found));
  if (outcome.imu) {
    const CameraImuResult& imu = *outcome.imu;
    out += fmt::format(
        "IMU: {} readings in {:.1f} s, {} refused; residuals {:.2f} and {:.2f} sigmas (gyroscope, accelerometer), {:.3f} px\n",
        imu.readings, imu.duration_s, imu.readings_refused, imu.gyro_rms_sigmas, imu.accel_rms_sigmas, imu.corner_sigma_px);
    out += lines_of(imu.parameters);
  }
  for (const WeakPart& part : outcome.weak) out += fmt::format("weak: {}\n", sentence(part));
  for (const std::string& remark : all_remarks(outcome)) out += fmt::format("note: {}\n", remark);
  return out;
}

std::string calibration_summary_json(const CalibrationOutcome& outcome) {
  const CameraCalibration& found = outcome.cameras;
  Json out = {{"version", FBVINS_VERSION}, {"board", board_json(outcome.board)}};
  out["noise_px"] = found.noise_px;
  out["scatter"] = found.scatter;
  out["stamps"] = found.stamps;
  out["stamps_used"] = found.poses.size();
  for (const CalibratedCamera& camera : found.cameras) out["cameras"].push_back(camera_json(camera));
  out["parameters"] = parameters_json(camera_parameters(found));
  out["covariance"] = {{"names", found.names}, {"matrix", matrix_json(found.covariance)}};
  if (outcome.imu) out["imu"] = imu_json(*outcome.imu);
  out["weak"] = Json::array();
  for (const WeakPart& part : outcome.weak)
    out["weak"].push_back(
        {{"what", part.what}, {"sigma", part.sigma}, {"aim", part.aim}, {"unit", part.unit}, {"advice", part.advice}});
  out["remarks"] = all_remarks(outcome);
  return out.dump(1) + "\n";
}

std::vector<NamedText> rig_files(const RigCalibration& rig) {
  const bool with_imu = !rig.T_BC.empty();
  std::vector<NamedText> files = {{with_imu ? "camchain-imucam.yaml" : "camchain.yaml", to_kalibr_camchain(rig)}};
  if (with_imu) files.push_back({"imu.yaml", to_kalibr_imu(rig.imu_noise)});
  if (Result<std::string> basalt = to_basalt(rig); basalt) files.push_back({"calibration.json", *basalt});
  for (std::size_t k = 0; k < rig.cameras.size(); ++k)
    if (Result<std::string> ros = to_ros_camera_info(rig, static_cast<int>(k)); ros)
      files.push_back({fmt::format("camera_info_cam{}.yaml", k), *ros});
  return files;
}

Result<void> write_calibration(const CalibrationOutcome& outcome, const std::string& folder) {
  std::vector<NamedText> files = rig_files(rig_of(outcome));
  files.insert(files.end(), {{"summary.json", calibration_summary_json(outcome)},
                             {"calibration.txt", calibration_text(outcome)},
                             {"calibration.html", calibration_html(outcome)}});
  return write_files(folder, files);
}

}  // namespace fbvins::app

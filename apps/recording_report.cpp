// SPDX-License-Identifier: Apache-2.0
#include "apps/recording_report.hpp"

#include <vector>

namespace fbvins::app {
namespace {

std::vector<double> row_major(const auto& pose) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = pose.R();
  return {R(0, 0), R(0, 1), R(0, 2), pose.p.x(), R(1, 0), R(1, 1), R(1, 2), pose.p.y(),
          R(2, 0), R(2, 1), R(2, 2), pose.p.z(), 0,       0,       0,       1};
}

std::vector<double> parameters_of(const Camera& camera) {
  const std::array<double, 4> f = camera.intrinsics();
  std::vector<double> out(f.begin(), f.end());
  const std::vector<double> k = camera.distortion();
  out.insert(out.end(), k.begin(), k.end());
  return out;
}

Json counts_json(const CameraInfo& info) {
  return Json{
      {"images", info.listed}, {"rows_left_out", info.rows.bad()}, {"unpaired", info.unpaired}, {"missing", info.images.missing}};
}

Json camera_json(const StereoRig& rig, int number) {
  const auto& [camera, T_BC] = rig.mounted(number);
  const auto [time_offset_s, line_delay_s] = rig.times(number);
  return Json{{"model", camera.model_name()},
              {"width", camera.width()},
              {"height", camera.height()},
              {"masked_share", camera.mask() ? camera.mask()->hidden_share() : 0.0},
              {"fx_fy_cx_cy_distortion", parameters_of(camera)},
              {"T_BC_row_major", row_major(T_BC)},
              {"time_offset_s", time_offset_s},
              {"line_delay_s", line_delay_s}};
}

Json camera_json(const StereoRig& rig, int number, const CameraInfo& info) {
  Json out = counts_json(info);
  out.update(camera_json(rig, number));
  return out;
}

/// Of the cameras from number 2 on: their counts together, and each calibration.
Json more_json(const StereoRig& rig, const CameraInfo& info) {
  Json out = counts_json(info);
  out["cameras"] = Json::array();
  for (int i = 2; i < rig.camera_count(); ++i) out["cameras"].push_back(camera_json(rig, i));
  return out;
}

Json rows_json(const Mat3& m) {
  Json out = Json::array();
  for (int row = 0; row < 3; ++row) out.push_back({m(row, 0), m(row, 1), m(row, 2)});
  return out;
}

/// Scale and axes, where the calibration has them; none: null.
Json axes_json(const ImuIntrinsics& axes) {
  if (axes == ImuIntrinsics{}) return {};
  const Vec3 &bg = axes.bias.gyro_radps, &ba = axes.bias.accel_mps2;
  return Json{{"gyro", rows_json(axes.gyro)},
              {"accel", rows_json(axes.accel)},
              {"gyro_by_force", rows_json(axes.gyro_by_force)},
              {"gyro_bias_radps", {bg.x(), bg.y(), bg.z()}},
              {"accel_bias_mps2", {ba.x(), ba.y(), ba.z()}}};
}

}  // namespace

Json describe(const Dataset& data) {
  const DatasetInfo& info = data.info();
  const StereoRig& rig = data.rig();
  Json json{{"name", info.name}, {"format", info.format}, {"frames", info.frames}};
  json["duration_s"] = (info.last_image - info.first_image).seconds();
  json["first_image_ns"] = info.first_image.ns;
  json["last_image_ns"] = info.last_image.ns;
  json["image_rate_hz"] = info.image_rate_hz;
  json["longest_image_gap_s"] = info.longest_image_gap.seconds();
  json["imu"] = Json{{"samples", info.imu_samples},
                     {"rows_left_out", info.imu_rows.bad()},
                     {"rate_hz", info.imu_rate_hz},
                     {"longest_gap_s", info.longest_imu_gap.seconds()},
                     {"first_ns", info.first_imu.ns},
                     {"last_ns", info.last_imu.ns},
                     {"gyro_noise_density_radps_rthz", rig.imu_noise.gyro_noise_density_radps_rthz},
                     {"accel_noise_density_mps2_rthz", rig.imu_noise.accel_noise_density_mps2_rthz},
                     {"gyro_random_walk_radps2_rthz", rig.imu_noise.gyro_random_walk_radps2_rthz},
                     {"accel_random_walk_mps3_rthz", rig.imu_noise.accel_random_walk_mps3_rthz},
                     {"axes", axes_json(rig.imu_noise.axes)}};
  for (const AidingCount& sensor : info.aiding)
    json["aiding"][sensor.name] = Json{{"readings", sensor.readings}, {"rate_hz", sensor.rate_hz}};
  json["left"] = camera_json(rig, 0, info.camera(0));
  if (rig.has_right()) json["right"] = camera_json(rig, 1, info.camera(1));
  if (rig.camera_count() > 2) json["more"] = more_json(rig, info.further());
  if (rig.depth)
    json["depth"] = Json{{"images", info.depth.listed},
                         {"noise_at_1m_m", rig.depth->noise_at_1m_m},
                         {"nearest_m", rig.depth->nearest_m},
                         {"farthest_m", rig.depth->farthest_m},
                         {"scale_sigma", rig.depth->scale_sigma}};
  if (rig.has_right()) json["baseline_m"] = rig.T_C1C0().p.norm();
  json["time_offset_s"] = rig.time_offset_s;
  json["ground_truth_poses"] = info.ground_truth_poses;
  json["warnings"] = info.warnings;
  return json;
}

Json describe(const BagSurvey& bag) {
  Json topics = Json::array();
  for (const TopicSurvey& t : bag.topics)
    topics.push_back({{"name", t.name}, {"type", t.type}, {"messages", t.messages}, {"rate_hz", t.rate_hz}, {"first", t.first}});
  const auto camera = [&](std::size_t i) { return i < bag.cameras.size() ? bag.cameras[i] : std::string(); };
  return Json{{"format", bag.format},
              {"duration_s", bag.duration_s},
              {"topics", topics},
              {"left", camera(0)},
              {"right", camera(1)},
              {"cameras", bag.cameras},
              {"imu", bag.imu},
              {"depth", bag.depth},
              {"question", bag.question},
              {"unreadable", bag.unreadable},
              {"no_calibration", bag.no_calibration},
              {"warnings", bag.warnings}};
}

}  // namespace fbvins::app

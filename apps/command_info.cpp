// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/terminal.hpp"
#include "fbvins/bags/bag_survey.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples = R"(examples:
  fbvins info MH_01_easy
  fbvins info MH_01_easy.zip --json
  fbvins info flight.bag                         topics and rates of a bag, also without a calibration
)";

struct Arguments {
  RecordingArguments recording;
  bool json = false;
};

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

Json camera_json(const Camera& camera, const auto& T_BC, const CameraInfo& info) {
  return Json{{"images", info.listed},
              {"rows_left_out", info.rows.bad()},
              {"unpaired", info.unpaired},
              {"missing", info.images.missing},
              {"model", camera.model_name()},
              {"width", camera.width()},
              {"height", camera.height()},
              {"fx_fy_cx_cy_distortion", parameters_of(camera)},
              {"T_BC_row_major", row_major(T_BC)}};
}

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
                     {"accel_random_walk_mps3_rthz", rig.imu_noise.accel_random_walk_mps3_rthz}};
  json["left"] = camera_json(rig.left, rig.T_BC0, info.left);
  json["right"] = camera_json(rig.right, rig.T_BC1, info.right);
  json["baseline_m"] = rig.T_C1C0().p.norm();
  json["time_offset_s"] = rig.time_offset_s;
  json["ground_truth_poses"] = info.ground_truth_poses;
  json["warnings"] = info.warnings;
  return json;
}

void print_camera(std::string_view name, const Camera& camera, const CameraInfo& info) {
  fmt::print("{:<14}{} images, {} x {}, {}, focal length {:.1f} px", name, info.listed, camera.width(), camera.height(),
             camera.model_name(), camera.focal_px());
  if (info.rows.bad() + info.unpaired + info.images.missing > 0)
    fmt::print("; {} rows left out, {} without partner, {} files missing", info.rows.bad(), info.unpaired, info.images.missing);
  fmt::print("\n");
}

void print_text(const Dataset& data) {
  const DatasetInfo& info = data.info();
  fmt::print("{} ({})\n", bold(info.name), info.format);
  fmt::print("{:<14}{} at {:.2f} Hz over {:.2f} s, longest gap {:.3f} s\n", "stereo frames", info.frames, info.image_rate_hz,
             (info.last_image - info.first_image).seconds(), info.longest_image_gap.seconds());
  fmt::print("{:<14}first {} ns, last {} ns\n", "stamps", info.first_image.ns, info.last_image.ns);
  print_camera("left", data.rig().left, info.left);
  print_camera("right", data.rig().right, info.right);
  fmt::print("{:<14}baseline {:.4f} m, time offset {:.6f} s\n", "rig", data.rig().T_C1C0().p.norm(), data.rig().time_offset_s);
  fmt::print("{:<14}{} samples at {:.1f} Hz, longest gap {:.3f} s, {} rows left out\n", "imu", info.imu_samples, info.imu_rate_hz,
             info.longest_imu_gap.seconds(), info.imu_rows.bad());
  fmt::print("{:<14}{} poses\n", "ground truth", info.ground_truth_poses);
}

Json describe(const BagSurvey& bag) {
  Json topics = Json::array();
  for (const TopicSurvey& t : bag.topics)
    topics.push_back({{"name", t.name}, {"type", t.type}, {"messages", t.messages}, {"rate_hz", t.rate_hz}, {"first", t.first}});
  return Json{{"format", bag.format},     {"duration_s", bag.duration_s},
              {"topics", topics},         {"left", bag.left},
              {"right", bag.right},       {"imu", bag.imu},
              {"question", bag.question}, {"no_calibration", bag.no_calibration},
              {"warnings", bag.warnings}};
}

void print_text(const std::string& path, const BagSurvey& bag) {
  fmt::print("{} ({}), {:.2f} s\n", bold(path), bag.format, bag.duration_s);
  for (const TopicSurvey& t : bag.topics)
    fmt::print("{:<34}{:>8} messages{:>9.2f} Hz  {}{}{}\n", t.name, t.messages, t.rate_hz, t.type, t.first.empty() ? "" : "  ",
               t.first);
  if (!bag.left.empty()) fmt::print("topics to use: left {}, right {}, IMU {}\n", bag.left, bag.right, bag.imu);
}

/// A bag is shown also where it cannot be run before a calibration or its topics are named; that is said, and is no failure here.
int show_bag(const Arguments& arguments, const BagSurvey& bag, const Error& why) {
  for (const std::string& warning : bag.warnings) warn(warning);
  if (arguments.json) fmt::print("{}\n", describe(bag).dump(2));
  else print_text(arguments.recording.path, bag);
  if (!arguments.recording.topics.empty() && !bag.question.empty()) return fail(why.message);
  if (bag.question.empty() && bag.no_calibration.empty()) return fail(why.message);
  warn(why.message);
  return kOk;
}

int show(const Arguments& arguments) {
  DatasetOptions options;
  options.prefetch_frames = 0;
  options.require_imu = false;
  const auto data = open_recording(arguments.recording, options);
  if (!data) {
    if (const auto bag = survey_recording(arguments.recording); bag && !bag->topics.empty())
      return show_bag(arguments, *bag, data.error());
    return fail(data.error().message);
  }
  RecordingWarnings().print((*data)->info());
  if (arguments.json) fmt::print("{}\n", describe(**data).dump(2));
  else print_text(**data);
  return kOk;
}

}  // namespace

void add_info_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("info", kInfoDescription);
  command->footer(kExamples);
  arguments->recording.add_to(*command);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &exit_code] { exit_code = show(*arguments); });
}

}  // namespace fbvins::app

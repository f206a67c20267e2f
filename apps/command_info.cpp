// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/recording_report.hpp"
#include "apps/terminal.hpp"
#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/io/calibration_doubts.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/known_file.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples = R"(examples:
  fbvins info MH_01_easy
  fbvins info MH_01_easy.zip --json
  fbvins info flight.bag                         topics and rates of a bag, also without a calibration
  fbvins info poses.txt                          what a file is that is no recording, and what it is for
)";

constexpr std::uint64_t kLargestChain_bytes = std::uint64_t{1} << 20u;

struct Arguments {
  RecordingArguments recording;
  bool json = false;
};

std::string lens_of(const Camera& camera) {
  return fmt::format("{} x {}, {}, focal length {:.1f} px{}", camera.width(), camera.height(), camera.model_name(),
                     camera.focal_px(),
                     camera.mask() ? fmt::format(", {:.1f} % masked", 100 * camera.mask()->hidden_share()) : std::string());
}

std::string left_out_of(const CameraInfo& info) {
  if (info.rows.bad() + info.unpaired + info.images.missing == 0) return "";
  return fmt::format("; {} rows left out, {} without partner, {} files missing", info.rows.bad(), info.unpaired,
                     info.images.missing);
}

void print_camera(std::string_view name, const Camera& camera, const CameraInfo& info) {
  fmt::print("{:<14}{} images, {}{}\n", name, info.listed, lens_of(camera), left_out_of(info));
}

/// Of the cameras from number 2 on images are counted together.
void print_further_cameras(const StereoRig& rig, const CameraInfo& info) {
  if (rig.camera_count() <= 2) return;
  for (int i = 2; i < rig.camera_count(); ++i) fmt::print("{:<14}{}\n", fmt::format("camera {}", i), lens_of(rig.camera(i)));
  fmt::print("{:<14}{} images together{}\n", "", info.listed, left_out_of(info));
}

/// Of camera 0, and of the others where they have others.
std::string times_of(const StereoRig& rig) {
  const auto text = [](const CameraTimes& times) {
    const std::string rolling =
        times.line_delay_s == 0 ? std::string() : fmt::format(", line delay {:.3f} us", 1e6 * times.line_delay_s);
    return fmt::format("time offset {:.6f} s{}", times.time_offset_s, rolling);
  };
  std::string out = text(rig.times(0));
  for (int i = 1; i < rig.camera_count(); ++i)
    if (rig.times(i) != rig.times(0)) out += fmt::format("; camera {}: {}", i, text(rig.times(i)));
  return out;
}

/// Noise and what the calibration knows of scale, axes and biases.
void print_imu_calibration(const ImuNoise& imu) {
  fmt::print("{:<14}noise {:.3g} rad/s and {:.3g} m/s^2 per sqrt(Hz), random walk {:.3g} rad/s^2 and {:.3g} m/s^3\n", "",
             imu.gyro_noise_density_radps_rthz, imu.accel_noise_density_mps2_rthz, imu.gyro_random_walk_radps2_rthz,
             imu.accel_random_walk_mps3_rthz);
  const ImuIntrinsics& axes = imu.axes;
  if (axes == ImuIntrinsics{}) {
    fmt::print("{:<14}no scale and axes in the calibration: readings are taken as they are\n", "");
    return;
  }
  const auto off = [](const Mat3& m) {
    const Vec3 scale = (m.transpose() * m).diagonal().cwiseSqrt();
    const Mat3 cosines = scale.cwiseInverse().asDiagonal() * (m.transpose() * m) * scale.cwiseInverse().asDiagonal();
    return fmt::format("scale {:.4f} {:.4f} {:.4f}, axes up to {:.2f} degrees from square", scale.x(), scale.y(), scale.z(),
                       kDegreesPerRad * std::asin(std::min(1.0, (cosines - Mat3::Identity()).cwiseAbs().maxCoeff())));
  };
  const Vec3 &bg = axes.bias.gyro_radps, &ba = axes.bias.accel_mps2;
  fmt::print("{:<14}gyroscope: {}, bias {:.4f} {:.4f} {:.4f} rad/s{}\n", "", off(axes.gyro), bg.x(), bg.y(), bg.z(),
             axes.gyro_by_force.isZero(0)
                 ? ""
                 : fmt::format(", up to {:.4f} rad/s for each m/s^2", axes.gyro_by_force.cwiseAbs().maxCoeff()));
  fmt::print("{:<14}accelerometer: {}, bias {:.4f} {:.4f} {:.4f} m/s^2\n", "", off(axes.accel), ba.x(), ba.y(), ba.z());
}

void print_text(const Dataset& data) {
  const DatasetInfo& info = data.info();
  fmt::print("{} ({})\n", bold(info.name), info.format);
  fmt::print("{:<14}{} at {:.2f} Hz over {:.2f} s, longest gap {:.3f} s\n", "frames", info.frames, info.image_rate_hz,
             (info.last_image - info.first_image).seconds(), info.longest_image_gap.seconds());
  fmt::print("{:<14}first {} ns, last {} ns\n", "stamps", info.first_image.ns, info.last_image.ns);
  print_camera("left", data.rig().left(), info.camera(0));
  if (data.rig().has_right()) print_camera("right", data.rig().right(), info.camera(1));
  print_further_cameras(data.rig(), info.further());
  if (const auto& depth = data.rig().depth)
    fmt::print("{:<14}{} images, {} to {} m, noise {:.4f} m at 1 m{}\n", "depth", info.depth.listed, depth->nearest_m,
               depth->farthest_m, depth->noise_at_1m_m, depth->own ? ", with a lens and a pose of its own" : "");
  const std::string baseline =
      data.rig().has_right() ? fmt::format("baseline {:.4f} m, ", data.rig().T_C1C0().p.norm()) : std::string();
  fmt::print("{:<14}{}{}\n", "rig", baseline, times_of(data.rig()));
  fmt::print("{:<14}{} samples at {:.1f} Hz, longest gap {:.3f} s, {} rows left out\n", "imu", info.imu_samples, info.imu_rate_hz,
             info.longest_imu_gap.seconds(), info.imu_rows.bad());
  print_imu_calibration(data.rig().imu_noise);
  for (const AidingCount& sensor : info.aiding)
    fmt::print("{:<14}{} readings at {:.1f} Hz\n", sensor.name, sensor.readings, sensor.rate_hz);
  fmt::print("{:<14}{} poses\n", "ground truth", info.ground_truth_poses);
}

void print_text(const std::string& path, const BagSurvey& bag) {
  fmt::print("{} ({}), {:.2f} s\n", bold(path), bag.format, bag.duration_s);
  for (const TopicSurvey& t : bag.topics)
    fmt::print("{:<34}{:>8} messages{:>9.2f} Hz  {}{}{}\n", t.name, t.messages, t.rate_hz, t.type, t.first.empty() ? "" : "  ",
               t.first);
  if (bag.cameras.empty() || !bag.unreadable.empty()) return;
  fmt::print("topics to use: cameras {}, IMU {}{}\n", fmt::join(bag.cameras, ", "), bag.imu,
             bag.depth.empty() ? "" : ", depth images " + bag.depth);
}

bool calibration_given(const Arguments& arguments) {
  return !arguments.recording.calibration.empty() || !arguments.recording.imu_calibration.empty();
}

/// A bag is shown also where it cannot be run before a calibration or its topics are named; that is said, and is no failure here.
/// Images that nothing can be done with are one.
int show_bag(const Arguments& arguments, const BagSurvey& bag, const Error& why) {
  for (const std::string& warning : bag.warnings) warn(warning);
  if (arguments.json) fmt::print("{}\n", describe(bag).dump(2));
  else print_text(arguments.recording.path, bag);
  const bool answered = bag.question.empty() ? calibration_given(arguments) : !arguments.recording.topics.empty();
  if (answered || (bag.question.empty() && bag.no_calibration.empty())) return fail(why.message);
  if (!bag.unreadable.empty()) return fail(fmt::format("{}: {}", arguments.recording.path, bag.unreadable));
  warn(why.message);
  return kOk;
}

/// Of a folder that has images and cannot be opened, that is what is to be said.
bool has_images(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::exists(path + "/mav0/cam0/data.csv", ignored) ||
         std::filesystem::exists(path + "/cam0/data.csv", ignored);
}

/// What a file is that is no recording.
std::optional<KnownFile> file_of(const std::string& path) {
  const Result<StereoRig> rig = calibration_in(path);
  if (rig) {
    for (const std::string& doubt : calibration_doubts(*rig)) warn(doubt);
    std::string what = fmt::format("a calibration of {} camera{}", rig->camera_count(), rig->camera_count() == 1 ? "" : "s");
    for (int i = 0; i < rig->camera_count(); ++i) what += fmt::format("; camera {}: {}", i, lens_of(rig->camera(i)));
    if (rig->has_right()) what += fmt::format("; baseline {:.4f} m", rig->T_C1C0().p.norm());
    return KnownFile{what + "; " + times_of(*rig), "give it by --calibration"};
  }
  if (auto known = known_file(path)) return known;
  if (const auto text = read_file(path, kLargestChain_bytes); text && text->find("camera_model") != std::string::npos)
    return KnownFile{"a calibration in Kalibr's form", "it cannot be used: " + rig.error().message};
  return std::nullopt;
}

int show_file(const Arguments& arguments, const KnownFile& file) {
  const std::string& path = arguments.recording.path;
  if (arguments.json) fmt::print("{}\n", Json{{"file", path}, {"what", file.what}, {"use", file.use}}.dump(2));
  else fmt::print("{}: {}; {}\n", bold(path), file.what, file.use);
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
    if (!calibration_given(arguments) && !has_images(arguments.recording.path))
      if (const auto file = file_of(arguments.recording.path)) return show_file(arguments, *file);
    return fail(data.error().message);
  }
  const DatasetInfo& info = (*data)->info();
  RecordingWarnings().print(info);
  if (info.imu_samples > 0)
    if (const auto apart = check_ends({info.first_image, info.last_image, info.first_imu, info.last_imu}, (*data)->rig()))
      warn(to_text(*apart));
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

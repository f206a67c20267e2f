// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/convert_recording.hpp"
#include "apps/open_recording.hpp"
#include "apps/progress.hpp"
#include "apps/terminal.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(The name decides the format: FILE.bag is a ROS 1 bag; FILE.mcap a flight record, which ROS 2 programs can read;
any other name is an EuRoC folder, or with --rosbag2 one that `ros2 bag` plays (MCAP). Images become 8-bit grey. Calibration with noise, range, time offset, line
delay and masks, and ground truth are kept (of truth in a bag or record: the poses), and the outputs of a flight record: all of them in a
record, the poses in a bag (/odometry) or folder (odometry_tum.txt).

examples:
  fbvins convert flight.bag flight                           a bag with camera_info and /tf_static, as EuRoC folder
  fbvins convert MH_01_easy.bag mh01 --calibration camchain-imucam.yaml
  fbvins convert MH_01_easy mh01.mcap
  fbvins convert flight part.mcap --start 12 --duration 10 --half
  fbvins convert MH_01_easy mh01 --rosbag2 --rename /camera/left=/cam0/image_raw,/camera/right=/cam1/image_raw,/imu=/imu0
)";

struct Arguments {
  RecordingArguments recording;
  ConvertTarget target;
  std::vector<std::string> renamed;
  bool quiet = false;
};

bool is_topic(const std::string& name) {
  return name.size() > 1 && name.front() == '/' && name.back() != '/' && name.find("//") == std::string::npos &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_/") == std::string::npos;
}

/// OLD=NEW of --rename.
Result<void> read_names(const std::vector<std::string>& renamed, std::map<std::string, std::string>& names) {
  for (const std::string& pair : renamed) {
    const auto middle = pair.find('=');
    const std::string before = pair.substr(0, middle), after = middle == std::string::npos ? "" : pair.substr(middle + 1);
    if (!is_topic(before) || !is_topic(after))
      return Error{ErrorCode::invalid_argument,
                   fmt::format("--rename: OLD=NEW is needed, both names of topics that begin with /, not '{}'", pair)};
    if (!names.try_emplace(before, after).second)
      return Error{ErrorCode::invalid_argument, fmt::format("--rename: {} is there twice", before)};
  }
  return {};
}

/// Its outputs were made with its own calibration.
ConvertedRecord record_of(const RecordingArguments& recording, const Dataset& data) {
  if (data.info().format != "MCAP flight record" || !recording.calibration.empty()) return {};
  return {recording.path, recording.start_s == 0 && recording.duration_s == 0};
}

int convert(Arguments& arguments) {
  if (Result<void> good = read_names(arguments.renamed, arguments.target.names); !good) return fail(good.error().message);
  const auto data = open_recording(arguments.recording, {.require_imu = false});
  if (!data) return fail(data.error().message);
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  Progress progress(static_cast<int>((*data)->frames().size()), arguments.quiet);
  const auto frames = convert_recording(**data, record_of(arguments.recording, **data), arguments.target,
                                        [&](int done) { progress.update(done); });
  if (!frames) return fail(frames.error().message);
  warnings.print_at_end((*data)->info());
  if (!arguments.quiet) fmt::print("{} frames in {}\n", *frames, bold(arguments.target.path));
  return kOk;
}

}  // namespace

void add_convert_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("convert", kConvertDescription);
  command->footer(kExamples);
  arguments->recording.add_to(*command);
  command->add_option("OUT", arguments->target.path, "FILE.bag, FILE.mcap, or a folder")->required();
  command->add_flag("--rosbag2", arguments->target.rosbag2, "a folder with metadata.yaml that `ros2 bag` plays");
  command->add_option("--rename", arguments->renamed, "topics that get another name, OLD=NEW (a bag, a record, --rosbag2)")
      ->delimiter(',');
  command->add_flag("--half", arguments->target.half, "images of half the width and height, lenses to match");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = convert(*arguments); });
}

}  // namespace fbvins::app

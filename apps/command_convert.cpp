// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/convert_recording.hpp"
#include "apps/open_recording.hpp"
#include "apps/progress.hpp"
#include "apps/terminal.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(The name decides the format: FILE.bag is a ROS 1 bag; FILE.mcap a flight record, which ROS 2 programs can read;
any other name is an EuRoC folder. Images become 8-bit grey. Calibration with noise, range and time offset, and
ground truth are kept (of truth in a bag or record: the poses), and the outputs of a flight record: all of them in a
record, the poses in a bag (/odometry) or folder (odometry_tum.txt).

examples:
  fbvins convert flight.bag flight                           a bag with camera_info and /tf_static, as EuRoC folder
  fbvins convert MH_01_easy.bag mh01 --calibration camchain-imucam.yaml
  fbvins convert MH_01_easy mh01.mcap
)";

struct Arguments {
  RecordingArguments recording;
  std::string out;
  bool quiet = false;
};

/// Its outputs were made with its own calibration.
ConvertedRecord record_of(const RecordingArguments& recording, const Dataset& data) {
  if (data.info().format != "MCAP flight record" || !recording.calibration.empty()) return {};
  return {recording.path, recording.start_s == 0 && recording.duration_s == 0};
}

int convert(const Arguments& arguments) {
  const auto data = open_recording(arguments.recording, {.require_imu = false});
  if (!data) return fail(data.error().message);
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  Progress progress(static_cast<int>((*data)->frames().size()), arguments.quiet);
  const auto frames =
      convert_recording(**data, record_of(arguments.recording, **data), arguments.out, [&](int done) { progress.update(done); });
  if (!frames) return fail(frames.error().message);
  warnings.print_at_end((*data)->info());
  if (!arguments.quiet) fmt::print("{} frames in {}\n", *frames, bold(arguments.out));
  return kOk;
}

}  // namespace

void add_convert_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("convert", kConvertDescription);
  command->footer(kExamples);
  arguments->recording.add_to(*command);
  command->add_option("OUT", arguments->out, "FILE.bag, FILE.mcap, or a folder")->required();
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = convert(*arguments); });
}

}  // namespace fbvins::app

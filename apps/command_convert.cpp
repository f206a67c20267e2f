// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>

#include "apps/commands.hpp"
#include "apps/open_recording.hpp"
#include "apps/progress.hpp"
#include "apps/terminal.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/io/euroc_folder.hpp"
#include "fbvins/io/flight_record.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(The name decides the format: FILE.bag is a ROS 1 bag; FILE.mcap a flight record, which ROS 2 programs can read;
any other name is an EuRoC folder. Images become 8-bit grey. Calibration with noise, range and time offset, and
ground truth are kept (of truth in a bag or record: the poses).

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

/// Takes events and truth in order of time; finish() completes the output.
struct Sink {
  std::function<Result<void>(const SensorEvent&)> add;
  std::function<Result<void>(const TrajectoryPoint&)> add_truth;
  std::function<Result<void>()> finish;
};

template <class Writer>
Sink sink_of(std::shared_ptr<Writer> writer) {
  return {[writer](const SensorEvent& event) { return std::visit([&](const auto& value) { return writer->add(value); }, event); },
          [writer](const TrajectoryPoint& point) { return writer->add_truth(point.t, point.T_WB); },
          [writer] { return writer->finish(); }};
}

/// EuRoC's readings and truth are written at the end, the truth with its velocity and biases.
struct EurocSink {
  EurocFolder folder;
  std::vector<TrajectoryPoint> truth;
  std::vector<ImuSample> readings;

  Result<void> add(const ImuSample& reading) { return readings.push_back(reading), Result<void>{}; }
  Result<void> add(const StereoFrame& frame) { return folder.add(frame, frame.t); }
  Result<void> add_truth(Time, const Pose<W, B>&) { return {}; }
  Result<void> finish() { return folder.finish(readings, truth); }
};

/// The truth up to the event, then the event.
class TruthBetween {
 public:
  TruthBetween(const std::vector<TrajectoryPoint>& truth, const Sink& sink) : truth_(truth), sink_(sink) {}
  Result<void> add_until(Time t) {
    for (; next_ < truth_.size() && truth_[next_].t <= t; ++next_)
      if (Result<void> taken = sink_.add_truth(truth_[next_]); !taken) return taken;
    return {};
  }

 private:
  const std::vector<TrajectoryPoint>& truth_;
  const Sink& sink_;
  std::size_t next_ = 0;
};

Result<Sink> make_sink(const Arguments& arguments, const Dataset& data) {
  if (std::filesystem::exists(arguments.out))
    return Error{ErrorCode::unwritable, fmt::format("{} exists already", arguments.out)};
  if (arguments.out.ends_with(".bag")) {
    auto bag = Ros1BagWriter::create(arguments.out, data.rig(), data.frames().front().t);
    if (!bag) return bag.error();
    return sink_of(std::make_shared<Ros1BagWriter>(*std::move(bag)));
  }
  if (arguments.out.ends_with(".mcap")) {
    auto record = FlightRecord::create(arguments.out, data.rig());
    if (!record) return record.error();
    return sink_of(std::make_shared<FlightRecord>(*std::move(record)));
  }
  auto folder = EurocFolder::create(arguments.out, data.rig(), "converted by fbvins");
  if (!folder) return folder.error();
  return sink_of(std::make_shared<EurocSink>(EurocSink{*std::move(folder), data.ground_truth(), {}}));
}

int convert(const Arguments& arguments) {
  const auto data = open_recording(arguments.recording, {.require_imu = false});
  if (!data) return fail(data.error().message);
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  Result<Sink> sink = make_sink(arguments, **data);
  if (!sink) return fail(sink.error().message);
  Progress progress(static_cast<int>((*data)->frames().size()), arguments.quiet);
  int frames = 0;
  TruthBetween truth((*data)->ground_truth(), *sink);
  while (auto event = (*data)->next()) {
    const Time t = std::visit([](const auto& value) { return value.t; }, *event);
    if (Result<void> taken = truth.add_until(t); !taken) return fail(taken.error().message);
    if (Result<void> taken = sink->add(*event); !taken) return fail(taken.error().message);
    if (std::holds_alternative<StereoFrame>(*event)) progress.update(++frames);
  }
  constexpr Time kEnd{std::numeric_limits<std::int64_t>::max()};
  if (Result<void> taken = truth.add_until(kEnd); !taken) return fail(taken.error().message);
  if (Result<void> done = sink->finish(); !done) return fail(done.error().message);
  warnings.print_at_end((*data)->info());
  if (!arguments.quiet) fmt::print("{} stereo frames in {}\n", frames, bold(arguments.out));
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

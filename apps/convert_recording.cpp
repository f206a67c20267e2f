// SPDX-License-Identifier: Apache-2.0
#include "apps/convert_recording.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <memory>

#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/io/euroc_folder.hpp"
#include "fbvins/io/flight_record.hpp"

namespace fbvins::app {
namespace {

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

Result<Sink> make_sink(const std::string& out, const Dataset& data) {
  if (std::filesystem::exists(out)) return Error{ErrorCode::unwritable, fmt::format("{} exists already", out)};
  if (out.ends_with(".bag")) {
    auto bag = Ros1BagWriter::create(out, data.rig(), data.frames().front().t);
    if (!bag) return bag.error();
    return sink_of(std::make_shared<Ros1BagWriter>(*std::move(bag)));
  }
  if (out.ends_with(".mcap")) {
    auto record = FlightRecord::create(out, data.rig());
    if (!record) return record.error();
    return sink_of(std::make_shared<FlightRecord>(*std::move(record)));
  }
  auto folder = EurocFolder::create(out, data.rig(), "converted by fbvins");
  if (!folder) return folder.error();
  return sink_of(std::make_shared<EurocSink>(EurocSink{*std::move(folder), data.ground_truth(), {}}));
}

}  // namespace

Result<int> convert_recording(Dataset& data, const std::string& out, const std::function<void(int frames)>& on_frame) {
  Result<Sink> sink = make_sink(out, data);
  if (!sink) return sink.error();
  int frames = 0;
  TruthBetween truth(data.ground_truth(), *sink);
  while (auto event = data.next()) {
    const Time t = std::visit([](const auto& value) { return value.t; }, *event);
    if (Result<void> taken = truth.add_until(t); !taken) return taken.error();
    if (Result<void> taken = sink->add(*event); !taken) return taken.error();
    if (std::holds_alternative<StereoFrame>(*event)) on_frame(++frames);
  }
  constexpr Time kEnd{std::numeric_limits<std::int64_t>::max()};
  if (Result<void> taken = truth.add_until(kEnd); !taken) return taken.error();
  if (Result<void> done = sink->finish(); !done) return done.error();
  return frames;
}

}  // namespace fbvins::app

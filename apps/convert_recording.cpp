// SPDX-License-Identifier: Apache-2.0
#include "apps/convert_recording.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <memory>

#include "apps/half_images.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/io/euroc_folder.hpp"
#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/io/mcap_recover.hpp"
#include "fbvins/io/rosbag2_folder.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins::app {
namespace {

/// Takes events and truth in order of time; finish() completes the output.
struct Sink {
  std::function<Result<void>(const SensorEvent&)> add;
  std::function<Result<void>(const TrajectoryPoint&)> add_truth;
  std::function<Result<void>(const StampedPose<W>&)> add_odometry;
  std::function<Result<void>()> finish;
};

template <class Writer>
Sink sink_of(std::shared_ptr<Writer> writer) {
  return {[writer](const SensorEvent& event) { return std::visit([&](const auto& value) { return writer->add(value); }, event); },
          [writer](const TrajectoryPoint& point) { return writer->add_truth(point.t, point.T_WB); },
          [writer](const StampedPose<W>& pose) { return writer->add_odometry(pose.t, pose.T); },
          [writer] { return writer->finish(); }};
}

/// EuRoC's readings and truth are written at the end, the truth with its velocity and biases.
struct EurocSink {
  std::string path;
  EurocFolder folder;
  std::vector<TrajectoryPoint> truth;
  std::vector<ImuSample> readings;
  std::vector<AidingSample> aiding;
  Duration time_offset;
  Trajectory<W> odometry;

  Result<void> add(const ImuSample& reading) { return readings.push_back(reading), Result<void>{}; }
  Result<void> add(const StereoFrame& frame) { return folder.add(frame, frame.t + frame.offsets.of(1)); }
  /// The folder's stamps are on the IMU's clock.
  Result<void> add(const AidingSample& reading) {
    AidingSample& added = aiding.emplace_back(reading);
    stamp_of(added) = stamp_of(reading) + time_offset;
    return {};
  }
  Result<void> add_truth(Time, const Pose<W, B>&) { return {}; }
  Result<void> add_odometry(Time t, const Pose<W, B>& T_WB) { return odometry.push_back({t, T_WB}), Result<void>{}; }
  Result<void> finish() {
    if (Result<void> done = folder.add_aiding(aiding); !done) return done;
    if (Result<void> done = folder.finish(readings, truth); !done || odometry.empty()) return done;
    auto tum = TumWriter::create(path + "/odometry_tum.txt");
    if (!tum) return tum.error();
    for (const StampedPose<W>& pose : odometry) tum->write(pose.t, pose.T);
    return tum->close();
  }
};

/// A record without its outputs: the calibration that they rest on is not this one.
struct RecordOfInputs {
  FlightRecord record;
  template <class Event>
  requires requires(FlightRecord& to, const Event& event) { to.add(event); }
  Result<void> add(const Event& event) { return record.add(event); }
  Result<void> add_truth(Time t, const Pose<W, B>& T_WB) { return record.add_truth(t, T_WB); }
  Result<void> add_odometry(Time, const Pose<W, B>&) { return {}; }
  Result<void> finish() { return record.finish(); }
};

/// Poses up to an event, before it.
template <class Row>
class InBetween {
 public:
  InBetween(const std::vector<Row>& rows, const std::function<Result<void>(const Row&)>& add) : rows_(rows), add_(add) {}
  Result<void> add_until(Time t) {
    for (; next_ < rows_.size() && rows_[next_].t <= t; ++next_)
      if (Result<void> taken = add_(rows_[next_]); !taken) return taken;
    return {};
  }

 private:
  const std::vector<Row>& rows_;
  const std::function<Result<void>(const Row&)>& add_;
  std::size_t next_ = 0;
};

Result<Sink> make_sink(const ConvertTarget& target, const StereoRig& rig, const Dataset& data) {
  const std::string& out = target.path;
  if (std::filesystem::exists(out)) return Error{ErrorCode::unwritable, fmt::format("{} exists already", out)};
  if (out.ends_with(".bag")) {
    auto bag = Ros1BagWriter::create(out, rig, data.frames().front().t, target.names);
    if (!bag) return bag.error();
    return sink_of(std::make_shared<Ros1BagWriter>(*std::move(bag)));
  }
  if (out.ends_with(".mcap")) {
    auto record = FlightRecord::create(out, rig);
    if (!record) return record.error();
    return sink_of(std::make_shared<RecordOfInputs>(RecordOfInputs{*std::move(record)}));
  }
  auto folder = EurocFolder::create(out, rig, "converted by fbvins");
  if (!folder) return folder.error();
  return sink_of(std::make_shared<EurocSink>(
      EurocSink{out, *std::move(folder), data.ground_truth(), {}, {}, Duration::from_seconds(rig.time_offset_s), {}}));
}

/// An image's camera_info goes with it, and lies where ROS's programs look for it.
void add_camera_infos(ConvertTarget& target) {
  const auto beside = [](const std::string& topic) { return topic.substr(0, topic.rfind('/')) + "/camera_info"; };
  const std::map<std::string, std::string> given = target.names;
  for (const auto& [before, after] : given) {
    const bool of_bag = before.starts_with("/cam") && before.ends_with("/image_raw");
    const bool of_record = before.starts_with("/camera/") && before != kDepthTopic && before.rfind('/') == 7;
    if (of_bag || of_record) target.names.try_emplace(of_bag ? beside(before) : before + "/camera_info", beside(after));
  }
}

/// All messages of a record, or those of a part of it with the second of readings before.
Result<int> copy_record(Dataset& data, const ConvertedRecord& record, const ConvertTarget& target,
                        const std::function<void(int frames)>& on_frame) {
  constexpr Duration kLeadIn{1'000'000'000}, kBehind{100'000'000};
  const DatasetInfo& info = data.info();
  McapPart part = record.whole ? McapPart{} : McapPart{info.first_image - kLeadIn, info.last_image + kBehind};
  part.names = target.names;
  const auto copied =
      target.rosbag2 ? write_rosbag2(record.path, target.path, part) : recover_mcap(record.path, target.path, part);
  if (!copied) return copied.error();
  on_frame(info.frames);
  return info.frames;
}

Result<int> write_events(Dataset& data, const ConvertedRecord& record, const ConvertTarget& target,
                         const std::function<void(int frames)>& on_frame) {
  Result<StereoRig> rig = target.half ? with_half_images(data.rig()) : data.rig();
  if (!rig) return rig.error();
  Result<Sink> sink = make_sink(target, *rig, data);
  if (!sink) return sink.error();
  int frames = 0;
  const Trajectory<W> odometry = record.path.empty() ? Trajectory<W>{} : recorded_odometry(record.path);
  InBetween truth(data.ground_truth(), sink->add_truth);
  InBetween poses(odometry, sink->add_odometry);
  const auto add_until = [&](Time t) {
    const Result<void> taken = truth.add_until(t);
    return taken ? poses.add_until(t) : taken;
  };
  while (auto event = data.next()) {
    const Time t = stamp_of(*event);
    if (Result<void> taken = add_until(t); !taken) return taken.error();
    StereoFrame* frame = std::get_if<StereoFrame>(&*event);
    if (frame != nullptr && target.half) *frame = with_half_images(std::move(*frame));
    if (Result<void> taken = sink->add(*event); !taken) return taken.error();
    if (frame != nullptr) on_frame(++frames);
  }
  constexpr Time kEnd{std::numeric_limits<std::int64_t>::max()};
  if (Result<void> taken = record.whole ? add_until(kEnd) : truth.add_until(kEnd); !taken) return taken.error();
  if (Result<void> done = sink->finish(); !done) return done.error();
  return frames;
}

}  // namespace

Result<int> convert_recording(Dataset& data, const ConvertedRecord& record, const ConvertTarget& given,
                              const std::function<void(int frames)>& on_frame) {
  ConvertTarget target = given;
  add_camera_infos(target);
  const bool mcap = target.path.ends_with(".mcap");
  if (!target.rosbag2 && !mcap && !target.path.ends_with(".bag") && !target.names.empty())
    return Error{ErrorCode::invalid_argument, "an EuRoC folder has no topics that could get other names"};
  if (!record.path.empty() && !target.half && (mcap || target.rosbag2)) return copy_record(data, record, target, on_frame);
  if (!target.rosbag2 && (!mcap || target.names.empty())) return write_events(data, record, target, on_frame);
  // As a record first, which is then written again with other names, or beside its metadata.
  std::string as_record = target.path;
  while (as_record.size() > 1 && as_record.ends_with('/')) as_record.pop_back();
  if (std::filesystem::exists(as_record)) return Error{ErrorCode::unwritable, fmt::format("{} exists already", target.path)};
  as_record += ".part.mcap";
  const auto frames = write_events(data, record, {.path = as_record, .half = target.half}, on_frame);
  Result<RecoveredMcap> done = RecoveredMcap{};
  if (frames) {
    const McapPart part{.names = target.names};
    done = target.rosbag2 ? write_rosbag2(as_record, target.path, part) : recover_mcap(as_record, target.path, part);
  }
  std::error_code ignored;
  std::filesystem::remove(as_record, ignored);
  if (!frames) return frames.error();
  if (!done) return done.error();
  return *frames;
}

}  // namespace fbvins::app

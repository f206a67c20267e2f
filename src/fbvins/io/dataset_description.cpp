// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/dataset_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "fbvins/core/overloaded.hpp"
#include "fbvins/io/calibration_doubts.hpp"
#include "fbvins/io/clock_steps.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

/// Stamps that go back are left out.
template <class Row>
std::vector<Time> increasing_stamps(const std::vector<Row>& rows) {
  std::vector<Time> out;
  for (const Row& row : rows)
    if (out.empty() || out.back() < row.t) out.push_back(row.t);
  return out;
}

void warn_about_gap(const Intervals& intervals, const char* what, std::vector<std::string>& warnings) {
  if (intervals.longest.ns > 3 * intervals.median.ns)
    warnings.push_back(fmt::format("{}: a gap of {:.3f} s after {} s", what, intervals.longest.seconds(),
                                   format_seconds(intervals.longest_start)));
}

/// Below the first the turns of a hand or a vehicle lie between two readings; below the second no estimate begins.
constexpr double kFewest_hz = 50, kTooFew_hz = 10;
/// Of a calibration's rate to the measured one.
constexpr double kOtherRate = 1.5;

void warn_about_rate(double measured_hz, double declared_hz, std::vector<std::string>& warnings) {
  if (!(measured_hz > 0) || measured_hz >= kFewest_hz) return;
  const bool other = declared_hz > kOtherRate * measured_hz;
  warnings.push_back(fmt::format("IMU: {:.3g} readings a second{}, {}: set the sensor to 100 to 400 Hz", measured_hz,
                                 other ? fmt::format(" where {:.3g} are declared", declared_hz) : "",
                                 measured_hz < kTooFew_hz
                                     ? "too few for an estimate (`imu_gap`, `alignment_refused`)"
                                     : "between which the motion is hardly known, so that the covariance is larger"));
}

void describe_imu(const std::vector<ImuSample>& imu, double declared_hz, DatasetInfo& info) {
  info.imu_samples = static_cast<int>(imu.size());
  if (imu.empty()) {
    info.warnings.emplace_back("there is no IMU in the recording");
    return;
  }
  const std::vector<Time> stamps = increasing_stamps(imu);
  info.first_imu = stamps.front();
  info.last_imu = stamps.back();
  const Intervals intervals = measure_intervals(stamps);
  info.imu_rate_hz = intervals.rate_hz;
  info.longest_imu_gap = intervals.longest;
  info.longest_imu_gap_start = intervals.longest_start;
  warn_about_gap(intervals, "IMU", info.warnings);
  warn_about_rate(info.imu_rate_hz, declared_hz, info.warnings);
}

void describe_aiding(const std::vector<AidingSample>& readings, DatasetInfo& info) {
  std::map<std::string, std::vector<Time>> stamps;
  for (const AidingSample& reading : readings) {
    const char* name =
        std::visit(Overloaded{[](const RangeSample&) { return "rangefinder"; }, [](const VelocitySample&) { return "velocity"; },
                              [](const PressureSample&) { return "barometer"; }},
                   reading);
    stamps[name].push_back(stamp_of(reading));
  }
  for (const auto& [name, times] : stamps) {
    const double rate_hz = times.size() > 1 ? measure_intervals(times).rate_hz : 0;
    info.aiding.push_back({name, static_cast<int>(times.size()), rate_hz});
  }
}

}  // namespace

Result<void> cut_frames(const DatasetOptions& options, std::vector<FrameEntry>& frames) {
  if (frames.empty()) return Error{ErrorCode::malformed, "there are no frames"};
  const Time first = frames.front().t + Duration::from_seconds(options.start_s);
  std::erase_if(frames, [&](const FrameEntry& f) {
    return f.t < first || (options.duration_s > 0 && f.t >= first + Duration::from_seconds(options.duration_s));
  });
  frames.erase(frames.begin(), frames.begin() + std::min<std::ptrdiff_t>(options.skip_frames, std::ssize(frames)));
  if (options.max_frames > 0 && std::ssize(frames) > options.max_frames)
    frames.resize(static_cast<std::size_t>(options.max_frames));
  if (!frames.empty()) return {};
  if (options.start_s > 0)
    return Error{ErrorCode::invalid_argument, fmt::format("no frames are left after {} s", options.start_s)};
  return Error{ErrorCode::invalid_argument, fmt::format("no frames are left after skipping {}", options.skip_frames)};
}

void describe(DatasetContents& contents) {
  DatasetInfo& info = contents.info;
  info.frames = static_cast<int>(contents.frames.size());
  const std::vector<Time> stamps = increasing_stamps(contents.frames);
  info.first_image = stamps.front();
  info.last_image = stamps.back();
  const Intervals images = measure_intervals(stamps);
  info.image_rate_hz = images.rate_hz;
  info.longest_image_gap = images.longest;
  info.longest_image_gap_start = images.longest_start;
  warn_about_gap(images, "images", info.warnings);
  describe_imu(contents.imu, contents.rig.imu_noise.rate_hz, info);
  describe_aiding(contents.aiding, info);
  for (std::string& doubt : calibration_doubts(contents.rig)) info.warnings.push_back(std::move(doubt));
}

void continue_stamps(DatasetContents& contents, const std::string& name) {
  StampStream frames = stream_of("images", contents.frames), readings = stream_of("IMU readings", contents.imu);
  JoinedClock clock = join_clock({&frames, &readings});
  take_clock(frames, contents.frames);
  take_clock(readings, contents.imu);
  for (FrameEntry& frame : contents.frames)
    if (frame.imu_before) frame.imu_before = std::min(*frame.imu_before, contents.imu.size());
  follow_clock(clock, contents.ground_truth);
  for (const std::string& sentence : clock.said) contents.info.warnings.push_back(fmt::format("{}: {}", name, sentence));
  contents.info.clock_steps = std::move(clock.begins);
}

void warn_of_silent_cameras(DatasetContents& contents) {
  constexpr double kSilent_s = 1;
  const std::vector<FrameEntry>& frames = contents.frames;
  const int cameras = contents.rig.camera_count();
  if (cameras < 2 || frames.empty()) return;
  for (int camera = 0; camera < cameras; ++camera) {
    Duration longest;
    Time last = frames.front().t, from = last;
    const auto up_to = [&](Time t) {
      if (t - last > longest) longest = t - last, from = last;
      last = t;
    };
    for (const FrameEntry& frame : frames)
      if (!frame.file(camera).empty()) up_to(frame.t);
    up_to(frames.back().t);
    if (longest.seconds() >= kSilent_s)
      contents.info.warnings.push_back(fmt::format("camera {}: no images for {:.1f} s, from {:.1f} s after the first frame on",
                                                   camera, longest.seconds(), (from - frames.front().t).seconds()));
  }
}

}  // namespace fbvins

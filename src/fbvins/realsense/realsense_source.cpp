// SPDX-License-Identifier: Apache-2.0
#include "fbvins/realsense/realsense_source.hpp"

#include <fmt/format.h>

#include <chrono>
#include <regex>
#include <utility>
#include <vector>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/source_rig.hpp"

namespace fbvins {
namespace {

constexpr double kLookEvery_s = 0.5;
/// Without an image, though the camera is there: its streams are started again; where this happens twice in a row, the camera.
constexpr Duration kStall{2'000'000'000}, kTwiceInARow{10'000'000'000};

bool is_recording(const std::string& which) { return which.ends_with(".bag"); }

bool fits(const StereoRig& rig, const RealsenseCamera& camera) {
  return rig.left().width() == camera.width_px() && rig.left().height() == camera.height_px();
}

}  // namespace

RealsenseName parse_realsense_name(const std::string& text) {
  static const std::regex kMode(R"((?:(.*):)?(\d{1,5})x(\d{1,5})(?:@(\d{1,4}))?)"), kDepth("(?:(.*):)?depth");
  RealsenseName name{text, {}};
  std::smatch found;
  if (std::regex_match(text, found, kMode)) {
    const auto number = [&](std::size_t i) { return found[i].matched ? std::stoi(found[i]) : 0; };
    name = {found[1].str(), {.width_px = number(2), .height_px = number(3), .rate_hz = number(4)}};
  }
  const std::string before = name.which;
  if (std::regex_match(before, found, kDepth)) name.which = found[1].str(), name.mode.depth = true;
  return name;
}

RealsenseSource::RealsenseSource(rs2::context context, std::string which, SourceOptions options)
    : options_(std::move(options)), context_(std::move(context)), which_(std::move(which)) {}

RealsenseSource::~RealsenseSource() {
  try {
    context_.set_devices_changed_callback([](rs2::event_information&) {});
  } catch (const rs2::error&) {  // then no event comes any more
  }
}

Result<std::unique_ptr<RealsenseSource>> RealsenseSource::open(const std::string& which, const SourceOptions& options) {
  try {
    return open(rs2::context(), which, options);
  } catch (const rs2::error& e) {
    return Error{ErrorCode::unreadable, fmt::format("RealSense: {}", e.what())};
  }
}

Result<std::unique_ptr<RealsenseSource>> RealsenseSource::open(rs2::context context, const std::string& which,
                                                               const SourceOptions& options) {
  const RealsenseName name = parse_realsense_name(which);
  std::unique_ptr<RealsenseSource> source(new RealsenseSource(std::move(context), name.which, options));
  source->mode_ = name.mode;
  if (Result<void> watched = source->watch(); !watched) return watched.error();
  if (Result<void> found = source->wait_for_first(); !found) return found.error();
  if (Result<void> known = source->set_rig(); !known) return known.error();
  return source;
}

/// Registers for devices that are plugged in or unplugged; a recording becomes a device of the context.
Result<void> RealsenseSource::watch() {
  try {
    context_.set_devices_changed_callback([this](rs2::event_information& event) {
      const std::lock_guard lock(mutex_);
      if (camera_ && event.was_removed(camera_->device())) removed_ = true;
      changed_.notify_all();
    });
    if (!is_recording(which_)) return {};
    rs2::playback recording = context_.load_device(which_);
    recording_ = recording;
    recording.set_status_changed_callback([this](rs2_playback_status status) {
      const std::lock_guard lock(mutex_);
      if (status == RS2_PLAYBACK_STATUS_STOPPED) ended_ = true;
      changed_.notify_all();
    });
  } catch (const rs2::error& e) {
    return Error{ErrorCode::unreadable, fmt::format("RealSense {}: {}", which_, e.what())};
  }
  return {};
}

/// A problem is reported when it first occurs: cameras are looked for twice a second.
void RealsenseSource::report(const std::string& problem) {
  if (std::exchange(problem_, problem) != problem) options_.say(problem);
}

/// The wanted camera, if it is plugged in and usable.
std::unique_ptr<RealsenseCamera> RealsenseSource::find() {
  try {
    // For a recording the device whose end is reported: the context would make new ones.
    std::vector<rs2::device> devices;
    if (is_recording(which_)) devices.push_back(recording_);
    else
      for (const rs2::device& device : context_.query_devices()) devices.push_back(device);
    for (const rs2::device& device : devices) {
      if (!which_.empty() && realsense_name(device) != which_) continue;
      auto camera = RealsenseCamera::open(device, options_.say, mode_);
      if (!camera) {
        report(camera.error().message);
        continue;
      }
      return *std::move(camera);
    }
  } catch (const rs2::error& e) {  // unplugged in the meantime
    report(fmt::format("RealSense: {}", e.what()));
  }
  return nullptr;
}

Result<void> RealsenseSource::wait_for_first() {
  for (bool first = true; true; first = false) {
    auto camera = find();
    if (camera) {
      const std::lock_guard lock(mutex_);
      camera_ = std::move(camera);
      return {};
    }
    const std::string name = which_.empty() ? "a RealSense camera with an IMU" : "the RealSense camera " + which_;
    if (options_.give_up() || is_recording(which_))
      return Error{ErrorCode::not_found, fmt::format("{} is not there{}", name, problem_.empty() ? "" : ": " + problem_)};
    if (first) options_.say("waiting for " + name);
    wait(kLookEvery_s);
  }
}

Result<void> RealsenseSource::set_rig() {
  const DatasetOptions& files = options_.dataset;
  const bool own = !files.brings_rig();
  const auto rig = own ? camera_->rig() : given_rig(files);
  if (!rig) return rig.error();
  rig_ = *rig;
  if (mode_.depth && !own) {  // of the files the left camera; what they do not know is the device's
    const Result<StereoRig>& device = camera_->rig();
    if (!device) return device.error();
    DepthSensor sensor = *device->depth;
    if (sensor.own) sensor.own->T_BC = rig_.T_BC0() * (device->T_BC0().inverse() * sensor.own->T_BC);
    rig_ = with_depth(rig_, sensor);
  }
  if (fits(rig_, *camera_)) return {};
  return Error{ErrorCode::invalid_argument, fmt::format("{} is of {} x {} pixels, the camera delivers {} x {}",
                                                        own ? "its calibration" : files.kalibr_camchain, rig_.left().width(),
                                                        rig_.left().height(), camera_->width_px(), camera_->height_px())};
}

void RealsenseSource::wait(double longest_s) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(longest_s), [&] { return stopped_ || removed_ || ended_; });
}

Result<void> RealsenseSource::run(SensorInput& input) {
  const auto over = [&] {
    const std::lock_guard lock(mutex_);
    return stopped_ || ended_;
  };
  const auto gone = [&] {
    const std::lock_guard lock(mutex_);
    return removed_;
  };
  while (!over()) {
    if (!camera_) {
      wait(kLookEvery_s);
      auto camera = find();
      if (!camera) continue;
      if (!fits(rig_, *camera)) {
        report("another camera, whose images have another size, is not taken");
        continue;
      }
      const std::lock_guard lock(mutex_);
      camera_ = std::move(camera);
    }
    const std::string name = realsense_name(camera_->device());
    ++cameras_;
    if (Result<void> started = start_camera(input); !started) {
      report(started.error().message);
    } else {
      problem_.clear();
      options_.say(fmt::format("RealSense {}: {} x {} pixels", name, camera_->width_px(), camera_->height_px()));
      while (!over() && !gone()) {
        wait(kLookEvery_s);
        if (!gone() && !is_recording(which_)) mend_stall(input);
      }
      keep_facts();
      camera_->stop();
      if (const std::string unpaired = camera_->unpaired(); !unpaired.empty()) options_.say(unpaired);
      if (gone()) options_.say(fmt::format("RealSense {}: unplugged; it is waited for", name));
    }
    const std::lock_guard lock(mutex_);
    camera_.reset();
    removed_ = false;
  }
  return {};
}

Result<void> RealsenseSource::start_camera(SensorInput& input) {
  const auto tolerance = Duration::from_seconds(1e-3 * options_.dataset.pair_tolerance_ms);
  return camera_->start(input, FrameJoiner(rig_.camera_count(), rig_.depth.has_value(), tolerance, own_offsets(rig_)));
}

/// Starts the streams again that have stopped though the camera is there.
void RealsenseSource::mend_stall(SensorInput& input) {
  if (camera_->silence() < kStall) return;
  ++stalls_;
  options_.say("the camera is there, and no image comes: its streams are started again");
  const bool again = stalls_ > 1 && host_now() - stalled_ < kTwiceInARow;
  stalled_ = host_now();
  camera_->stop();
  try {
    if (Result<void> started = again ? Result<void>{} : start_camera(input); !started) report(started.error().message);
    if (!again) return;
    rs2::device(camera_->device()).hardware_reset();
  } catch (const rs2::error& e) {
    report(fmt::format("RealSense: {}", e.what()));
  }
  const std::lock_guard lock(mutex_);
  removed_ = true;  // it is looked for as one that was unplugged
}

void RealsenseSource::keep_facts() {
  facts_ = camera_->facts();
  facts_.resets = cameras_ - 1;
  facts_.stalls = stalls_;
}

std::vector<SensorFinding> RealsenseSource::device_findings() const { return fbvins::device_findings(facts_, rig_); }

void RealsenseSource::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

}  // namespace fbvins

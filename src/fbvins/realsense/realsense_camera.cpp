// SPDX-License-Identifier: Apache-2.0
#include "fbvins/realsense/realsense_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "fbvins/live/host_clock.hpp"

namespace fbvins {
namespace {

constexpr RealsenseMode kPreferred{640, 480, 30};
constexpr const char* kUsualModes[] = {"640x480@30", "848x480@30", "848x480@60"};

/// The library's milliseconds in a double are exact to a microsecond.
Time time_of(const rs2::frame& frame) { return Time{std::llround(frame.get_timestamp() * 1e3) * 1000}; }

/// Distance of a stream from the wanted one; of equal ones the first is taken.
double distance(const rs2::stream_profile& profile, const RealsenseMode& wanted) {
  if (!profile.is<rs2::video_stream_profile>()) return -profile.fps();  // gyroscope and accelerometer: the highest rate
  const auto video = profile.as<rs2::video_stream_profile>();
  return std::abs(video.width() - wanted.width_px) + std::abs(video.height() - wanted.height_px) +
         std::abs(video.fps() - wanted.rate_hz);
}

struct Wanted {
  rs2_stream stream;
  int index;
  rs2_format format;
  const char* name;
};
using WantedStreams = std::array<Wanted, 4>;
constexpr WantedStreams kPair = {{{RS2_STREAM_INFRARED, 1, RS2_FORMAT_Y8, "left infrared"},
                                  {RS2_STREAM_INFRARED, 2, RS2_FORMAT_Y8, "right infrared"},
                                  {RS2_STREAM_GYRO, 0, RS2_FORMAT_MOTION_XYZ32F, "gyroscope"},
                                  {RS2_STREAM_ACCEL, 0, RS2_FORMAT_MOTION_XYZ32F, "accelerometer"}}};
constexpr WantedStreams kWithDepth = {{kPair[0], {RS2_STREAM_DEPTH, 0, RS2_FORMAT_Z16, "depth"}, kPair[2], kPair[3]}};

void set(const rs2::sensor& sensor, rs2_option option, float value) {
  if (sensor.supports(option) && !sensor.is_option_read_only(option)) sensor.set_option(option, value);
}

/// A lower limit that somebody has set is kept.
void limit_exposure(const rs2::sensor& sensor) {
  constexpr float kLimit_us = 1e3f * static_cast<float>(kLongestExposure_ms);
  if (!sensor.supports(RS2_OPTION_AUTO_EXPOSURE_LIMIT) || sensor.get_option(RS2_OPTION_AUTO_EXPOSURE_LIMIT) <= kLimit_us) return;
  set(sensor, RS2_OPTION_AUTO_EXPOSURE_LIMIT, kLimit_us);
  set(sensor, RS2_OPTION_AUTO_EXPOSURE_LIMIT_TOGGLE, 1);
}

std::string mode_text(int width_px, int height_px, int rate_hz) { return fmt::format("{}x{}@{}", width_px, height_px, rate_hz); }

const std::uint8_t* row_of(const rs2::video_frame& frame, int y) {
  return static_cast<const std::uint8_t*>(frame.get_data()) + static_cast<std::ptrdiff_t>(y) * frame.get_stride_in_bytes();
}

std::shared_ptr<const Image> image_of(const rs2::video_frame& frame) {
  auto image = std::make_shared<Image>(frame.get_width(), frame.get_height());
  for (int y = 0; y < frame.get_height(); ++y)
    std::memcpy(image->row(y), row_of(frame, y), static_cast<std::size_t>(frame.get_width()));
  return image;
}

Vec3 vector(const rs2_vector& v) { return Vec3(v.x, v.y, v.z); }

Error error_of(const std::string& who, const rs2::error& e) {
  return {ErrorCode::unreadable, fmt::format("{}: {} ({})", who, e.what(), e.get_failed_function())};
}

}  // namespace

std::string realsense_name(const rs2::device& device) {
  if (device.is<rs2::playback>()) return device.as<rs2::playback>().file_name();
  return device.supports(RS2_CAMERA_INFO_SERIAL_NUMBER) ? device.get_info(RS2_CAMERA_INFO_SERIAL_NUMBER) : "";
}

Result<std::unique_ptr<RealsenseCamera>> RealsenseCamera::open(rs2::device device, Say say, RealsenseMode wanted) {
  std::unique_ptr<RealsenseCamera> camera(new RealsenseCamera(std::move(device), std::move(say), wanted));
  try {
    if (Result<void> chosen = camera->choose(); !chosen) return chosen.error();
    camera->set_options();
  } catch (const rs2::error& e) {
    return error_of("the camera", e);
  }
  return camera;
}

void RealsenseCamera::note_mode(const rs2::stream_profile& profile) {
  if (profile.stream_type() != RS2_STREAM_INFRARED || profile.stream_index() != 1) return;
  const auto video = profile.as<rs2::video_stream_profile>();
  modes_.insert({video.width(), video.height(), video.fps()});
}

std::string RealsenseCamera::modes(bool only_usual) const {
  std::string all;
  for (const auto& [width, height, rate] : modes_) {
    const std::string mode = mode_text(width, height, rate);
    const bool usual = std::find(std::begin(kUsualModes), std::end(kUsualModes), mode) != std::end(kUsualModes);
    if (!only_usual || (usual && mode != mode_)) all += (all.empty() ? "" : " ") + mode;
  }
  return all;
}

Result<void> RealsenseCamera::choose() {
  const RealsenseMode near = wanted_.width_px == 0 ? kPreferred
                                                   : RealsenseMode{wanted_.width_px, wanted_.height_px,
                                                                   wanted_.rate_hz == 0 ? kPreferred.rate_hz : wanted_.rate_hz};
  const WantedStreams& all_wanted = wanted_.depth ? kWithDepth : kPair;
  std::vector<rs2::stream_profile> chosen;
  for (rs2::sensor& sensor : device_.query_sensors()) {
    Stream stream{.sensor = sensor};
    const auto profiles = sensor.get_stream_profiles();
    for (const Wanted& wanted : all_wanted) {
      std::optional<rs2::stream_profile> best;
      for (const rs2::stream_profile& profile : profiles) {
        const bool fits = profile.stream_type() == wanted.stream && profile.format() == wanted.format &&
                          (wanted.index == 0 || profile.stream_index() == wanted.index);
        if (!fits) continue;
        note_mode(profile);
        if (!best || distance(profile, near) < distance(*best, near)) best = profile;
      }
      if (!best) continue;
      stream.profiles.push_back(*best);
      stream.is_stereo |= wanted.stream == RS2_STREAM_INFRARED;
    }
    chosen.insert(chosen.end(), stream.profiles.begin(), stream.profiles.end());
    if (!stream.profiles.empty()) streams_.push_back(std::move(stream));
  }
  const auto find = [&](const Wanted& wanted) {
    return std::find_if(chosen.begin(), chosen.end(), [&](const rs2::stream_profile& profile) {
      return profile.stream_type() == wanted.stream && (wanted.index == 0 || profile.stream_index() == wanted.index);
    });
  };
  for (const Wanted& wanted : all_wanted)
    if (find(wanted) == chosen.end())
      return Error{ErrorCode::unsupported, fmt::format("the camera {} has no {}", realsense_name(device_), wanted.name)};
  const auto left = find(all_wanted[0])->as<rs2::video_stream_profile>(),
             second = find(all_wanted[1])->as<rs2::video_stream_profile>();
  width_px_ = left.width(), height_px_ = left.height();
  mode_ = mode_text(width_px_, height_px_, left.fps());
  if (wanted_.width_px > 0 &&
      mode_ != mode_text(wanted_.width_px, wanted_.height_px, wanted_.rate_hz == 0 ? left.fps() : wanted_.rate_hz))
    return Error{ErrorCode::unsupported,
                 fmt::format("the camera {} has no mode {}x{}{}, but {}", realsense_name(device_), wanted_.width_px,
                             wanted_.height_px, wanted_.rate_hz == 0 ? "" : fmt::format("@{}", wanted_.rate_hz), modes(false))};
  imu_calibrated_ =
      is_calibrated(find(all_wanted[2])->as<rs2::motion_stream_profile>(), find(all_wanted[3])->as<rs2::motion_stream_profile>());
  try {
    double baseline_mm = 50;  // the D435i's
    for (const Stream& stream : streams_) {
      if (!stream.is_stereo) continue;
      if (stream.sensor.supports(RS2_OPTION_STEREO_BASELINE))
        baseline_mm = static_cast<double>(stream.sensor.get_option(RS2_OPTION_STEREO_BASELINE));
      if (stream.sensor.supports(RS2_OPTION_DEPTH_UNITS))
        unit_mm_ = 1e3 * static_cast<double>(stream.sensor.get_option(RS2_OPTION_DEPTH_UNITS));
    }
    rig_ = realsense_rig(left, second, find(all_wanted[2])->as<rs2::motion_stream_profile>(), 1e-3 * std::abs(baseline_mm));
  } catch (const rs2::error& e) {
    rig_ = error_of("the calibration of " + realsense_name(device_), e);
  }
  return {};
}

void RealsenseCamera::set_options() {
  for (const Stream& stream : streams_) {
    set(stream.sensor, RS2_OPTION_EMITTER_ENABLED, 0);
    set(stream.sensor, RS2_OPTION_EMITTER_ON_OFF, 0);
    set(stream.sensor, RS2_OPTION_GLOBAL_TIME_ENABLED, 1);
    set(stream.sensor, RS2_OPTION_ENABLE_MOTION_CORRECTION, 1);
    limit_exposure(stream.sensor);
  }
}

Duration RealsenseCamera::silence() {
  const std::lock_guard lock(mutex_);
  return host_now() - heard_;
}

std::string RealsenseCamera::unpaired() {
  const std::lock_guard lock(mutex_);
  return pairs_.report();
}

DeviceFacts RealsenseCamera::facts() {
  const std::lock_guard lock(mutex_);
  const auto stereo = std::find_if(streams_.begin(), streams_.end(), [](const Stream& stream) { return stream.is_stereo; });
  DeviceFacts facts;
  try {
    facts = realsense_facts(device_, stereo->sensor, seen_);
  } catch (const rs2::error&) {  // unplugged
  }
  facts.mode = mode_, facts.other_modes = modes(true), facts.set_mode = "--source d435i:MODE";
  facts.imu_calibrated = imu_calibrated_;
  return facts;
}

Result<void> RealsenseCamera::start(SensorInput& input, FrameJoiner pairs) {
  {
    const std::lock_guard lock(mutex_);
    heard_ = host_now();
    pairs_ = std::move(pairs);
    motion_ = MotionMerge();  // what it had before it stopped is of no use
  }
  try {
    for (Stream& stream : streams_) {
      stream.sensor.open(stream.profiles);
      stream.started = true;
      stream.sensor.start([this, &input](const rs2::frame& frame) { take(frame, input); });
    }
  } catch (const rs2::error& e) {
    stop();
    return error_of(realsense_name(device_), e);
  }
  return {};
}

void RealsenseCamera::stop() {
  for (Stream& stream : streams_) {
    if (!stream.started) continue;
    stream.started = false;
    try {
      stream.sensor.stop();
      stream.sensor.close();
    } catch (const rs2::error&) {  // an unplugged camera cannot be stopped
    }
  }
}

void RealsenseCamera::take(const rs2::frame& frame, SensorInput& input) {
  const std::lock_guard lock(mutex_);
  if (seen_.clock < 0) seen_.clock = frame.get_frame_timestamp_domain();
  if (frame.get_frame_timestamp_domain() != seen_.clock)
    return say_once(fmt::format("stamps are of two clocks ('{}' and '{}'): images and readings of the second are left out",
                                rs2_timestamp_domain_to_string(static_cast<rs2_timestamp_domain>(seen_.clock)),
                                rs2_timestamp_domain_to_string(frame.get_frame_timestamp_domain())));
  const Time t = time_of(frame);
  if (frame.is<rs2::video_frame>()) take_image(frame.as<rs2::video_frame>(), t, input);
  else if (frame.is<rs2::motion_frame>()) take_motion(frame.as<rs2::motion_frame>(), t, input);
}

void RealsenseCamera::take_image(const rs2::video_frame& frame, Time t, SensorInput& input) {
  heard_ = host_now();
  if (frame.supports_frame_metadata(RS2_FRAME_METADATA_ACTUAL_EXPOSURE))
    seen_.exposure_ms = 1e-3 * static_cast<double>(frame.get_frame_metadata(RS2_FRAME_METADATA_ACTUAL_EXPOSURE));
  if (frame.supports_frame_metadata(RS2_FRAME_METADATA_FRAME_EMITTER_MODE))
    (frame.get_frame_metadata(RS2_FRAME_METADATA_FRAME_EMITTER_MODE) == 0 ? seen_.emitter_off : seen_.emitter_on) = true;
  if (frame.get_profile().stream_type() == RS2_STREAM_DEPTH) pairs_.add_depth(t, depth_of(frame));
  else pairs_.add(frame.get_profile().stream_index() == 2 ? 1 : 0, t, image_of(frame));
  while (auto pair = pairs_.next()) input.push(*std::move(pair));
}

std::shared_ptr<const DepthImage> RealsenseCamera::depth_of(const rs2::video_frame& frame) const {
  auto depth = std::make_shared<DepthImage>(DepthImage{frame.get_width(), frame.get_height(), {}});
  const auto width = static_cast<std::size_t>(frame.get_width());
  depth->mm.resize(width * static_cast<std::size_t>(frame.get_height()));
  for (int y = 0; y < frame.get_height(); ++y)
    std::memcpy(depth->mm.data() + static_cast<std::size_t>(y) * width, row_of(frame, y), 2 * width);
  constexpr double kMost_mm = std::numeric_limits<std::uint16_t>::max();
  if (std::abs(unit_mm_ - 1) > 1e-6)
    for (std::uint16_t& value : depth->mm)
      value = static_cast<std::uint16_t>(value * unit_mm_ > kMost_mm ? 0 : std::lround(value * unit_mm_));
  return depth;
}

void RealsenseCamera::take_motion(const rs2::motion_frame& frame, Time t, SensorInput& input) {
  const Vec3 value = vector(frame.get_motion_data());
  if (frame.get_profile().stream_type() == RS2_STREAM_GYRO) motion_.add_gyro(t, value);
  else motion_.add_accel(t, value);
  while (auto sample = motion_.next()) input.push(*sample);
  if (motion_.left_out() > 0)
    say_once("readings whose stamps do not ascend, or of one sensor while the other was silent, are left out");
}

void RealsenseCamera::say_once(const std::string& sentence) {
  if (said_.insert(sentence).second) say_(sentence);
}

}  // namespace fbvins

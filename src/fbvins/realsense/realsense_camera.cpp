// SPDX-License-Identifier: Apache-2.0
#include "fbvins/realsense/realsense_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace fbvins {
namespace {

constexpr int kWidth_px = 640, kHeight_px = 480, kImageRate_hz = 30;  // preferred

/// The library's milliseconds in a double are exact to a microsecond.
Time time_of(const rs2::frame& frame) { return Time{std::llround(frame.get_timestamp() * 1e3) * 1000}; }

/// Distance of a stream from the preferred one; of equal ones the first is taken.
double distance(const rs2::stream_profile& profile) {
  if (!profile.is<rs2::video_stream_profile>()) return -profile.fps();  // gyroscope and accelerometer: the highest rate
  const auto video = profile.as<rs2::video_stream_profile>();
  return std::abs(video.width() - kWidth_px) + std::abs(video.height() - kHeight_px) + std::abs(video.fps() - kImageRate_hz);
}

struct Wanted {
  rs2_stream stream;
  int index;
  rs2_format format;
  const char* name;
};
constexpr Wanted kWanted[] = {{RS2_STREAM_INFRARED, 1, RS2_FORMAT_Y8, "left infrared"},
                              {RS2_STREAM_INFRARED, 2, RS2_FORMAT_Y8, "right infrared"},
                              {RS2_STREAM_GYRO, 0, RS2_FORMAT_MOTION_XYZ32F, "gyroscope"},
                              {RS2_STREAM_ACCEL, 0, RS2_FORMAT_MOTION_XYZ32F, "accelerometer"}};

void set(const rs2::sensor& sensor, rs2_option option, float value) {
  if (sensor.supports(option) && !sensor.is_option_read_only(option)) sensor.set_option(option, value);
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

Result<std::unique_ptr<RealsenseCamera>> RealsenseCamera::open(rs2::device device, Say say) {
  std::unique_ptr<RealsenseCamera> camera(new RealsenseCamera(std::move(device), std::move(say)));
  try {
    if (Result<void> chosen = camera->choose(); !chosen) return chosen.error();
    camera->set_options();
  } catch (const rs2::error& e) {
    return error_of("the camera", e);
  }
  return camera;
}

Result<void> RealsenseCamera::choose() {
  std::vector<rs2::stream_profile> chosen;
  for (rs2::sensor& sensor : device_.query_sensors()) {
    Stream stream{.sensor = sensor};
    const auto profiles = sensor.get_stream_profiles();
    for (const Wanted& wanted : kWanted) {
      std::optional<rs2::stream_profile> best;
      for (const rs2::stream_profile& profile : profiles) {
        const bool fits = profile.stream_type() == wanted.stream && profile.format() == wanted.format &&
                          (wanted.index == 0 || profile.stream_index() == wanted.index);
        if (fits && (!best || distance(profile) < distance(*best))) best = profile;
      }
      if (best) stream.profiles.push_back(*best);
    }
    chosen.insert(chosen.end(), stream.profiles.begin(), stream.profiles.end());
    if (!stream.profiles.empty()) streams_.push_back(std::move(stream));
  }
  const auto find = [&](const Wanted& wanted) {
    return std::find_if(chosen.begin(), chosen.end(), [&](const rs2::stream_profile& profile) {
      return profile.stream_type() == wanted.stream && (wanted.index == 0 || profile.stream_index() == wanted.index);
    });
  };
  for (const Wanted& wanted : kWanted)
    if (find(wanted) == chosen.end())
      return Error{ErrorCode::unsupported, fmt::format("the camera {} has no {}", realsense_name(device_), wanted.name)};
  const auto left = find(kWanted[0])->as<rs2::video_stream_profile>(), right = find(kWanted[1])->as<rs2::video_stream_profile>();
  width_px_ = left.width(), height_px_ = left.height();
  try {
    rig_ = realsense_rig(left, right, find(kWanted[2])->as<rs2::motion_stream_profile>());
  } catch (const rs2::error& e) {
    rig_ = error_of("the calibration of " + realsense_name(device_), e);
  }
  return {};
}

void RealsenseCamera::set_options() {
  for (const Stream& stream : streams_) {
    set(stream.sensor, RS2_OPTION_EMITTER_ENABLED, 0);
    set(stream.sensor, RS2_OPTION_GLOBAL_TIME_ENABLED, 1);
    set(stream.sensor, RS2_OPTION_ENABLE_MOTION_CORRECTION, 1);
  }
}

Result<void> RealsenseCamera::start(SensorInput& input) {
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
  if (clock_ < 0) clock_ = frame.get_frame_timestamp_domain();
  if (frame.get_frame_timestamp_domain() != clock_)
    return say_once(fmt::format("stamps are of two clocks ('{}' and '{}'): images and readings of the second are left out",
                                rs2_timestamp_domain_to_string(static_cast<rs2_timestamp_domain>(clock_)),
                                rs2_timestamp_domain_to_string(frame.get_frame_timestamp_domain())));
  const Time t = time_of(frame);
  if (frame.is<rs2::video_frame>()) take_image(frame.as<rs2::video_frame>(), t, input);
  else if (frame.is<rs2::motion_frame>()) take_motion(frame.as<rs2::motion_frame>(), t, input);
}

void RealsenseCamera::take_image(const rs2::video_frame& frame, Time t, SensorInput& input) {
  auto image = std::make_shared<Image>(frame.get_width(), frame.get_height());
  const auto* pixels = static_cast<const std::uint8_t*>(frame.get_data());
  for (int y = 0; y < frame.get_height(); ++y)
    std::memcpy(image->row(y), pixels + static_cast<std::ptrdiff_t>(y) * frame.get_stride_in_bytes(),
                static_cast<std::size_t>(frame.get_width()));
  pairs_.add(frame.get_profile().stream_index() == 2 ? 1 : 0, t, std::move(image));
  while (auto pair = pairs_.next()) input.push(*std::move(pair));
}

void RealsenseCamera::take_motion(const rs2::motion_frame& frame, Time t, SensorInput& input) {
  const Vec3 value = vector(frame.get_motion_data());
  if (frame.get_profile().stream_type() == RS2_STREAM_GYRO) motion_.add_gyro(t, value);
  else motion_.add_accel(t, value);
  while (auto sample = motion_.next()) input.push(*sample);
}

void RealsenseCamera::say_once(const std::string& sentence) {
  if (said_.insert(sentence).second) say_(sentence);
}

}  // namespace fbvins

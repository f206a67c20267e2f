// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/v4l2_source.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <thread>
#include <utility>

#include "fbvins/io/kalibr.hpp"
#include "fbvins/live/host_clock.hpp"

namespace fbvins {
namespace {

constexpr Duration kTryAgainAfter{500'000'000};
constexpr int kLongestWait_ms = 100;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

}  // namespace

Result<V4l2Devices> parse_v4l2_devices(const std::string& text) {
  std::vector<std::string> parts = split(text);
  const bool filled = std::none_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); });
  if (!filled || parts.size() < 2 || parts.size() > 3)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("'{}': video devices are LEFT,RIGHT,IMU or SIDE_BY_SIDE,IMU, the IMU udp:..., serial:... or socket:...",
                    text)};
  V4l2Devices devices;
  devices.imu = std::move(parts.back());
  parts.pop_back();
  devices.cameras = std::move(parts);
  return devices;
}

V4l2Source::V4l2Source(V4l2Devices devices, SourceOptions options, StereoRig rig)
    : options_(std::move(options)), rig_(std::move(rig)) {
  for (std::string& path : devices.cameras) cameras_.push_back({.path = std::move(path)});
}

Result<std::unique_ptr<V4l2Source>> V4l2Source::open(const std::string& text, const SourceOptions& options) {
  const auto devices = parse_v4l2_devices(text);
  if (!devices) return devices.error();
  const DatasetOptions& files = options.dataset;
  if (files.kalibr_camchain.empty() && !options.uncalibrated)
    return Error{ErrorCode::invalid_argument,
                 "video devices need --calibration: a Kalibr camchain of the two cameras and the IMU"};
  const Result<StereoRig> rig =
      files.kalibr_camchain.empty()
          ? Result<StereoRig>(*options.uncalibrated)
          : load_kalibr(files.kalibr_camchain, files.kalibr_imu.empty() ? std::nullopt : std::optional(files.kalibr_imu));
  if (!rig) return rig.error();
  std::unique_ptr<V4l2Source> source(new V4l2Source(*devices, options, *rig));
  auto imu = ImuFeed::open(devices->imu, *rig, [to = source.get()](const std::string& sentence) { to->say(sentence); });
  if (!imu) return imu.error();
  source->imu_ = *std::move(imu);
  return source;
}

Result<void> V4l2Source::run(SensorInput& input) {
  Result<void> readings_ended;
  std::thread readings([&] {
    readings_ended = imu_->run(input);
    if (!readings_ended) stop();
  });
  deliver_images(input);
  imu_->stop();
  readings.join();
  return readings_ended;
}

void V4l2Source::stop() {
  stopped_ = true;
  bell_.ring();
}

void V4l2Source::say(const std::string& sentence) {
  const std::lock_guard lock(say_mutex_);
  options_.say(sentence);
}

void V4l2Source::deliver_images(SensorInput& input) {
  while (!stopped_) {
    std::vector<pollfd> watched = {{bell_.fd(), POLLIN, 0}};
    for (Opened& camera : cameras_) {
      keep_open(camera);
      watched.push_back({camera.device ? camera.device->fd() : -1, POLLIN, 0});
    }
    ::poll(watched.data(), watched.size(), kLongestWait_ms);
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      if (watched[i + 1].revents != 0) take(i, input);
  }
  for (Opened& camera : cameras_) camera.device.reset();
}

void V4l2Source::keep_open(Opened& camera) {
  const Time now = host_now();
  if (camera.device || now < camera.next_try) return;
  const bool first = camera.next_try == Time{};
  camera.next_try = now + kTryAgainAfter;
  const int images = cameras_.size() == 1 ? 2 : 1;
  auto device = VideoDevice::open(camera.path, images * rig_.left.width(), rig_.left.height());
  if (!device) {
    if (first) say(device.error().message + "; it is tried again twice a second");
    return;
  }
  camera.device = *std::move(device);
  const VideoFormat& format = camera.device->format();
  say(fmt::format("{}: {} x {} pixels of {}", camera.path, format.width_px, format.height_px, fourcc_name(format.fourcc)));
}

void V4l2Source::take(std::size_t index, SensorInput& input) {
  Opened& camera = cameras_[index];
  const bool stamps_were_known = camera.device->stamps_are_the_drivers();
  auto frame = camera.device->take();
  if (!frame) {
    say(frame.error().message + "; it is waited for");
    camera.device.reset();
    return;
  }
  if (stamps_were_known && !camera.device->stamps_are_the_drivers())
    say(camera.path + ": its driver gives no time stamps; images are stamped on arrival");
  if (*frame) add(index, *std::move(*frame), input);
}

void V4l2Source::add(std::size_t index, VideoFrame frame, SensorInput& input) {
  if (cameras_.size() == 1) {
    auto [left, right] = split_side_by_side(frame.image);
    return input.push(StereoFrame{frame.t, std::make_shared<Image>(std::move(left)), std::make_shared<Image>(std::move(right))});
  }
  pairs_.add(static_cast<int>(index), frame.t, std::make_shared<Image>(std::move(frame.image)));
  while (auto pair = pairs_.next()) input.push(*std::move(pair));
}

}  // namespace fbvins

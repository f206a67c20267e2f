// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/v4l2_source.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/core/text.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/source_rig.hpp"

namespace fbvins {
namespace {

constexpr Duration kTryAgainAfter{500'000'000};
constexpr int kLongestWait_ms = 100;

/// Images side by side are of one size.
Result<void> check_sizes(const V4l2Devices& devices, const StereoRig& rig) {
  for (int i = 1; i < rig.camera_count() && devices.cameras.size() == 1; ++i)
    if (rig.camera(i).width() != rig.left().width() || rig.camera(i).height() != rig.left().height())
      return Error{
          ErrorCode::invalid_argument,
          fmt::format("{}: images side by side have one size, and in the calibration camera {} has another than camera 0",
                      devices.cameras.front(), i)};
  return {};
}

}  // namespace

Result<V4l2Devices> parse_v4l2_devices(const std::string& text) {
  std::vector<std::string> parts = split(text, ',');
  const bool filled = std::none_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); });
  if (!filled || parts.size() < 2 || parts.size() > 1 + std::size_t{kMostCameras})
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("'{}': video devices are CAM0[,CAM1,...],IMU or SIDE_BY_SIDE,IMU, at most {} cameras, the IMU udp:..., "
                    "serial:... or socket:...",
                    text, kMostCameras)};
  V4l2Devices devices;
  devices.imu = std::move(parts.back());
  parts.pop_back();
  devices.cameras = std::move(parts);
  return devices;
}

V4l2Source::V4l2Source(V4l2Devices devices, SourceOptions options, StereoRig rig)
    : options_(std::move(options)),
      rig_(std::move(rig)),
      joiner_(rig_.camera_count(), false, Duration::from_seconds(1e-3 * options_.dataset.pair_tolerance_ms), own_offsets(rig_)) {
  for (std::string& path : devices.cameras) cameras_.push_back({.path = std::move(path)});
}

Result<std::unique_ptr<V4l2Source>> V4l2Source::open(const std::string& text, const SourceOptions& options) {
  const auto devices = parse_v4l2_devices(text);
  if (!devices) return devices.error();
  const int count = static_cast<int>(devices->cameras.size());
  const Result<StereoRig> rig = rig_for_source(options, "video devices", count == 1 ? 0 : count);
  if (!rig) return rig.error();
  if (Result<void> fits = check_sizes(*devices, *rig); !fits) return fits.error();
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
  wake_.signal();
}

void V4l2Source::say(const std::string& sentence) {
  const std::lock_guard lock(say_mutex_);
  options_.say(sentence);
}

void V4l2Source::deliver_images(SensorInput& input) {
  while (!stopped_) {
    std::vector<pollfd> watched = {{wake_.fd(), POLLIN, 0}};
    for (Opened& camera : cameras_) {
      keep_open(camera);
      watched.push_back({camera.device ? camera.device->fd() : -1, POLLIN, 0});
    }
    ::poll(watched.data(), watched.size(), kLongestWait_ms);
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      if (watched[i + 1].revents != 0) take(i, input);
  }
  for (Opened& camera : cameras_) camera.device.reset();
  if (const std::string unpaired = joiner_.report(); !unpaired.empty()) say(unpaired);
}

void V4l2Source::keep_open(Opened& camera) {
  const Time now = host_now();
  if (camera.device || now < camera.next_try) return;
  const bool first = camera.next_try == Time{};
  camera.next_try = now + kTryAgainAfter;
  const Camera& lens = rig_.camera(static_cast<int>(&camera - cameras_.data()));
  const int images = is_side_by_side() ? rig_.camera_count() : 1;
  auto device = VideoDevice::open(camera.path, images * lens.width(), lens.height());
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
  if (is_side_by_side()) {
    int camera = 0;
    for (Image& image : split_side_by_side(frame.image, rig_.camera_count()))
      joiner_.add(camera++, frame.t, std::make_shared<Image>(std::move(image)));
  } else {
    joiner_.add(static_cast<int>(index), frame.t, std::make_shared<Image>(std::move(frame.image)));
  }
  while (auto joined = joiner_.next()) input.push(*std::move(joined));
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_source.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "fbvins/io/kalibr.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace {

constexpr int kImagesWaiting = 10, kReadingsWaiting = 2000;
constexpr auto kLookPeriod = std::chrono::milliseconds(100);

/// Without a copy where rows have no padding.
std::shared_ptr<const Image> image_of(const RosImage& image, const std::shared_ptr<const void>& keeper) {
  const auto width = static_cast<int>(image.width), height = static_cast<int>(image.height);
  const auto* pixels = reinterpret_cast<const std::uint8_t*>(image.pixels.data());
  if (image.step == image.width)
    return std::make_shared<Image>(width, height, std::shared_ptr<const std::uint8_t>(keeper, pixels));
  auto copy = std::make_shared<Image>(width, height);
  for (int y = 0; y < height; ++y) std::memcpy(copy->row(y), pixels + static_cast<std::size_t>(y) * image.step, image.width);
  return copy;
}

}  // namespace

Result<Ros2Topics> parse_ros2_topics(const std::string& text) {
  const auto first = text.find(','), second = text.find(',', first + 1);
  if (first == std::string::npos || second == std::string::npos || text.find(',', second + 1) != std::string::npos)
    return Error{ErrorCode::invalid_argument, fmt::format("'{}': ROS 2 topics are LEFT,RIGHT,IMU", text)};
  Ros2Topics topics{text.substr(0, first), text.substr(first + 1, second - first - 1), text.substr(second + 1)};
  for (const std::string* topic : {&topics.left, &topics.right, &topics.imu})
    if (topic->size() < 2 || (*topic)[0] != '/')
      return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 topic '{}': it begins with /", *topic)};
  return topics;
}

Result<std::unique_ptr<Ros2Source>> Ros2Source::open(std::shared_ptr<Ros2Node> node, const Ros2Topics& topics,
                                                     const SourceOptions& options) {
  const DatasetOptions& files = options.dataset;
  if (files.kalibr_camchain.empty() && !options.uncalibrated)
    return Error{ErrorCode::invalid_argument,
                 "ROS 2 topics need --calibration: a Kalibr camchain of the two cameras and the IMU"};
  const Result<StereoRig> rig =
      files.kalibr_camchain.empty()
          ? Result<StereoRig>(*options.uncalibrated)
          : load_kalibr(files.kalibr_camchain, files.kalibr_imu.empty() ? std::nullopt : std::optional(files.kalibr_imu));
  if (!rig) return rig.error();
  return std::unique_ptr<Ros2Source>(new Ros2Source(std::move(node), topics, options, *rig));
}

Result<void> Ros2Source::run(SensorInput& input) {
  const auto images = [&](int camera) {
    return [this, camera, &input](std::string_view bytes, const std::shared_ptr<const void>& keeper) {
      take_image(camera, bytes, keeper, input);
    };
  };
  const std::string image = "sensor_msgs/msg/Image";
  auto left = Ros2Subscriber::create(node_, topics_.left, image, kImagesWaiting, images(0));
  if (!left) return left.error();
  auto right = Ros2Subscriber::create(node_, topics_.right, image, kImagesWaiting, images(1));
  if (!right) return right.error();
  auto imu = Ros2Subscriber::create(node_, topics_.imu, "sensor_msgs/msg/Imu", kReadingsWaiting,
                                    [&](std::string_view bytes, const std::shared_ptr<const void>&) { take_imu(bytes, input); });
  if (!imu) return imu.error();
  while (!stopped_) {
    for (Ros2Subscriber* subscriber : {left->get(), right->get(), imu->get()})
      if (Result<void> looked = subscriber->look_around(); !looked) say_once(looked.error().message);
    std::this_thread::sleep_for(kLookPeriod);
  }
  return {};
}

void Ros2Source::take_image(int camera, std::string_view bytes, const std::shared_ptr<const void>& keeper, SensorInput& input) {
  const std::string& topic = camera == 0 ? topics_.left : topics_.right;
  const Camera& model = camera == 0 ? rig_.left : rig_.right;
  const auto message = read_image(bytes);
  if (!message) return say_once(fmt::format("{}: a message that is no image was left out", topic));
  if (!message->is_grey()) return say_once(fmt::format("{}: images are {}; only mono8 is supported", topic, message->encoding));
  if (message->empty()) return;
  if (static_cast<int>(message->width) != model.width() || static_cast<int>(message->height) != model.height())
    return say_once(fmt::format("{}: images are {} x {}, in the calibration they are {} x {}", topic, message->width,
                                message->height, model.width(), model.height()));
  const std::lock_guard lock(images_mutex_);
  pairs_.add(camera, message->t, image_of(*message, keeper));
  while (auto frame = pairs_.next()) input.push(std::move(*frame));
}

void Ros2Source::take_imu(std::string_view bytes, SensorInput& input) {
  const auto sample = read_imu(bytes);
  if (!sample || !sample->gyro_radps.allFinite() || !sample->accel_mps2.allFinite())
    return say_once(fmt::format("{}: a message that is no IMU reading was left out", topics_.imu));
  input.push(*sample);
}

void Ros2Source::say_once(const std::string& sentence) {
  const std::lock_guard lock(say_mutex_);
  if (said_.insert(sentence).second) options_.say(sentence);
}

}  // namespace fbvins

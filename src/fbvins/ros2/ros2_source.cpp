// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_source.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <sstream>
#include <thread>
#include <utility>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/source_rig.hpp"

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
  constexpr std::string_view kDepth = "depth=";
  Ros2Topics topics;
  std::istringstream parts(text);
  for (std::string name; std::getline(parts, name, ',');) {
    const bool depth = name.starts_with(kDepth);
    if (depth) name.erase(0, kDepth.size());
    if (name.size() < 2 || name[0] != '/')
      return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 topic '{}': it begins with /", name)};
    if (depth) topics.depth = name;
    else topics.cameras.push_back(name);
  }
  if (topics.cameras.size() < 2 || topics.cameras.size() > 1 + std::size_t{kMostCameras} || text.ends_with(','))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}': ROS 2 topics are CAM0[,CAM1,...],IMU[,depth=DEPTH], at most {} cameras", text, kMostCameras)};
  topics.imu = topics.cameras.back();
  topics.cameras.pop_back();
  if (!topics.depth.empty() && topics.cameras.size() > 1)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}': a depth sensor goes with one camera, and there are {}", text, topics.cameras.size())};
  return topics;
}

Result<std::unique_ptr<Ros2Source>> Ros2Source::open(std::shared_ptr<Ros2Node> node, const Ros2Topics& topics,
                                                     const SourceOptions& options) {
  Result<StereoRig> rig = topics.depth.empty() ? rig_for_source(options, "ROS 2 topics", static_cast<int>(topics.cameras.size()))
                                               : depth_rig_for_source(options, "ROS 2 topics");
  if (!rig) return rig.error();
  return std::unique_ptr<Ros2Source>(new Ros2Source(std::move(node), topics, options, *std::move(rig)));
}

Result<void> Ros2Source::run(SensorInput& input) {
  using Bytes = std::string_view;
  using Keeper = std::shared_ptr<const void>;
  std::vector<std::unique_ptr<Ros2Subscriber>> subscribers;
  const auto subscribe = [&](const std::string& topic, const char* type, int waiting, Ros2Subscriber::OnMessage take) {
    auto subscriber = Ros2Subscriber::create(node_, topic, type, waiting, std::move(take));
    if (!subscriber) return Result<void>(subscriber.error());
    subscribers.push_back(*std::move(subscriber));
    return Result<void>{};
  };
  const char* image = "sensor_msgs/msg/Image";
  for (int camera = 0; camera < rig_.camera_count(); ++camera) {
    const auto take = [this, camera, &input](Bytes bytes, const Keeper& keeper) { take_image(camera, bytes, keeper, input); };
    const std::string& topic = topics_.cameras[static_cast<std::size_t>(camera)];
    if (Result<void> done = subscribe(topic, image, kImagesWaiting, take); !done) return done;
  }
  const auto take_depths = [&](Bytes bytes, const Keeper&) { take_depth(bytes, input); };
  if (!topics_.depth.empty())
    if (Result<void> done = subscribe(topics_.depth, image, kImagesWaiting, take_depths); !done) return done;
  const auto take_readings = [&](Bytes bytes, const Keeper&) { take_imu(bytes, input); };
  if (Result<void> done = subscribe(topics_.imu, "sensor_msgs/msg/Imu", kReadingsWaiting, take_readings); !done) return done;
  while (!stopped_) {
    for (const auto& subscriber : subscribers)
      if (Result<void> looked = subscriber->look_around(); !looked) say_once(looked.error().message);
    std::this_thread::sleep_for(kLookPeriod);
  }
  subscribers.clear();  // what they still deliver is counted, too
  if (const std::string unpaired = joiner_.report(); !unpaired.empty()) say_once(unpaired);
  return {};
}

/// Whether it has the camera's size; says where not.
bool Ros2Source::is_of(const RosImage& image, const std::string& topic, const Camera& camera) {
  if (image.empty()) return false;
  if (static_cast<int>(image.width) == camera.width() && static_cast<int>(image.height) == camera.height()) return true;
  say_once(fmt::format("{}: images are {} x {}, in the calibration they are {} x {}", topic, image.width, image.height,
                       camera.width(), camera.height()));
  return false;
}

void Ros2Source::take_image(int camera, std::string_view bytes, const std::shared_ptr<const void>& keeper, SensorInput& input) {
  const std::string& topic = topics_.cameras[static_cast<std::size_t>(camera)];
  const auto message = read_image(bytes);
  if (!message) return say_once(fmt::format("{}: a message that is no image was left out", topic));
  if (!message->is_grey()) return say_once(fmt::format("{}: images are {}; only mono8 is supported", topic, message->encoding));
  if (!is_of(*message, topic, rig_.camera(camera))) return;
  const std::lock_guard lock(images_mutex_);
  joiner_.add(camera, message->t, image_of(*message, keeper));
  while (auto frame = joiner_.next()) input.push(std::move(*frame));
}

void Ros2Source::take_depth(std::string_view bytes, SensorInput& input) {
  const auto message = read_image(bytes);
  if (!message) return say_once(fmt::format("{}: a message that is no image was left out", topics_.depth));
  if (!message->is_depth())
    return say_once(fmt::format("{}: depth images are {}; only 16UC1 is supported", topics_.depth, message->encoding));
  const Camera& camera = rig_.depth_camera();
  if (!is_of(*message, topics_.depth, camera)) return;
  auto depth = std::make_shared<DepthImage>(DepthImage{camera.width(), camera.height(), {}});
  depth->mm.resize(std::size_t{message->width} * message->height);
  for (std::size_t y = 0; y < message->height; ++y)
    std::memcpy(depth->mm.data() + y * message->width, message->pixels.data() + y * message->step,
                2 * std::size_t{message->width});
  const std::lock_guard lock(images_mutex_);
  joiner_.add_depth(message->t, std::move(depth));
  while (auto frame = joiner_.next()) input.push(std::move(*frame));
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

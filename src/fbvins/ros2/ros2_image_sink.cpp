// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_image_sink.hpp"

#include <fmt/format.h>

#include <utility>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/view_landmarks.hpp"
#include "fbvins/ros2/ros2_sink.hpp"

namespace fbvins {
namespace {

/// For subscribers of both kinds; an image that is late is of no use.
constexpr Ros2Quality kQuality{.reliable = true, .latched = false, .depth = 5};

template <class Append>
Result<void> publish_if_heard(const Ros2Publisher& publisher, const Append& append) {
  if (publisher.subscribers() == 0) return {};
  std::string message;
  append(message);
  return publisher.publish(std::move(message));
}

}  // namespace

Result<std::unique_ptr<Ros2ImageSink>> Ros2ImageSink::create(const std::shared_ptr<Ros2Node>& node, const StereoRig& rig,
                                                             const Ros2Options& options) {
  auto landmarks = Ros2Publisher::create(node, node->own_topic("landmarks"), "sensor_msgs/msg/PointCloud2", kQuality);
  if (!landmarks) return landmarks.error();
  std::unique_ptr<Ros2ImageSink> sink(new Ros2ImageSink(options, std::move(*landmarks)));
  for (int c = 0; c < rig.camera_count(); ++c) {
    const std::string topic = node->own_topic(fmt::format("camera{}", c));
    auto image = Ros2Publisher::create(node, topic + "/image_raw", "sensor_msgs/msg/Image", kQuality);
    if (!image) return image.error();
    auto info = Ros2Publisher::create(node, topic + "/camera_info", "sensor_msgs/msg/CameraInfo", kQuality);
    if (!info) return info.error();
    sink->cameras_.push_back({rig.camera(c), Ros2Sink::camera_frame(c), std::move(*image), std::move(*info)});
  }
  if (!rig.depth) return sink;
  auto depth = Ros2Publisher::create(node, node->own_topic("depth/image_raw"), "sensor_msgs/msg/Image", kQuality);
  if (!depth) return depth.error();
  sink->depth_ = std::move(*depth);
  if (!rig.depth->own) return sink;
  auto info = Ros2Publisher::create(node, node->own_topic("depth/camera_info"), "sensor_msgs/msg/CameraInfo", kQuality);
  if (!info) return info.error();
  sink->depth_info_ = std::move(*info);
  sink->depth_camera_ = rig.depth->own->camera;
  return sink;
}

Result<void> Ros2ImageSink::take(const LiveEvent& event) {
  if (const auto* pose = std::get_if<LivePose>(&event)) stamps_.compare(pose->t, pose->host_t);
  if (const auto* frame = std::get_if<StereoFrame>(&event)) return take(*frame);
  if (const auto* view = std::get_if<LiveView>(&event)) return take(*view);
  return {};
}

Result<void> Ros2ImageSink::take(const StereoFrame& frame) {
  Result<void> done;
  const auto note = [&](const Result<void>& sent) {
    if (done) done = sent;
  };
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraTopics& to = cameras_[c];
    const Time seen = frame.t + frame.offsets.of(static_cast<int>(c));
    const std::shared_ptr<const Image> image = frame.image(static_cast<int>(c));
    if (!image || !stamps_.known(seen)) continue;
    const Time t = stamps_.of(seen);
    note(publish_if_heard(to.image, [&](std::string& out) { append_image(out, t, to.frame, image.get()); }));
    note(publish_if_heard(to.info, [&](std::string& out) { append_camera_info(out, t, to.frame, to.camera); }));
  }
  if (!depth_ || !frame.depth || !stamps_.known(frame.t)) return done;
  const Time t = stamps_.of(frame.t);
  const std::string of = depth_info_ ? std::string(Ros2Sink::kDepthOptical) : Ros2Sink::camera_frame(0);
  note(publish_if_heard(*depth_, [&](std::string& out) { append_depth_image(out, t, of, *frame.depth); }));
  if (depth_info_) note(publish_if_heard(*depth_info_, [&](std::string& out) { append_camera_info(out, t, of, depth_camera_); }));
  return done;
}

Result<void> Ros2ImageSink::take(const LiveView& view) {
  if (!stamps_.known(view.t)) return {};
  return publish_if_heard(
      landmarks_, [&](std::string& out) { append_landmarks(out, stamps_.of(view.t), landmarks_of(view), odometry_frame_); });
}

}  // namespace fbvins

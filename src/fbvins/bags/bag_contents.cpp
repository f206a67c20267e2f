// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_contents.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <set>
#include <utility>

#include "fbvins/bags/bag_stamps.hpp"
#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/imu/motion_merge.hpp"
#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/camera_order.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/quoted.hpp"
#include "fbvins/io/rig_text.hpp"

namespace fbvins {
namespace {

/// Without the slash before it, which ROS 1 puts before some names and not before others.
std::string frame_name(const std::string& name) { return name.substr(std::min(name.find_first_not_of('/'), name.size())); }

/// The frames that transforms connect, to be said where one is missing; empty without any.
std::string transforms_there(const std::vector<BagTransform>& transforms) {
  std::set<std::string> names;
  for (const BagTransform& t : transforms) names.insert({t.parent, t.child});
  if (names.empty()) return "";
  return fmt::format("; there are transforms between {}", fmt::join(names, ", "));
}

/// Prefix /device_/sensor_/stream of a topic of librealsense, which has no frame names, to be used as the frame; else empty.
std::string realsense_stream(const std::string& topic) {
  if (!topic.starts_with("/device_")) return "";
  std::size_t end = 0;
  for (int names = 0; names < 3 && end != std::string::npos; ++names) end = topic.find('/', end + 1);
  return end == std::string::npos ? "" : topic.substr(0, end);
}

void take_imu(const BagMessage& message, const BagTopic& about, std::optional<Time> recorded, ImuTopic& topic) {
  std::optional<ImuSample> sample = imu_of(message.data, about.encoding);
  if (!sample) {
    ++topic.malformed;
    return;
  }
  if (topic.samples.empty()) {
    MessageFields in(message.data, about.encoding);
    in.header();
    topic.frame = realsense_stream(about.name);
    if (topic.frame.empty()) topic.frame = in.frame();
  }
  if (recorded) sample->t = *recorded;
  topic.samples.push_back(*sample);
  topic.recorded.push_back(message.log_time);
}

void take_aiding(const BagMessage& message, const BagTopic& about, std::optional<Time> recorded, AidingTopic& topic) {
  auto read = aiding_of(message.data, about.encoding, about.type);
  if (!read) return void(++topic.malformed);
  if (recorded) stamp_of(read->reading) = *recorded;
  if (topic.readings.empty()) topic.frame = read->frame;
  topic.readings.push_back(std::move(read->reading));
  topic.recorded.push_back(message.log_time);
}

void take_image(const BagMessage& message, const BagTopic& about, std::optional<Time> recorded, ImageTopic& topic) {
  topic.compressed = about.type == "sensor_msgs/CompressedImage";
  topic.encoding = about.encoding;
  if (topic.rows.empty()) {
    MessageFields in(message.data, about.encoding);
    in.header();
    topic.frame = in.frame();
  }
  const std::optional<Time> t = stamp_of(message.data, about.encoding);
  if (!t) return void(++topic.malformed);
  topic.rows.push_back({recorded.value_or(*t), place_name(message.place)});
  topic.recorded.push_back(message.log_time);
}

void take_camera(const BagMessage& message, const BagTopic& about, BagContents& out) {
  if (out.cameras.contains(about.name)) return;
  Result<BagCamera> camera = camera_of(message.data, about.encoding);
  if (camera && !realsense_stream(about.name).empty()) camera->frame = realsense_stream(about.name);
  if (camera) out.cameras.emplace(about.name, *std::move(camera));
  else if (out.camera_problem.empty())
    out.camera_problem = fmt::format("{}: {}", fbvins::quoted(about.name), camera.error().message);
}

/// Of librealsense: .../Infrared_1/tf/0 takes coordinates of group 0's reference to those of the stream.
void take_stream_transform(const BagMessage& message, const BagTopic& about, BagContents& out) {
  const std::string stream = realsense_stream(about.name);
  auto transform = transform_of(message.data, about.encoding);
  if (stream.empty() || !transform || about.name.compare(stream.size(), 4, "/tf/") != 0) return;
  transform->parent = stream;
  transform->child = stream.substr(0, stream.find('/', 1)) + about.name.substr(stream.size());
  out.transforms.push_back(*std::move(transform));
}

/// The camera_info that belongs to an image topic: beside it or below it, or where librealsense has it.
const BagCamera* camera_for(const BagContents& contents, std::string topic) {
  if (topic.ends_with("/compressed")) topic.erase(topic.rfind('/'));
  for (const std::string& name : {topic + "/camera_info", topic.substr(0, topic.rfind('/') + 1) + "camera_info",
                                  realsense_stream(topic) + "/info/camera_info"})
    if (const auto found = contents.cameras.find(name); found != contents.cameras.end()) return &found->second;
  return nullptr;
}

/// Joins a gyroscope and an accelerometer on topics of their own, both in order of stamps: a reading for each of the gyroscope's.
std::vector<ImuSample> merged(const std::vector<ImuSample>& gyro, const std::vector<ImuSample>& accel) {
  MotionMerge merge;
  std::vector<ImuSample> out;
  auto next = accel.begin();
  for (const ImuSample& reading : gyro) {
    merge.add_gyro(reading.t, reading.gyro_radps);
    for (; next != accel.end() && (next == accel.begin() || std::prev(next)->t < reading.t); ++next)
      merge.add_accel(next->t, next->accel_mps2);
    while (const auto sample = merge.next()) out.push_back(*sample);
  }
  return out;
}

std::vector<ImuSample> ordered(ImuTopic& topic, RowCounts& counts) {
  counts.malformed += topic.malformed;
  counts.rows += topic.malformed;
  return in_order(std::move(topic.samples), counts);
}

/// Where its images are rectified.
const BagCamera::Rectified* rectified_of(const BagContents& contents, const BagCamera& camera, const std::string& topic) {
  return camera.rectified && contents.rectified.value_or(names_rectified(topic)) ? &*camera.rectified : nullptr;
}

}  // namespace

std::optional<Pose<B, B>> find_transform(const std::vector<BagTransform>& transforms, const std::string& to,
                                         const std::string& from) {
  const std::string begin = frame_name(to), goal = frame_name(from);
  std::map<std::string, Pose<B, B>> found{{begin, {}}};
  std::deque<std::string> open{begin};
  while (!open.empty() && !found.contains(goal)) {
    const std::string at = open.front();
    open.pop_front();
    for (const BagTransform& t : transforms) {
      const Pose<B, B> T(t.q, t.p);
      const std::string parent = frame_name(t.parent), child = frame_name(t.child);
      if (parent == at && found.try_emplace(child, found.at(at) * T).second) open.push_back(child);
      if (child == at && found.try_emplace(parent, found.at(at) * T.inverse()).second) open.push_back(parent);
    }
  }
  const auto end = found.find(goal);
  return end == found.end() ? std::nullopt : std::optional(end->second);
}

std::vector<std::string> rectifiable_topics(const BagContents& contents, const ChosenTopics& topics) {
  std::vector<std::string> out;
  for (const std::string& topic : topics.cameras) {
    const BagCamera* camera = camera_for(contents, topic);
    const BagCamera::Rectified* rectified = camera && camera->rectified ? &*camera->rectified : nullptr;
    if (rectified &&
        (rectified->R_rectified_raw != Mat3::Identity() || camera->camera.intrinsics() != rectified->camera.intrinsics() ||
         camera->camera.distortion() != rectified->camera.distortion()))
      out.push_back(topic);
  }
  return out;
}

std::vector<std::string> rectified_topics(const BagContents& contents, const ChosenTopics& topics) {
  std::vector<std::string> out = rectifiable_topics(contents, topics);
  std::erase_if(out, [&](const std::string& topic) { return !rectified_of(contents, *camera_for(contents, topic), topic); });
  return out;
}

std::vector<ImuSample> readings_on(BagContents& contents, const std::string& imu, const std::string& accel, RowCounts& counts) {
  std::vector<ImuSample> readings = ordered(contents.imu.at(imu), counts);
  if (accel.empty()) return readings;
  return merged(readings, ordered(contents.imu.at(accel), counts));
}

std::string place_name(const MessagePlace& place) { return fmt::format("{}+{}+{}", place.chunk, place.offset, place.length); }

MessagePlace place_of(const std::string& name) {
  MessagePlace place;
  const char *at = name.data(), *const end = at + name.size();
  for (std::uint64_t* number : {&place.chunk, &place.offset, &place.length}) {
    at = std::from_chars(at, end, *number).ptr;
    if (at != end) ++at;
  }
  return place;
}

BagContents read_contents(BagReader& bag, const std::function<void(const BagMessage&, const BagTopic&)>& on_message,
                          bool by_recording) {
  BagContents out;
  while (const std::optional<BagMessage> message = bag.next()) {
    const BagTopic about = bag.topics()[message->topic];
    if (on_message) on_message(*message, about);
    const std::optional<Time> recorded = by_recording ? std::optional(message->log_time) : std::nullopt;
    if (about.type == "sensor_msgs/Imu") take_imu(*message, about, recorded, out.imu[about.name]);
    else if (about.type == "sensor_msgs/Image" || about.type == "sensor_msgs/CompressedImage")
      take_image(*message, about, recorded, out.images[about.name]);
    else if (is_aiding_type(about.type)) take_aiding(*message, about, recorded, out.aiding[about.name]);
    else if (about.type == "sensor_msgs/CameraInfo") take_camera(*message, about, out);
    else if (about.type == "geometry_msgs/Transform") take_stream_transform(*message, about, out);
    else if (about.type == "tf2_msgs/TFMessage" && about.name.ends_with("tf_static")) {
      for (BagTransform& t : transforms_of(message->data, about.encoding)) out.transforms.push_back(std::move(t));
    } else if (about.name == kRigTopic && about.type == "std_msgs/String") {
      out.rig = MessageFields(message->data, about.encoding).text();
    } else if (about.name == kBagTruthTopic) {
      if (const auto point = pose_of(message->data, about.encoding, about.type)) out.ground_truth.push_back(*point);
    }
  }
  sort_by_recording(out);
  out.strangers = bag.strangers();
  return out;
}

std::optional<Result<StereoRig>> own_rig(const BagContents& contents, const ChosenTopics& topics) {
  if (contents.rig.empty()) return std::nullopt;
  Result<StereoRig> rig = parse_rig(contents.rig, std::string(kRigTopic));
  if (!rig) return rig;
  std::vector<std::string> named = topics_in(contents.rig);
  if (named.empty())
    for (int i = 0; i < rig->camera_count(); ++i) named.push_back(bag_camera_topic(i));
  std::vector<int> order;
  for (const std::string& topic : topics.cameras) {
    const auto number = static_cast<int>(std::ranges::find(named, topic) - named.begin());
    if (number >= rig->camera_count()) return std::nullopt;
    order.push_back(number);
  }
  if (std::ranges::is_sorted(order) && std::cmp_equal(order.back() + 1, order.size())) return rig;
  return in_order(*rig, order);
}

Result<void> take_camera_info(const std::string& paths, const ChosenTopics& topics, BagContents& contents) {
  std::vector<std::string_view> files;
  split_at_commas(paths, files);
  if (files.size() != topics.cameras.size())
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{}: {} camera_info files for {} cameras", paths, files.size(), topics.cameras.size())};
  std::vector<BagCamera> cameras;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string file(files[i]);
    const Result<std::string> text = read_file(file, kLargestYaml_bytes);
    if (!text) return text.error();
    Result<BagCamera> camera = parse_camera_info_file({file, *text});
    if (!camera) return camera.error();
    std::string topic = topics.cameras[i];
    camera->frame = contents.images.at(topic).frame;
    if (topic.ends_with("/compressed")) topic.erase(topic.rfind('/'));
    contents.cameras.insert_or_assign(topic + "/camera_info", *camera);
    cameras.push_back(*std::move(camera));
  }
  if (cameras.size() != 2 || !cameras[0].rectified || !cameras[1].rectified || cameras[0].frame == cameras[1].frame ||
      find_transform(contents.transforms, cameras[0].frame, cameras[1].frame))
    return {};
  const auto &first = *cameras[0].rectified, &second = *cameras[1].rectified;
  const Pose<B, B> T(Quat(first.R_rectified_raw.transpose() * second.R_rectified_raw),
                     Vec3(first.R_rectified_raw.transpose() * Vec3(second.x_m - first.x_m, 0, 0)));
  contents.transforms.push_back({cameras[0].frame, cameras[1].frame, T.q, T.p});
  return {};
}

Result<StereoRig> rig_of(const BagContents& contents, const ChosenTopics& topics, const std::string& given) {
  const auto missing = [&](const std::string& what) {
    if (!given.empty())
      return Error{ErrorCode::not_found,
                   fmt::format("{} has no place of the cameras on the IMU, nor has the bag ({}): record /tf_static, or give the "
                               "lenses as Kalibr's chain with T_cam_imu",
                               given, printable(what))};
    return Error{ErrorCode::not_found, fmt::format("holds no calibration ({}): give one with --calibration", printable(what))};
  };
  for (const std::string& topic : topics.cameras)
    if (!camera_for(contents, topic))
      return missing(contents.camera_problem.empty() ? fmt::format("no camera_info for {}", topic) : contents.camera_problem);
  const auto imu = contents.imu.find(topics.imu);
  if (imu == contents.imu.end()) return missing("without an IMU the cameras' extrinsics to it are unknown");
  const std::string& body = imu->second.frame;
  std::vector<MountedCamera> cameras;
  const BagCamera& first = *camera_for(contents, topics.cameras.front());
  for (const std::string& topic : topics.cameras) {
    const BagCamera* camera = camera_for(contents, topic);
    const auto T_BC = find_transform(contents.transforms, body, camera->frame);
    if (!T_BC)
      return missing(fmt::format("no transform from '{}' to '{}'{}", camera->frame, body, transforms_there(contents.transforms)));
    MountedCamera mounted{camera->camera, T_BC->cast_frames<B, C0>()};
    if (const auto* rectified = rectified_of(contents, *camera, topic)) {
      // Messages of the second one may name the first one's frame, in whose rectified axes it lies at x.
      const bool in_first = !cameras.empty() && camera->frame == first.frame && first.rectified;
      const Mat3& R = in_first ? first.rectified->R_rectified_raw : rectified->R_rectified_raw;
      mounted = {rectified->camera, mounted.T_BC * Pose<C0, C0>(Mat3(R.transpose()), Vec3::Zero()) *
                                        Pose<C0, C0>(Quat::Identity(), Vec3(in_first ? rectified->x_m : 0.0, 0, 0))};
    }
    cameras.push_back(mounted);
  }
  const StereoRig rig = with_cameras({}, cameras);
  if (Result<void> good = check_rig(rig, "/tf_static"); !good) return good.error();
  return rig;
}

std::vector<std::string> calibrated_cameras(const BagContents& contents, const ChosenTopics& topics) {
  std::vector<std::string> out = topics.cameras;
  const auto imu = contents.imu.find(topics.imu);
  if (out.size() <= 2 || imu == contents.imu.end()) return out;
  const auto is_calibrated = [&](const std::string& topic) {
    const BagCamera* camera = camera_for(contents, topic);
    return camera != nullptr && find_transform(contents.transforms, imu->second.frame, camera->frame);
  };
  out.erase(std::remove_if(out.begin() + 2, out.end(), [&](const std::string& topic) { return !is_calibrated(topic); }),
            out.end());
  return out;
}

std::string not_registered(const BagContents& contents, const ChosenTopics& topics) {
  constexpr double kSameFocalLength = 0.01, kSamePlace_m = 1e-3, kSameDirection = 1e-3;
  const BagCamera *camera = camera_for(contents, topics.cameras.front()), *depth = camera_for(contents, topics.depth);
  if (!camera || !depth) return "";
  const Camera &a = camera->camera, &b = depth->camera;
  if (a.width() != b.width() || a.height() != b.height() ||
      std::abs(a.focal_px() - b.focal_px()) > kSameFocalLength * a.focal_px())
    return fmt::format("their camera_info has {} x {} pixels and {:.1f} px of focal length, the camera's {} x {} and {:.1f} px",
                       b.width(), b.height(), b.focal_px(), a.width(), a.height(), a.focal_px());
  const auto between = find_transform(contents.transforms, camera->frame, depth->frame);
  if (between && (between->p.norm() > kSamePlace_m || between->q.vec().norm() > kSameDirection))
    return fmt::format("they are in the frame '{}', {:.1f} mm from the camera's", printable(depth->frame),
                       1e3 * between->p.norm());
  return "";
}

std::optional<MountedCamera> depth_camera_of(const BagContents& contents, const ChosenTopics& topics, const StereoRig& rig) {
  const BagCamera *camera = camera_for(contents, topics.cameras.front()), *depth = camera_for(contents, topics.depth);
  const auto between = camera && depth ? find_transform(contents.transforms, camera->frame, depth->frame) : std::nullopt;
  if (!between) return std::nullopt;
  return MountedCamera{depth->camera, rig.T_BC0() * between->cast_frames<C0, C0>()};
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/flight_record.hpp"

#include <fmt/format.h>

#include "fbvins/io/rig_text.hpp"
#include "fbvins/io/ros_definitions.hpp"

namespace fbvins {
namespace {

/// Indices in topics().
enum Topic : std::size_t {
  kImu,
  kLeft,
  kRight,
  kLeftInfo,
  kRightInfo,
  kOdometry,
  kLiveOdometry,
  kTransforms,
  kFixedTransforms,
  kHealth,
  kLandmarks,
  kMarks,
  kTruth,
  kFurther,          ///< image and camera_info of each camera from number 2 on
  kDepth = kFurther  ///< of a rig with one camera
};

std::size_t image_topic(int camera) {
  return camera == 0 ? kLeft : camera == 1 ? kRight : kFurther + 2 * static_cast<std::size_t>(camera - 2);
}
std::size_t info_topic(int camera) { return camera == 0 ? kLeftInfo : camera == 1 ? kRightInfo : image_topic(camera) + 1; }

constexpr std::size_t kLargeChunk_bytes = 1'000'000;
// The camera extrinsics are repeated, for viewers that start in the middle.
constexpr Duration kCalibrationInterval = {1'000'000'000};

std::vector<McapTopic> topics(const StereoRig& rig) {
  const auto topic = [](std::string_view name, const char* type) {
    return McapTopic{std::string(name), type, ros_definition(type)};
  };
  std::vector<McapTopic> out = {
      topic(kImuTopic, "sensor_msgs/msg/Imu"),
      topic(kLeftTopic, "sensor_msgs/msg/Image"),
      topic(kRightTopic, "sensor_msgs/msg/Image"),
      topic("/camera/left/camera_info", "sensor_msgs/msg/CameraInfo"),
      topic("/camera/right/camera_info", "sensor_msgs/msg/CameraInfo"),
      topic(kOdometryTopic, "nav_msgs/msg/Odometry"),
      topic("/odometry/live", "nav_msgs/msg/Odometry"),
      topic("/tf", "tf2_msgs/msg/TFMessage"),
      topic("/tf_static", "tf2_msgs/msg/TFMessage"),
      topic(kHealthTopic, "diagnostic_msgs/msg/DiagnosticArray"),
      topic(kLandmarksTopic, "sensor_msgs/msg/PointCloud2"),
      topic(kMarksTopic, "rcl_interfaces/msg/Log"),
      topic(kTruthTopic, "geometry_msgs/msg/PoseStamped"),
  };
  if (rig.depth) out.push_back(topic(kDepthTopic, "sensor_msgs/msg/Image"));
  for (int i = 2; i < rig.camera_count(); ++i) {
    out.push_back(topic(camera_topic(i), "sensor_msgs/msg/Image"));
    out.push_back(topic(camera_topic(i) + "/camera_info", "sensor_msgs/msg/CameraInfo"));
  }
  return out;
}

Result<void> check_stamp(Time t) {
  if (t.ns >= 0 && t < ros_time_end()) return {};
  return Error{ErrorCode::invalid_argument,
               fmt::format("a stamp of {} ns is not recorded: ROS's time reaches from 1970 to 2038", t.ns)};
}

std::string numbers(const Vec3& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }

RosDiagnostic diagnostic_of(const Odometry& o) {
  const EstimatorStats& s = o.stats;
  return {health_level(o.health),
          "odometry",
          to_sentence(o.health),
          {{"state", std::string(to_string(o.health.state))},
           {"reason", std::string(to_string(o.health.reason))},
           {"reset_counter", fmt::to_string(o.reset_counter)},
           {"frame", fmt::to_string(o.id.value)},
           {"keyframe", s.keyframe ? "yes" : "no"},
           {"standstill", s.standstill ? "yes" : "no"},
           {"level", o.level ? "yes" : "no"},
           {"tilt_sigma_rad", fmt::format("{:.6f}", o.tilt_sigma_rad)},
           {"scale_sigma", fmt::format("{:.6f}", o.scale_sigma)},
           {"frames_in_window", fmt::to_string(s.frames_in_window)},
           {"landmarks", fmt::to_string(s.landmarks)},
           {"known_landmarks", fmt::to_string(s.known_landmarks)},
           {"observations", fmt::to_string(s.observations)},
           {"outliers", fmt::to_string(s.outliers)},
           {"iterations", fmt::to_string(s.iterations)},
           {"estimator_ms", fmt::format("{:.2f}", s.total_ms())},
           {"gyro_bias_radps", numbers(o.bias.gyro_radps)},
           {"accel_bias_mps2", numbers(o.bias.accel_mps2)}}};
}

}  // namespace

std::string camera_topic(int camera) {
  return camera == 0 ? std::string(kLeftTopic) : camera == 1 ? std::string(kRightTopic) : fmt::format("/camera/{}", camera);
}

std::uint8_t health_level(const Health& health) {
  if (health.state == HealthState::good) return 0;
  return health.state == HealthState::lost ? 2 : 1;
}

Result<FlightRecord> FlightRecord::create(const std::string& path, const StereoRig& rig, const FlightRecordOptions& options) {
  Result<McapWriter> file = McapWriter::create(path, {"ros2", options.program}, topics(rig));
  if (!file) return file.error();
  const std::string yaml = "application/yaml";
  if (Result<void> done = file->attach(std::string(kCalibrationAttachment), yaml, rig_to_yaml(rig)); !done) return done.error();
  if (Result<void> done = file->attach(std::string(kConfigurationAttachment), yaml, options.configuration); !done)
    return done.error();
  const std::map<std::string, std::string> about = {
      {"record", "1"}, {"program", options.program}, {"images", options.images ? "yes" : "no"}};
  if (Result<void> done = file->add_metadata("fbvins", about); !done) return done.error();
  return FlightRecord(*std::move(file), rig, options.images);
}

template <class Append>
void FlightRecord::write(std::size_t topic, Time t, Append&& append) {
  append(file_.begin_message(topic, t));
  file_.end_message();
}

Result<void> FlightRecord::flush_if_large() { return file_.waiting_bytes() < kLargeChunk_bytes ? Result<void>() : file_.flush(); }

Result<void> FlightRecord::add(const ImuSample& sample) {
  if (Result<void> good = check_stamp(sample.t); !good) return good;
  write(kImu, sample.t, [&](std::string& out) { append_imu(out, sample, rig_.imu_noise); });
  return flush_if_large();
}

/// A frame without any image is recorded as an image without pixels: the estimator processes it as well.
Result<void> FlightRecord::add(const StereoFrame& frame) {
  if (Result<void> good = check_stamp(frame.t); !good) return good;
  if (calibration_t_.ns < 0 || frame.t < calibration_t_ || frame.t - calibration_t_ >= kCalibrationInterval)
    write_calibration(frame.t);
  if (!images_) return flush_if_large();
  std::vector<int> cameras;
  for (int i = 0; i < rig_.camera_count(); ++i)
    if (frame.image(i) || (i == 0 && frame.without_images())) cameras.push_back(i);
  // The images follow one another, so that a record cut off between them is recognised.
  for (const int i : cameras) write_image(i, frame);
  if (frame.depth && rig_.depth)
    write(kDepth, frame.t,
          [&](std::string& out) { append_depth_image(out, frame.t, rig_.depth->own ? kDepthFrame : kLeftFrame, *frame.depth); });
  for (const int i : cameras) write_camera_info(i, frame.t);
  return flush_if_large();
}

/// A sensor's topic, and where it sits, are written with its first reading.
Result<void> FlightRecord::add(const AidingSample& of_images) {
  AidingSample reading = of_images;
  const Time t = stamp_of(reading) = stamp_of(reading) + Duration::from_seconds(rig_.time_offset_s);
  if (Result<void> good = check_stamp(t); !good) return good;
  AidingSensors::Sensor* sensor = aiding_.find(reading);
  if (sensor == nullptr) {
    sensor = &aiding_.add(reading, 0);
    std::string type(aiding_type(reading));
    type.insert(type.find('/'), "/msg");
    const Result<std::size_t> topic = file_.add_topic({"/" + sensor->name, type, ros_definition(type)});
    if (!topic) return topic.error();
    sensor->topic = *topic;
    write_calibration(t);
  }
  write(sensor->topic, t,
        [&](std::string& out) { out += aiding_message(reading, sensor->T_BS ? sensor->name : kBodyFrame, Encoding::cdr); });
  return flush_if_large();
}

void FlightRecord::write_image(int camera, const StereoFrame& frame) {
  const Time t = frame.t + frame.offsets.of(camera);
  write(image_topic(camera), frame.t,
        [&](std::string& out) { append_image(out, t, camera_frame(camera), frame.image(camera).get()); });
}

void FlightRecord::write_camera_info(int camera, Time t) {
  write(info_topic(camera), t, [&](std::string& out) { append_camera_info(out, t, camera_frame(camera), rig_.camera(camera)); });
}

void FlightRecord::write_calibration(Time t) {
  std::vector<std::string> names;
  for (int i = 0; i < rig_.camera_count(); ++i) names.push_back(camera_frame(i));
  std::vector<RosTransform> cameras;
  for (int i = 0; i < rig_.camera_count(); ++i)
    cameras.push_back({kBodyFrame, names[static_cast<std::size_t>(i)], rig_.T_BC(i).q, rig_.T_BC(i).p});
  if (const auto& depth = rig_.depth; depth && depth->own)
    cameras.push_back({kBodyFrame, kDepthFrame, depth->own->T_BC.q, depth->own->T_BC.p});
  for (const AidingSensors::Sensor& sensor : aiding_.all())
    if (sensor.T_BS) cameras.push_back({kBodyFrame, sensor.name, sensor.T_BS->q, sensor.T_BS->p});
  write(kFixedTransforms, t, [&](std::string& out) { append_transforms(out, t, cameras); });
  calibration_t_ = t;
}

Result<void> FlightRecord::add(const Odometry& o) {
  if (Result<void> good = check_stamp(o.t); !good) return good;
  const RosDiagnostic health = diagnostic_of(o);
  write(kHealth, o.t, [&](std::string& out) { append_diagnostics(out, o.t, {&health, 1}); });
  if (!o.health.has_pose()) return flush_if_large();
  const ImuNoise& noise = rig_.imu_noise;
  const double reading = noise.gyro_noise_density_radps_rthz * noise.gyro_noise_density_radps_rthz * noise.rate_hz;
  rate_covariance_ = o.gyro_bias_covariance + reading * Mat3::Identity();
  const RosOdometry message{o.t, o.T_WB, o.v_WB, o.w_WB_B, o.pose_covariance, o.velocity_covariance, rate_covariance_};
  write(kOdometry, o.t, [&](std::string& out) { append_odometry(out, message); });
  const Pose<W, G> T_WG = o.T_WB * o.gauge.T_GB.inverse();
  const RosTransform frames[] = {{kOdometryFrame, kBodyFrame, o.T_WB.q, o.T_WB.p}, {kOdometryFrame, kGaugeFrame, T_WG.q, T_WG.p}};
  write(kTransforms, o.t, [&](std::string& out) { append_transforms(out, o.t, frames); });
  return flush_if_large();
}

Result<void> FlightRecord::add(const MapUpdate& update) {
  if (Result<void> good = check_stamp(update.t); !good || !update.localised) return good;
  const RosTransform odometry[] = {{kMapFrame, kOdometryFrame, update.T_MW.q, update.T_MW.p}};
  write(kTransforms, update.t, [&](std::string& out) { append_transforms(out, update.t, odometry); });
  return flush_if_large();
}

Result<void> FlightRecord::add_live(RosOdometry odometry) {
  if (Result<void> good = check_stamp(odometry.t); !good) return good;
  odometry.rate_covariance = rate_covariance_;
  write(kLiveOdometry, odometry.t, [&](std::string& out) { append_odometry(out, odometry); });
  return flush_if_large();
}

Result<void> FlightRecord::add_landmarks(Time t, std::span<const RosLandmark> landmarks) {
  if (Result<void> good = check_stamp(t); !good) return good;
  write(kLandmarks, t, [&](std::string& out) { append_landmarks(out, t, landmarks); });
  return flush_if_large();
}

Result<void> FlightRecord::add_mark(Time t, std::string_view text) {
  if (Result<void> good = check_stamp(t); !good) return good;
  write(kMarks, t, [&](std::string& out) { append_log(out, t, "mark", text.empty() ? "mark" : text); });
  return flush_if_large();
}

Result<void> FlightRecord::add_truth(Time t, const Pose<W, B>& T_WB) {
  if (Result<void> good = check_stamp(t); !good) return good;
  write(kTruth, t, [&](std::string& out) { append_pose(out, t, "world", T_WB); });
  return flush_if_large();
}

Result<void> FlightRecord::add_health(Time t, const RosDiagnostic& diagnostic) {
  if (Result<void> good = check_stamp(t); !good) return good;
  write(kHealth, t, [&](std::string& out) { append_diagnostics(out, t, {&diagnostic, 1}); });
  return flush_if_large();
}

}  // namespace fbvins

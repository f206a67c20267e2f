// SPDX-License-Identifier: Apache-2.0
// Private: our values as ROS 2's messages in bytes, and back. Pure functions, any thread.
//
//   append_imu(bytes, sample, noise);
//   std::optional<ImuSample> sample = read_imu(bytes);      // the same doubles, the same nanosecond
//
// Stamps are whole nanoseconds from 0 to ros_time_end(), where ROS's seconds overflow (2038).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

// Names of frames in messages: M, W, G, B, C0, C1 (docs/conventions.md).
inline constexpr std::string_view kMapFrame = "map", kOdometryFrame = "odom", kGaugeFrame = "gauge", kBodyFrame = "body",
                                  kLeftFrame = "camera_left", kRightFrame = "camera_right",
                                  kDepthFrame = "depth";  // of a depth sensor that lies elsewhere

/// The frame of camera 0 (left), 1 (right), or a further one: "camera_2".
std::string camera_frame(int camera);

constexpr Time ros_time_end() { return {(std::int64_t{1} << 31) * 1'000'000'000}; }

void append_imu(std::string& out, const ImuSample& sample, const ImuNoise& noise);
/// mono8. Null: an image without pixels.
void append_image(std::string& out, Time t, std::string_view frame, const Image* image);
/// 16UC1, millimetres.
void append_depth_image(std::string& out, Time t, std::string_view frame, const DepthImage& depth);
/// What camera_info calls a lens: ROS's own names where it has them, else Camera::model_name() and Camera::distortion().
struct RosLens {
  std::string model;
  std::vector<double> coefficients;
};
RosLens ros_lens(const Camera& camera);
void append_camera_info(std::string& out, Time t, std::string_view frame, const Camera& camera);

/// A pose with its derivatives, in our conventions; the message has ROS's: velocities in the body, angles about the axes of W.
/// The body may be any frame that is fixed to it.
struct RosOdometry {
  Time t;
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero(), w_WB_B = Vec3::Zero();
  Mat6 pose_covariance = Mat6::Zero();      ///< of (dp in W, dtheta in B)
  Mat3 velocity_covariance = Mat3::Zero();  ///< of v_WB
  Mat3 rate_covariance = Mat3::Zero();      ///< of w_WB_B
  std::string_view frame = kOdometryFrame, child_frame = kBodyFrame;
  bool after_reset = false;  ///< covariances are kAfterReset on the diagonal instead
};
/// What RTAB-Map takes for an odometry that began anew, and every filter for no information.
inline constexpr double kAfterReset = 9999;
void append_odometry(std::string& out, const RosOdometry& odometry);

/// geometry_msgs/PoseStamped.
void append_pose(std::string& out, Time t, std::string_view frame, const Pose<W, B>& T);

/// nav_msgs/Path of poses in W.
void append_path(std::string& out, Time t, const Trajectory<W>& path, std::string_view frame = kOdometryFrame);

struct RosTransform {
  std::string_view to, from;  ///< frames: takes coordinates in `from` to `to`, ROS's parent
  Quat q;
  Vec3 p;
};
void append_transforms(std::string& out, Time t, std::span<const RosTransform> transforms);

/// A point of sensor_msgs/PointCloud2 in W, with its observation in the left camera's newest image. What is unknown is NaN: p_W
/// of a feature without a landmark, pixel of a landmark that the image does not show.
struct RosLandmark {
  std::uint32_t track = 0;
  std::array<float, 3> p_W{};    ///< m
  std::array<float, 2> pixel{};  ///< in the raw image, px
  float age_frames = 0;
  float depth_m = 0;
};
void append_landmarks(std::string& out, Time t, std::span<const RosLandmark> landmarks, std::string_view frame = kOdometryFrame);

/// rmw_dds_common/ParticipantEntitiesInfo: one node in a participant, with the topics that it reads and writes. DDS's identifiers
/// have 16 bytes; Humble's message has room for 24.
using DdsGuid = std::array<std::uint8_t, 16>;
struct RosNode {
  std::string name_space, name;  ///< "/", "fbvins"
  std::vector<DdsGuid> readers, writers;
};
void append_node(std::string& out, const DdsGuid& participant, const RosNode& node, bool humble);

/// rcl_interfaces/Log of level INFO.
void append_log(std::string& out, Time t, std::string_view name, std::string_view text);

/// Level: 0 fine, 1 warning, 2 error.
struct RosDiagnostic {
  std::uint8_t level = 0;
  std::string name, message;
  std::vector<std::pair<std::string, std::string>> values;
};
void append_diagnostics(std::string& out, Time t, std::span<const RosDiagnostic> diagnostics);

/// Nullopt for bytes that are no such message.
std::optional<ImuSample> read_imu(std::string_view bytes);

/// A stamped pose in whatever frames the message names.
struct RosPose {
  Time t;
  Quat q;  ///< as sent
  Vec3 p;
};
/// PoseStamped; Odometry's pose.
/// Of a tf2_msgs/TFMessage, those from the body: frame and pose in it.
std::vector<std::pair<std::string, Pose<B, B>>> read_mountings(std::string_view bytes);
std::optional<RosPose> read_pose(std::string_view bytes);
std::optional<RosPose> read_odometry(std::string_view bytes);

struct RosImage {
  Time t;
  std::uint32_t width = 0, height = 0, step = 0;
  std::string_view encoding, pixels;  ///< in the bytes given

  bool is_grey() const { return encoding == "mono8" || encoding == "8UC1"; }
  /// Little-endian, as all our machines are.
  bool is_depth() const { return encoding == "16UC1"; }
  /// A frame without an image of this camera.
  bool empty() const { return width == 0 && height == 0; }
};
/// Nullopt also where a grey image, or one of depths, has fewer pixels than its size needs.
std::optional<RosImage> read_image(std::string_view bytes);

}  // namespace fbvins

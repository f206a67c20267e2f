// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/ros1_messages.hpp"

#include <fmt/format.h>

#include <array>
#include <initializer_list>
#include <utility>

#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/core/overloaded.hpp"
#include "fbvins/io/little_endian.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins::ros1 {
namespace {

// Fields of messages, as ROS 1 writes them into connections.
constexpr const char* kImuFields =
    "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n";
constexpr const char* kImageFields =
    "Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";
constexpr const char* kCameraFields =
    "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n"
    "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n";
constexpr std::pair<const char*, const char*> kHeader{"std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n"};
constexpr std::pair<const char*, const char*> kVector{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr std::pair<const char*, const char*> kPoint{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr std::pair<const char*, const char*> kPose{"geometry_msgs/Pose",
                                                    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"};
constexpr std::pair<const char*, const char*> kQuaternion{"geometry_msgs/Quaternion",
                                                          "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"};
constexpr std::pair<const char*, const char*> kRegion{
    "sensor_msgs/RegionOfInterest", "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"};
constexpr std::pair<const char*, const char*> kTransformStamped{
    "geometry_msgs/TransformStamped", "Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"};
constexpr std::pair<const char*, const char*> kTransform{
    "geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"};

/// A type's fields, and below them those of the types it is made of.
std::string definition(const char* fields, std::initializer_list<std::pair<const char*, const char*>> parts) {
  std::string out = fields;
  for (const auto& [name, part] : parts) out += fmt::format("{:=<80}\nMSG: {}\n{}", "", name, part);
  return out;
}

void add_text(std::string& out, std::string_view text) {
  append_le(out, static_cast<std::uint32_t>(text.size()));
  out.append(text);
}
void add_header(std::string& out, Time t, std::string_view frame) {
  append_le(out, std::uint32_t{0});
  append_le(out, ros_time(t));
  add_text(out, frame);
}
void add_doubles(std::string& out, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) append_le(out, values[i]);
}
void add_quaternion(std::string& out, const Quat& q) {
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) append_le(out, value);
}

/// All before the pixels, whose rows follow one another.
std::string image_header(Time t, std::string_view frame, int width, int height, const char* encoding, int pixel_bytes) {
  std::string out;
  add_header(out, t, frame);
  append_le(out, static_cast<std::uint32_t>(height));
  append_le(out, static_cast<std::uint32_t>(width));
  add_text(out, encoding);
  append_le(out, std::uint8_t{0});
  append_le(out, static_cast<std::uint32_t>(width * pixel_bytes));
  append_le(out, static_cast<std::uint32_t>(std::int64_t{width} * pixel_bytes * height));
  return out;
}

}  // namespace

std::uint32_t image_number(int camera) {
  return camera == 0 ? kLeft : camera == 1 ? kRight : kFurther + 2 * static_cast<std::uint32_t>(camera - 2);
}
std::uint32_t info_number(int camera) { return camera == 0 ? kLeftInfo : camera == 1 ? kRightInfo : image_number(camera) + 1; }

std::vector<Topic> topics(const StereoRig& rig) {
  const std::string imu = definition(kImuFields, {kHeader, kQuaternion, kVector}), image = definition(kImageFields, {kHeader}),
                    camera = definition(kCameraFields, {kHeader, kRegion}),
                    transforms = definition("geometry_msgs/TransformStamped[] transforms\n",
                                            {kTransformStamped, kHeader, kTransform, kVector, kQuaternion});
  constexpr const char *kImage = "060021388200f6f0f447d0fcd9c64743", *kCamera = "c9a58c1b0b154e0e6da7578cb991d214";
  std::vector<Topic> out = {{"/imu0", "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2", imu},
                            {bag_camera_topic(0), "sensor_msgs/Image", kImage, image},
                            {bag_camera_topic(1), "sensor_msgs/Image", kImage, image},
                            {"/cam0/camera_info", "sensor_msgs/CameraInfo", kCamera, camera},
                            {"/cam1/camera_info", "sensor_msgs/CameraInfo", kCamera, camera},
                            {"/tf_static", "tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec", transforms},
                            {std::string(kRigTopic), "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n"},
                            {std::string(kBagTruthTopic), "geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5",
                             definition("Header header\ngeometry_msgs/Pose pose\n", {kHeader, kPose, kPoint, kQuaternion})},
                            {std::string(kBagOdometryTopic), "geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5",
                             definition("Header header\ngeometry_msgs/Pose pose\n", {kHeader, kPose, kPoint, kQuaternion})}};
  if (rig.depth) out.push_back({std::string(kBagDepthTopic), "sensor_msgs/Image", kImage, image});
  if (rig.depth && rig.depth->own) out.push_back({"/depth0/camera_info", "sensor_msgs/CameraInfo", kCamera, camera});
  for (int i = 2; i < rig.camera_count(); ++i) {
    out.push_back({bag_camera_topic(i), "sensor_msgs/Image", kImage, image});
    out.push_back({fmt::format("/cam{}/camera_info", i), "sensor_msgs/CameraInfo", kCamera, camera});
  }
  return out;
}

Topic aiding_topic(const std::string& name, const AidingSample& reading) {
  constexpr std::pair<const char*, const char*> kTwist{"geometry_msgs/Twist",
                                                       "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      kTwistWithCovariance{"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"};
  return std::visit(
      Overloaded{[&](const RangeSample&) {
                   return Topic{
                       name, "sensor_msgs/Range", "c005c34273dc426c67a020a87bc24148",
                       definition(
                           "uint8 ULTRASOUND=0\nuint8 INFRARED=1\nHeader header\nuint8 radiation_type\nfloat32 field_of_view\n"
                           "float32 min_range\nfloat32 max_range\nfloat32 range\n",
                           {kHeader})};
                 },
                 [&](const VelocitySample&) {
                   return Topic{name, "geometry_msgs/TwistWithCovarianceStamped", "8927a1a12fb2607ceea095b2dc440a96",
                                definition("Header header\ngeometry_msgs/TwistWithCovariance twist\n",
                                           {kHeader, kTwistWithCovariance, kTwist, kVector})};
                 },
                 [&](const PressureSample&) {
                   return Topic{name, "sensor_msgs/FluidPressure", "804dc5cea1c5306d6a2eb80b9833befe",
                                definition("Header header\nfloat64 fluid_pressure\nfloat64 variance\n", {kHeader})};
                 }},
      reading);
}

std::string transform_message(Time t, std::string_view frame, const Pose<B, B>& T_BS) {
  std::string out;
  append_le(out, std::uint32_t{1});
  add_header(out, t, kBodyFrame);
  add_text(out, frame);
  add_doubles(out, T_BS.p.data(), 3);
  add_quaternion(out, T_BS.q);
  return out;
}

std::uint64_t ros_time(Time t) {
  return static_cast<std::uint64_t>(t.ns / kSecond_ns) | static_cast<std::uint64_t>(t.ns % kSecond_ns) << 32u;
}

std::string imu_message(const ImuSample& sample) {
  std::string out;
  std::array<double, 9> unknown{};
  add_header(out, sample.t, kBodyFrame);
  add_quaternion(out, Quat::Identity());
  unknown[0] = -1;  // how ROS marks that there is no orientation
  add_doubles(out, unknown.data(), 9);
  unknown[0] = 0;
  add_doubles(out, sample.gyro_radps.data(), 3);
  add_doubles(out, unknown.data(), 9);
  add_doubles(out, sample.accel_mps2.data(), 3);
  add_doubles(out, unknown.data(), 9);
  return out;
}

std::string image_message(Time t, std::string_view frame, const Image& image) {
  std::string out = image_header(t, frame, image.width(), image.height(), "mono8", 1);
  const std::size_t row = static_cast<std::size_t>(image.width());
  for (int y = 0; y < image.height(); ++y) out.append(reinterpret_cast<const char*>(image.row(y)), row);
  return out;
}

std::string depth_message(Time t, std::string_view frame, const DepthImage& depth) {
  std::string out = image_header(t, frame, depth.width, depth.height, "16UC1", 2);
  return out.append(reinterpret_cast<const char*>(depth.mm.data()), 2 * depth.mm.size());
}

std::string camera_message(Time t, std::string_view frame, const Camera& camera) {
  const RosLens lens = ros_lens(camera);
  const std::array<double, 4> f = camera.intrinsics();
  const std::array<double, 9> K{f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1}, R{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<double, 12> P{f[0], 0, f[2], 0, 0, f[1], f[3], 0, 0, 0, 1, 0};
  std::string out;
  add_header(out, t, frame);
  append_le(out, static_cast<std::uint32_t>(camera.height()));
  append_le(out, static_cast<std::uint32_t>(camera.width()));
  add_text(out, lens.model);
  append_le(out, static_cast<std::uint32_t>(lens.coefficients.size()));
  add_doubles(out, lens.coefficients.data(), lens.coefficients.size());
  add_doubles(out, K.data(), 9);
  add_doubles(out, R.data(), 9);
  add_doubles(out, P.data(), 12);
  return out.append(6 * sizeof(std::uint32_t) + 1, '\0');  // no binning, no region of interest
}

std::string transforms_message(Time t, const StereoRig& rig) {
  std::string out;
  const bool depth_elsewhere = rig.depth && rig.depth->own;
  append_le(out, static_cast<std::uint32_t>(rig.camera_count() + depth_elsewhere));
  const auto add = [&](const std::string& frame, const Pose<B, C0>& T_BC) {
    add_header(out, t, kBodyFrame);
    add_text(out, frame);
    add_doubles(out, T_BC.p.data(), 3);
    add_quaternion(out, T_BC.q);
  };
  for (int i = 0; i < rig.camera_count(); ++i) add(camera_frame(i), rig.T_BC(i));
  if (depth_elsewhere) add(std::string(kDepthFrame), rig.depth->own->T_BC);
  return out;
}

std::string text_message(std::string_view text) {
  std::string out;
  add_text(out, text);
  return out;
}

std::string pose_message(Time t, std::string_view frame, const Pose<W, B>& T_WB) {
  std::string out;
  add_header(out, t, frame);
  add_doubles(out, T_WB.p.data(), 3);
  add_quaternion(out, T_WB.q);
  return out;
}

}  // namespace fbvins::ros1

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/ros_messages.hpp"

#include <fmt/format.h>

#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/io/cdr.hpp"

namespace fbvins {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using RowMajor6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

void put_header(CdrWriter& cdr, Time t, std::string_view frame) {
  cdr.put(static_cast<std::int32_t>(t.ns / kSecond_ns));
  cdr.put(static_cast<std::uint32_t>(t.ns % kSecond_ns));
  cdr.text(frame);
}

void put(CdrWriter& cdr, const Vec3& v) { cdr.array({v.data(), 3}); }
void put(CdrWriter& cdr, const Quat& q) { put(cdr, Vec3(q.vec())), cdr.put(q.w()); }
void put(CdrWriter& cdr, const RowMajor3& m) { cdr.array({m.data(), 9}); }
void put(CdrWriter& cdr, const RowMajor6& m) { cdr.array({m.data(), 36}); }

std::optional<Time> get_header(CdrReader& cdr) {
  const auto seconds = cdr.get<std::int32_t>();
  const auto nanoseconds = cdr.get<std::uint32_t>();
  cdr.text();  // frame
  if (!cdr.ok() || seconds < 0 || nanoseconds >= kSecond_ns) return std::nullopt;
  return Time{seconds * kSecond_ns + nanoseconds};
}

Vec3 get_vector(CdrReader& cdr) {
  const double x = cdr.get<double>(), y = cdr.get<double>(), z = cdr.get<double>();
  return {x, y, z};
}

std::optional<RosPose> get_pose(CdrReader& cdr, Time t) {
  RosPose pose{t, Quat::Identity(), get_vector(cdr)};
  const Vec3 xyz = get_vector(cdr);
  pose.q = Quat(cdr.get<double>(), xyz.x(), xyz.y(), xyz.z());
  if (!cdr.ok()) return std::nullopt;
  return pose;
}

/// Variance of a single reading.
RowMajor3 of_readings(double density, double rate_hz) { return density * density * rate_hz * RowMajor3::Identity(); }

}  // namespace

std::string camera_frame(int camera) {
  return camera == 0 ? std::string(kLeftFrame) : camera == 1 ? std::string(kRightFrame) : fmt::format("camera_{}", camera);
}

void append_imu(std::string& out, const ImuSample& sample, const ImuNoise& noise) {
  CdrWriter cdr(out);
  put_header(cdr, sample.t, kBodyFrame);
  put(cdr, Quat::Identity());
  RowMajor3 unknown = RowMajor3::Zero();
  unknown(0, 0) = -1;  // how ROS marks that there is no orientation
  put(cdr, unknown);
  put(cdr, sample.gyro_radps);
  put(cdr, of_readings(noise.gyro_noise_density_radps_rthz, noise.rate_hz));
  put(cdr, sample.accel_mps2);
  put(cdr, of_readings(noise.accel_noise_density_mps2_rthz, noise.rate_hz));
}

void append_image(std::string& out, Time t, std::string_view frame, const Image* image) {
  CdrWriter cdr(out);
  const ImageView view = image ? image->view() : ImageView{};
  put_header(cdr, t, frame);
  cdr.put(static_cast<std::uint32_t>(view.height));
  cdr.put(static_cast<std::uint32_t>(view.width));
  cdr.text("mono8");
  cdr.put(std::uint8_t{0});  // not big-endian
  cdr.put(static_cast<std::uint32_t>(view.width));
  cdr.count(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  for (int y = 0; y < view.height; ++y) cdr.raw(view.row(y), static_cast<std::size_t>(view.width));
}

void append_depth_image(std::string& out, Time t, std::string_view frame, const DepthImage& depth) {
  CdrWriter cdr(out);
  put_header(cdr, t, frame);
  cdr.put(static_cast<std::uint32_t>(depth.height));
  cdr.put(static_cast<std::uint32_t>(depth.width));
  cdr.text("16UC1");
  cdr.put(std::uint8_t{0});  // not big-endian
  cdr.put(static_cast<std::uint32_t>(2 * depth.width));
  cdr.count(2 * depth.mm.size());
  cdr.raw(depth.mm.data(), 2 * depth.mm.size());
}

RosLens ros_lens(const Camera& camera) {
  OpencvCoefficients lens = opencv_coefficients(camera);
  return {std::move(lens.ros_model), std::move(lens.values)};
}

void append_camera_info(std::string& out, Time t, std::string_view frame, const Camera& camera) {
  const RosLens lens = ros_lens(camera);
  const std::array<double, 4> f = camera.intrinsics();
  RowMajor3 K = RowMajor3::Identity();
  K(0, 0) = f[0], K(1, 1) = f[1], K(0, 2) = f[2], K(1, 2) = f[3];
  CdrWriter cdr(out);
  put_header(cdr, t, frame);
  cdr.put(static_cast<std::uint32_t>(camera.height()));
  cdr.put(static_cast<std::uint32_t>(camera.width()));
  cdr.text(lens.model);
  cdr.count(lens.coefficients.size());
  cdr.array(lens.coefficients);
  put(cdr, K);
  put(cdr, RowMajor3(RowMajor3::Identity()));  // the images are not rectified
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) cdr.put(K(row, column));
    cdr.put(0.0);
  }
  for (int i = 0; i < 6; ++i) cdr.put(std::uint32_t{0});  // no binning, no region of interest
  cdr.put(std::uint8_t{0});
}

void append_odometry(std::string& out, const RosOdometry& o) {
  const Mat3 R_WB = o.T_WB.R();
  Mat6 to_W = Mat6::Identity();
  to_W.bottomRightCorner<3, 3>() = R_WB;
  RowMajor6 pose_covariance = to_W * o.pose_covariance * to_W.transpose();
  RowMajor6 twist_covariance = RowMajor6::Zero();
  twist_covariance.topLeftCorner<3, 3>() = R_WB.transpose() * o.velocity_covariance * R_WB;
  twist_covariance.bottomRightCorner<3, 3>() = o.rate_covariance;
  if (o.after_reset) pose_covariance = twist_covariance = kAfterReset * RowMajor6::Identity();
  CdrWriter cdr(out);
  put_header(cdr, o.t, o.frame);
  cdr.text(o.child_frame);
  put(cdr, o.T_WB.p);
  put(cdr, o.T_WB.q);
  put(cdr, pose_covariance);
  put(cdr, Vec3(R_WB.transpose() * o.v_WB));
  put(cdr, o.w_WB_B);
  put(cdr, twist_covariance);
}

void append_pose(std::string& out, Time t, std::string_view frame, const Pose<W, B>& T) {
  CdrWriter cdr(out);
  put_header(cdr, t, frame);
  put(cdr, T.p);
  put(cdr, T.q);
}

void append_path(std::string& out, Time t, const Trajectory<W>& path, std::string_view frame) {
  CdrWriter cdr(out);
  put_header(cdr, t, frame);
  cdr.count(path.size());
  for (const StampedPose<W>& pose : path) {
    put_header(cdr, pose.t, frame);
    put(cdr, pose.T.p);
    put(cdr, pose.T.q);
  }
}

void append_transforms(std::string& out, Time t, std::span<const RosTransform> transforms) {
  CdrWriter cdr(out);
  cdr.count(transforms.size());
  for (const RosTransform& transform : transforms) {
    put_header(cdr, t, transform.to);
    cdr.text(transform.from);
    put(cdr, transform.p);
    put(cdr, transform.q);
  }
}

namespace {

struct PointField {
  const char* name;
  std::uint8_t type;  ///< 6: uint32, 7: float32
};
constexpr PointField kLandmarkFields[] = {{"x", 7}, {"y", 7}, {"z", 7},   {"track", 6},
                                          {"u", 7}, {"v", 7}, {"age", 7}, {"depth", 7}};
constexpr std::uint32_t kLandmark_bytes = 4 * std::size(kLandmarkFields);

}  // namespace

void append_landmarks(std::string& out, Time t, std::span<const RosLandmark> landmarks, std::string_view frame) {
  const auto count = static_cast<std::uint32_t>(landmarks.size());
  CdrWriter cdr(out);
  put_header(cdr, t, frame);
  cdr.put(std::uint32_t{1});
  cdr.put(count);
  cdr.count(std::size(kLandmarkFields));
  for (std::uint32_t offset = 0; const PointField& field : kLandmarkFields) {
    cdr.text(field.name);
    cdr.put(offset);
    cdr.put(field.type);
    cdr.put(std::uint32_t{1});
    offset += 4;
  }
  cdr.put(std::uint8_t{0});  // not big-endian
  cdr.put(kLandmark_bytes);
  cdr.put(kLandmark_bytes * count);
  cdr.count(kLandmark_bytes * count);
  for (const RosLandmark& l : landmarks) {
    for (const float x : l.p_W) cdr.put(x);
    cdr.put(l.track);
    for (const float number : {l.pixel[0], l.pixel[1], l.age_frames, l.depth_m}) cdr.put(number);
  }
  cdr.put(std::uint8_t{0});  // not dense: some are NaN
}

void append_node(std::string& out, const DdsGuid& participant, const RosNode& node, bool humble) {
  CdrWriter cdr(out);
  const auto put_guid = [&](const DdsGuid& guid) {
    cdr.raw(guid.data(), guid.size());
    if (humble) out.append(8, '\0');
  };
  const auto put_guids = [&](const std::vector<DdsGuid>& guids) {
    cdr.count(guids.size());
    for (const DdsGuid& guid : guids) put_guid(guid);
  };
  put_guid(participant);
  cdr.count(1);
  cdr.text(node.name_space);
  cdr.text(node.name);
  put_guids(node.readers);
  put_guids(node.writers);
}

void append_log(std::string& out, Time t, std::string_view name, std::string_view text) {
  constexpr std::uint8_t kInfo = 20;
  CdrWriter cdr(out);
  cdr.put(static_cast<std::int32_t>(t.ns / kSecond_ns));
  cdr.put(static_cast<std::uint32_t>(t.ns % kSecond_ns));
  cdr.put(kInfo);
  cdr.text(name);
  cdr.text(text);
  cdr.text("");  // file
  cdr.text("");  // function
  cdr.put(std::uint32_t{0});
}

void append_diagnostics(std::string& out, Time t, std::span<const RosDiagnostic> diagnostics) {
  CdrWriter cdr(out);
  put_header(cdr, t, "");
  cdr.count(diagnostics.size());
  for (const RosDiagnostic& diagnostic : diagnostics) {
    cdr.put(diagnostic.level);
    cdr.text(diagnostic.name);
    cdr.text(diagnostic.message);
    cdr.text("");  // hardware
    cdr.count(diagnostic.values.size());
    for (const auto& [key, value] : diagnostic.values) {
      cdr.text(key);
      cdr.text(value);
    }
  }
}

std::optional<ImuSample> read_imu(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  if (!t) return std::nullopt;
  ImuSample sample{*t};
  constexpr int kOrientation = 4 + 9, kCovariance = 9;
  for (int i = 0; i < kOrientation; ++i) cdr.get<double>();
  sample.gyro_radps = get_vector(cdr);
  for (int i = 0; i < kCovariance; ++i) cdr.get<double>();
  sample.accel_mps2 = get_vector(cdr);
  for (int i = 0; i < kCovariance; ++i) cdr.get<double>();
  if (!cdr.ok()) return std::nullopt;
  return sample;
}

std::vector<std::pair<std::string, Pose<B, B>>> read_mountings(std::string_view bytes) {
  CdrReader cdr(bytes);
  std::vector<std::pair<std::string, Pose<B, B>>> out;
  const auto count = cdr.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && cdr.ok(); ++i) {
    cdr.get<std::int32_t>(), cdr.get<std::uint32_t>();  // the stamp
    const std::string parent(cdr.text()), child(cdr.text());
    const std::optional<RosPose> pose = get_pose(cdr, Time{});
    if (!pose || parent != kBodyFrame || !pose->p.allFinite() || !(std::abs(pose->q.norm() - 1) < 1e-3)) continue;
    out.emplace_back(child, Pose<B, B>{pose->q.normalized(), pose->p});
  }
  return out;
}

std::optional<RosPose> read_pose(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  return t ? get_pose(cdr, *t) : std::nullopt;
}

std::optional<RosPose> read_odometry(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  cdr.text();  // the body's frame
  return t ? get_pose(cdr, *t) : std::nullopt;
}

std::optional<RosImage> read_image(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  if (!t) return std::nullopt;
  RosImage image;
  image.t = *t;
  image.height = cdr.get<std::uint32_t>();
  image.width = cdr.get<std::uint32_t>();
  image.encoding = cdr.text();
  cdr.get<std::uint8_t>();  // is_bigendian says nothing about bytes
  image.step = cdr.get<std::uint32_t>();
  image.pixels = cdr.bytes();
  const std::uint64_t row = std::uint64_t{image.width} * (image.is_depth() ? 2 : 1);
  const bool fits = !(image.is_grey() || image.is_depth()) || image.empty() ||
                    (image.step >= row && std::uint64_t{image.step} * image.height <= image.pixels.size());
  if (!cdr.ok() || !fits) return std::nullopt;
  return image;
}

}  // namespace fbvins

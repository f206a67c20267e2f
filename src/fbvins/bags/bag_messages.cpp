// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/bags/depth_image.hpp"
#include "fbvins/bags/grey_image.hpp"
#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr double kLargestImuValue = 1e6;  // rad/s or m/s^2: far above the range of any sensor

bool is_usable(const Vec3& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= kLargestImuValue; }

std::vector<double> doubles(MessageFields& in, std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count && in.ok(); ++i) out.push_back(in.get<double>());
  return out;
}

/// Translation, then rotation.
std::optional<BagTransform> read_transform(MessageFields& in) {
  const Vec3 p = in.vector();
  const Quat q = in.quaternion();
  if (!in.ok() || !(std::abs(q.norm() - 1) < 1e-3) || !p.allFinite()) return std::nullopt;
  return BagTransform{"", "", q.normalized(), p};
}

/// Behind the header.
RawImage raw_image(MessageFields& in) {
  RawImage raw;
  raw.height = in.get<std::uint32_t>();
  raw.width = in.get<std::uint32_t>();
  raw.encoding = in.text();
  raw.big_endian = in.get<std::uint8_t>() != 0;
  raw.step = in.get<std::uint32_t>();
  raw.pixels = in.bytes();
  return raw;
}

/// librealsense's names of lens models. Rectified images, which is what its infrared ones are, have none of these distortions.
bool is_straight(std::string_view model, const std::vector<double>& d) {
  return (model == "None" || model.ends_with("Brown Conrady")) &&
         std::all_of(d.begin(), d.end(), [](double x) { return x == 0; });
}

/// More coefficients than ours must be zero.
bool fits_four(const std::vector<double>& d) {
  for (std::size_t i = 4; i < d.size(); ++i)
    if (d[i] != 0) return false;
  return true;
}

}  // namespace

std::optional<ImuSample> imu_of(std::string_view bytes, Encoding encoding) {
  constexpr int kOrientation = 4 + 9, kCovariance = 9;
  MessageFields in(bytes, encoding);
  ImuSample sample{in.header()};
  in.skip_doubles(kOrientation);
  sample.gyro_radps = in.vector();
  in.skip_doubles(kCovariance);
  sample.accel_mps2 = in.vector();
  in.skip_doubles(kCovariance);
  if (!in.ok() || !is_usable(sample.gyro_radps) || !is_usable(sample.accel_mps2)) return std::nullopt;
  return sample;
}

std::optional<Time> stamp_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  const Time t = in.header();
  return in.ok() ? std::optional(t) : std::nullopt;
}

Result<Image> image_of(std::string_view bytes, Encoding encoding, bool compressed, int used_bits) {
  MessageFields in(bytes, encoding);
  in.header();
  if (compressed) {
    in.text();  // the format, which the bytes tell themselves
    const std::string_view file = in.bytes();
    if (!in.ok()) return Error{ErrorCode::malformed, "this is no compressed image"};
    return decode_image(file);
  }
  RawImage raw = raw_image(in);
  if (!in.ok()) return Error{ErrorCode::malformed, "this is no image"};
  raw.used_bits = used_bits;
  return grey_image(raw);
}

Result<DepthImage> depth_of(std::string_view bytes, Encoding encoding, bool compressed) {
  constexpr std::size_t kBeforePng_bytes = 12;  // compressedDepth: a format, and two figures of inverse depths
  constexpr std::string_view kPng = "\x89PNG";
  MessageFields in(bytes, encoding);
  in.header();
  if (!compressed) {
    const RawImage raw = raw_image(in);
    if (!in.ok()) return Error{ErrorCode::malformed, "this is no image"};
    return depth_image(raw);
  }
  const std::string format(in.text());
  std::string_view file = in.bytes();
  if (!in.ok()) return Error{ErrorCode::malformed, "this is no compressed image"};
  if (format.starts_with("32FC1"))
    return Error{ErrorCode::unsupported, "depths that are compressed floats cannot be read, only 16UC1 compressed as PNG"};
  if (!file.starts_with(kPng) && file.size() > kBeforePng_bytes) file.remove_prefix(kBeforePng_bytes);
  return decode_depth(file);
}

std::string encoding_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  in.header();
  return fbvins::quoted(raw_image(in).encoding);
}

std::optional<std::uint16_t> largest_value_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  in.header();
  const RawImage raw = raw_image(in);
  return in.ok() ? largest_value(raw) : std::nullopt;
}

Result<BagCamera> camera_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  in.header();
  const std::string frame(in.frame());
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string model(in.text());
  const std::vector<double> d = doubles(in, in.get<std::uint32_t>()), k = doubles(in, 9);
  if (!in.ok() || !(k[0] > 0 && k[4] > 0) || width < 1 || height < 1 || width > kLargestImageSide_px ||
      height > kLargestImageSide_px)
    return Error{ErrorCode::malformed, "this is no camera's calibration"};
  const bool plumb_bob = model == "plumb_bob" || model.empty() || model == "Brown Conrady" || is_straight(model, d),
             equidistant = model == "equidistant" || model == "fisheye" || model == "Kannala Brandt4";
  std::vector<double> c = d;
  if ((plumb_bob || equidistant) && fits_four(d)) c.resize(4, 0.0);
  // Other names are those of our own bags.
  const std::string name = plumb_bob ? "pinhole-radtan" : equidistant ? "pinhole-equidistant" : model;
  if (const auto lens = lens_of(name, {k[0], k[4], k[2], k[5]}, c))
    return BagCamera{Camera(*lens, static_cast<int>(width), static_cast<int>(height)), frame};
  return Error{ErrorCode::unsupported,
               fmt::format("a camera of the model '{}' with {} coefficients, where plumb_bob and equidistant with four are known",
                           fbvins::quoted(model), d.size())};
}

std::optional<BagTransform> transform_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  return read_transform(in);
}

std::vector<BagTransform> transforms_of(std::string_view bytes, Encoding encoding) {
  MessageFields in(bytes, encoding);
  std::vector<BagTransform> out;
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    in.header();
    const std::string parent(in.frame()), child(in.text());
    if (auto transform = read_transform(in)) out.push_back({parent, child, transform->q, transform->p});
  }
  return out;
}

std::optional<TrajectoryPoint> pose_of(std::string_view bytes, Encoding encoding, std::string_view type) {
  MessageFields in(bytes, encoding);
  TrajectoryPoint point{in.header(), {}, std::nullopt, std::nullopt};
  if (type.ends_with("TransformStamped") || type.ends_with("Odometry")) in.text();  // the child's frame
  point.T_WB.p = in.vector();
  const Quat q = in.quaternion();
  if (!in.ok() || !point.T_WB.p.allFinite() || !(std::abs(q.norm() - 1) < 1e-3)) return std::nullopt;
  point.T_WB.q = q.normalized();
  return point;
}

}  // namespace fbvins

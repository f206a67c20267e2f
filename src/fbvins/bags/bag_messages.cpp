// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/bags/depth_image.hpp"
#include "fbvins/bags/grey_image.hpp"
#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/camera/opencv_lens.hpp"
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

/// What stands behind K in a CameraInfo; harmless where the message ends before.
struct InfoTail {
  std::vector<double> R, P;
  std::uint32_t binning_x = 1, binning_y = 1;
  std::uint32_t x = 0, y = 0, height = 0, width = 0;  ///< region of interest, of the whole sensor's pixels; size 0: all
};

InfoTail read_tail(MessageFields& in) {
  InfoTail out{doubles(in, 9), doubles(in, 12)};
  if (!in.ok()) return {};
  for (std::uint32_t* field : {&out.binning_x, &out.binning_y, &out.x, &out.y, &out.height, &out.width})
    *field = in.get<std::uint32_t>();
  if (!in.ok()) out.binning_x = out.binning_y = 1, out.x = out.y = out.width = out.height = 0;
  out.binning_x = std::max(out.binning_x, 1u), out.binning_y = std::max(out.binning_y, 1u);
  return out;
}

/// The lens of the whole sensor for images that are cut out of it, then binned.
Camera cut_and_binned(const Camera& camera, const InfoTail& tail) {
  const bool part = tail.width > 0 && tail.height > 0;
  const std::uint32_t width = (part ? tail.width : camera.width()) / tail.binning_x,
                      height = (part ? tail.height : camera.height()) / tail.binning_y;
  if (tail.binning_x == 1 && tail.binning_y == 1 && !part) return camera;
  const bool inside = width > 0 && height > 0 && width <= kLargestImageSide_px && height <= kLargestImageSide_px &&
                      tail.x < static_cast<std::uint32_t>(camera.width()) && tail.y < static_cast<std::uint32_t>(camera.height());
  if (!inside) return camera;
  LensModel lens = camera.model();
  std::visit(
      [&](auto& m) {
        m.fx /= tail.binning_x, m.fy /= tail.binning_y;
        m.cx = (m.cx - tail.x + 0.5) / tail.binning_x - 0.5, m.cy = (m.cy - tail.y + 0.5) / tail.binning_y - 0.5;
      },
      lens);
  return {lens, static_cast<int>(width), static_cast<int>(height)};
}

std::optional<BagCamera::Rectified> rectified(const Camera& raw, const InfoTail& tail) {
  if (tail.P.size() != 12 || !(tail.P[0] > 0 && tail.P[5] > 0)) return std::nullopt;
  BagCamera::Rectified out{Camera(PinholeRadtan{tail.P[0], tail.P[5], tail.P[2], tail.P[6]}, raw.width(), raw.height())};
  out.R_rectified_raw << tail.R[0], tail.R[1], tail.R[2], tail.R[3], tail.R[4], tail.R[5], tail.R[6], tail.R[7], tail.R[8];
  if (!((out.R_rectified_raw.transpose() * out.R_rectified_raw - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-3) ||
      !std::isfinite(tail.P[0]) || !std::isfinite(tail.P[5]) || !std::isfinite(tail.P[2]) || !std::isfinite(tail.P[6]))
    return std::nullopt;
  out.x_m = -tail.P[3] / tail.P[0];
  if (!std::isfinite(out.x_m)) return std::nullopt;
  const std::vector<double> k = raw.distortion();
  const bool same = raw.intrinsics() == out.camera.intrinsics() && raw.model_name() == "pinhole-radtan" &&
                    std::ranges::all_of(k, [](double x) { return x == 0; }) && out.R_rectified_raw == Mat3::Identity() &&
                    out.x_m == 0;
  if (same) return std::nullopt;
  out.camera = cut_and_binned(out.camera, tail);
  return out;
}

BagCamera as_recorded(BagCamera whole, const InfoTail& tail) {
  whole.rectified = rectified(whole.camera, tail);
  whole.camera = cut_and_binned(whole.camera, tail);
  return whole;
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
    return decode_image(file, used_bits);
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

std::optional<std::uint16_t> largest_value_of(std::string_view bytes, Encoding encoding, bool compressed) {
  MessageFields in(bytes, encoding);
  in.header();
  if (compressed) {
    in.text();
    const std::string_view file = in.bytes();
    return in.ok() ? largest_value_of_png(file) : std::nullopt;
  }
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
  const bool read = in.ok();
  const InfoTail tail = read_tail(in);
  if (!read || !(k[0] > 0 && k[4] > 0) || width < 1 || height < 1 || width > kLargestImageSide_px ||
      height > kLargestImageSide_px)
    return Error{ErrorCode::malformed, "this is no camera's calibration"};
  const std::array<double, 4> f{k[0], k[4], k[2], k[5]};
  const auto w = static_cast<int>(width), h = static_cast<int>(height);
  // Other names are those of our own bags.
  if (const auto lens = lens_of(model, f, d)) return as_recorded({Camera(*lens, w, h), frame}, tail);
  const DistortionKind kind = model.empty() ? DistortionKind::brown : distortion_kind(model);
  const bool straight = is_straight(model, d) || kind == DistortionKind::none;
  if (!straight && kind == DistortionKind::unknown)
    return Error{
        ErrorCode::unsupported,
        fmt::format("a camera of the model '{}' with {} coefficients, where plumb_bob, rational_polynomial and equidistant "
                    "are known",
                    fbvins::quoted(model), d.size())};
  const Result<Camera> camera = straight                              ? opencv_camera(f, {}, w, h)
                                : kind == DistortionKind::equidistant ? fisheye_camera(f, d, w, h)
                                                                      : opencv_camera(f, d, w, h);
  if (camera) return as_recorded({*camera, frame}, tail);
  return Error{camera.error().code,
               fmt::format("a camera of the model '{}': its distortion {}", fbvins::quoted(model), camera.error().message)};
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

// SPDX-License-Identifier: Apache-2.0
// Private to bags: the messages of ROS 1 and ROS 2 that a recording is made of. Pure functions, any thread; nullopt for bytes
// that are no such message.
//
//   std::optional<ImuSample> sample = imu_of(bytes, Encoding::ros1);
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/message_fields.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

std::optional<ImuSample> imu_of(std::string_view bytes, Encoding encoding);

/// sensor_msgs/Image or, with `compressed`, sensor_msgs/CompressedImage: only its stamp; the rest is not read.
std::optional<Time> stamp_of(std::string_view bytes, Encoding encoding);
/// The image in 8-bit grey, or a sentence why not: the encodings of grey_image.hpp; PNG and JPEG. `used_bits` is RawImage's.
Result<Image> image_of(std::string_view bytes, Encoding encoding, bool compressed, int used_bits = 16);
/// A depth image: of 16 bits in millimetres, or of floats in metres; PNG, plain or as image_transport's compressedDepth has it.
Result<DepthImage> depth_of(std::string_view bytes, Encoding encoding, bool compressed);
/// As an uncompressed image names it, printable.
std::string encoding_of(std::string_view bytes, Encoding encoding);
/// The largest value of an image of 16-bit values, of a compressed one of a PNG; none for any other.
std::optional<std::uint16_t> largest_value_of(std::string_view bytes, Encoding encoding, bool compressed);

/// sensor_msgs/CameraInfo, and the frame it names. The camera is that of the images as they are recorded: binned, and cut out by
/// the region of interest.
struct BagCamera {
  Camera camera;
  std::string frame;
  /// By R and P, what image_proc makes of its images: a camera without distortion, turned. None where it would be the same
  /// camera, or the message has no P.
  struct Rectified {
    Camera camera;
    Mat3 R_rectified_raw = Mat3::Identity();
    double x_m = 0;  ///< of its centre in the rectified frame of the first camera of the pair
  };
  std::optional<Rectified> rectified = {};
};
/// An error for a model that is not known.
Result<BagCamera> camera_of(std::string_view bytes, Encoding encoding);

/// Takes coordinates in `child` to `parent`.
struct BagTransform {
  std::string parent, child;
  Quat q = Quat::Identity();
  Vec3 p = Vec3::Zero();
};
std::vector<BagTransform> transforms_of(std::string_view bytes, Encoding encoding);
/// A geometry_msgs/Transform, which names no frames.
std::optional<BagTransform> transform_of(std::string_view bytes, Encoding encoding);

/// PoseStamped, TransformStamped, Odometry or PoseWithCovarianceStamped, by the type's name.
std::optional<TrajectoryPoint> pose_of(std::string_view bytes, Encoding encoding, std::string_view type);

}  // namespace fbvins

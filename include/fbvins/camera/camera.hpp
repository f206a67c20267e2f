// SPDX-License-Identifier: Apache-2.0
// Projection models. Points are in the camera's frame (z forward, x right, y down), pixels in the
// raw image with the centre of the top-left pixel at (0, 0).
//
//   Camera cam = PinholeRadtan{...};
//   std::optional<Vec2> px = cam.project(p_C);
//   std::optional<Vec2> xy = cam.undistort(*px);   // x/z, y/z of the ray
//
// Values: const members may be called from any thread.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/camera/lens.hpp"
#include "fbvins/camera/lens_models.hpp"
#include "fbvins/camera/mask.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/by_camera.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// When a camera takes its images, s.
struct CameraTimes {
  /// t_imu = t_image + time_offset_s (Kalibr's timeshift_cam_imu).
  double time_offset_s = 0;
  /// Rolling shutter: from one row of an image to the next; 0 for a global shutter. The stamp is the middle row's: row v is taken
  /// at t_image + (v - height / 2) * line_delay_s.
  double line_delay_s = 0;
  bool operator==(const CameraTimes&) const = default;
};

class Camera {
 public:
  Camera() = default;
  Camera(LensModel model, int width, int height);
  /// Behind a lens of a model of one's own.
  Camera(std::shared_ptr<const Lens> lens, int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Of a lens of one's own the pinhole with its focal lengths and centre.
  const LensModel& model() const { return model_; }
  /// pinhole-radtan, pinhole-equidistant, ds, eucm, omni-radtan, pinhole-radtan5 or pinhole-rational; of a custom lens its
  /// name.
  std::string model_name() const;
  /// fx, fy, cx, cy, px.
  std::array<double, 4> intrinsics() const;
  /// The model's other parameters, in the order of its struct.
  std::vector<double> distortion() const;
  /// Pixels a radian at the axis, mean of both directions: of ds and omni-radtan fx / (1 + xi), else fx.
  double focal_px() const;

  /// What of the image shows something else than the world, of the camera's size (check_rig); null where all of it does.
  const std::shared_ptr<const Mask>& mask() const { return mask_; }
  void set_mask(std::shared_ptr<const Mask> mask) { mask_ = std::move(mask); }
  /// What it has more than its rig says of all cameras (StereoRig::times). A rig's camera 0 has nothing more.
  const CameraTimes& own_times() const { return own_times_; }
  void set_own_times(const CameraTimes& more) { own_times_ = more; }
  /// The same camera behind another lens.
  Camera with_lens(LensModel model) const;
  /// The same camera in axes that are turned inside its lens: its frame F with p_lens = R_lens * p_F, in which all that follows
  /// is meant. Such a camera sees its own half space, what is behind the lens' plane included (virtual_pinholes.hpp).
  Camera turned(const Mat3& R_lens) const;

  /// Pixel of normalised coordinates (x/z, y/z); not finite where a turned camera's lens has none.
  /// J_pixel_normalised, if given, receives d(pixel)/d(normalised).
  Vec2 distort(const Vec2& normalised, Mat2* J_pixel_normalised = nullptr) const;
  /// Normalised coordinates of a pixel, in closed form (ds, eucm) or by Newton's method on distort(); nullopt where the
  /// model cannot be inverted (beyond the monotonic part of the distortion, or a ray that looks backwards).
  std::optional<Vec2> undistort(const Vec2& pixel) const;
  /// Pixel of a point in the camera's frame; nullopt behind the camera or outside the model's domain.
  /// Does not check the image's borders.
  std::optional<Vec2> project(const Vec3& p_C) const;
  /// Direction of a pixel, of length 1, behind the camera's plane too; nullopt where the lens has none.
  std::optional<Vec3> ray(const Vec2& pixel) const;
  /// Pixel of a point in any direction; nullopt outside the model's domain. Does not check the image's borders.
  std::optional<Vec2> pixel_of(const Vec3& p_C) const;
  /// Largest |(x/z, y/z)| at which the radial distortion still grows outwards: the model's domain.
  double max_normalised_radius() const { return max_radius_; }
  /// Whether the lens sees more than 180 degrees across or down the image: the middles of two opposite edges look backwards.
  /// False for a polynomial that stops growing within the image, which has no rays there, either, and for a lens of one's own, of
  /// which what looks backwards is not used.
  bool sees_backwards() const;
  /// Whether the pixel is in the image, at least so far from its edges and from what the mask hides. A negative border extends
  /// the image, and the mask does not count then.
  bool inside(const Vec2& pixel, double border_px = 0) const {
    return pixel.x() >= border_px && pixel.y() >= border_px && pixel.x() <= width_ - 1 - border_px &&
           pixel.y() <= height_ - 1 - border_px && !hidden(pixel, border_px);
  }
  /// Whether the mask hides something at most so far away; without a mask it hides nothing.
  bool hidden(const Vec2& pixel, double margin_px) const { return mask() != nullptr && mask()->hides(pixel, margin_px); }

 private:
  bool in_domain(const Vec3& p_lens) const;
  /// Not by the closed forms of a model in its own axes, but by rays.
  bool by_rays() const { return is_turned_ || lens_ != nullptr; }
  std::optional<Vec2> project_in_lens(const Vec3& p_lens, Eigen::Matrix<double, 2, 3>* J_pixel_point = nullptr) const;
  std::optional<Vec3> ray_in_lens(const Vec2& pixel) const;

  LensModel model_;
  std::shared_ptr<const Lens> lens_;  ///< null: model_ is all of it
  int width_ = 0;
  int height_ = 0;
  double max_radius_ = 0, max_plane_radius_ = 0, widest_rad_ = 0;
  Mat3 R_lens_ = Mat3::Identity();
  bool is_turned_ = false;
  std::shared_ptr<const Mask> mask_;
  CameraTimes own_times_;
};

/// A camera and its place in the body.
struct MountedCamera {
  Camera camera;
  Pose<B, C0> T_BC;  ///< C0 is this camera's own frame
};

/// A sensor of depth images, which are registered to the left camera, pixel by pixel, or have a lens and a pose of their own. Its
/// noise grows with the square of the distance, as that of every sensor that triangulates: a constant noise of the inverse depth.
struct DepthSensor {
  double noise_at_1m_m = 0.003;  ///< standard deviation at a distance of one metre
  double nearest_m = 0.2, farthest_m = 8;
  double scale_sigma = 0.005;             ///< relative standard deviation of what all its distances are wrong by together
  std::optional<MountedCamera> own = {};  ///< in whose pixels and along whose z it measures; without it the left camera's
};

/// Cameras and an IMU, rigidly joined. The cameras are numbered from 0 on; the first two are called left and right. Which of them
/// see the same things follows from geometry (camera_groups).
struct StereoRig {
  std::vector<MountedCamera> cameras;  ///< empty: the rig is not set
  std::optional<DepthSensor> depth;    ///< beside one camera
  ImuNoise imu_noise;
  double image_rate_hz = 20;
  /// Those of camera 0, and of all others that have none of their own (CameraTimes, times()).
  double time_offset_s = 0, line_delay_s = 0;

  int camera_count() const { return static_cast<int>(cameras.size()); }
  bool has_right() const { return cameras.size() > 1; }
  /// One that the rig does not have has no pixels.
  const MountedCamera& mounted(int i) const { return of_camera(cameras, i); }
  const Camera& camera(int i) const { return mounted(i).camera; }
  const Pose<B, C0>& T_BC(int i) const { return mounted(i).T_BC; }
  CameraTimes times(int i) const {
    const CameraTimes& own = camera(i).own_times();
    return {time_offset_s + own.time_offset_s, line_delay_s + own.line_delay_s};
  }
  /// Whose pixels those of the depth images are.
  const Camera& depth_camera() const { return depth && depth->own ? depth->own->camera : left(); }

  const Camera& left() const { return camera(0); }
  const Camera& right() const { return camera(1); }
  const Pose<B, C0>& T_BC0() const { return T_BC(0); }
  /// That of the left camera where there is no right one.
  Pose<B, C1> T_BC1() const { return T_BC(has_right() ? 1 : 0).cast_frames<B, C1>(); }
  Pose<C1, C0> T_C1C0() const { return T_BC1().inverse() * T_BC0(); }
};

/// The rig with these cameras, one at least, in place of its own. A depth sensor stays where there is one camera. What the first
/// one's times are more than the rig's becomes the rig's.
inline StereoRig with_cameras(StereoRig rig, std::vector<MountedCamera> cameras) {
  if (const CameraTimes first = cameras.front().camera.own_times(); first != CameraTimes{}) {
    rig.time_offset_s += first.time_offset_s, rig.line_delay_s += first.line_delay_s;
    for (MountedCamera& mounted : cameras) {
      const CameraTimes& own = mounted.camera.own_times();
      mounted.camera.set_own_times({own.time_offset_s - first.time_offset_s, own.line_delay_s - first.line_delay_s});
    }
  }
  rig.cameras = std::move(cameras);
  if (rig.has_right()) rig.depth.reset();
  return rig;
}

/// The rig with its left camera and a depth sensor.
inline StereoRig with_depth(StereoRig rig, const DepthSensor& sensor) {
  rig.depth = sensor;
  return with_cameras(rig, {rig.mounted(0)});
}

/// The rig with its left camera alone, or its right one, which is the left one then.
inline StereoRig with_one_camera(const StereoRig& rig, bool right_one = false) {
  return with_cameras(rig, {rig.mounted(right_one ? 1 : 0)});
}

}  // namespace fbvins

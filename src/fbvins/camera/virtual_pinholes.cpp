// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/virtual_pinholes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace fbvins {
namespace {

/// The faces around the one that looks ahead: the first looks down the image, the others up and to its sides.
constexpr int kAround = 3;
constexpr int kFaces = 1 + kAround;
/// A face with a smaller share of the image is left out: the image's edges cut it off.
constexpr double kLeastShare = 0.02;

constexpr std::int8_t kNone = -1;

/// Which face each pixel belongs to.
struct Division {
  std::vector<std::int8_t> face;  // row by row; kNone where the lens has no ray, or its mask hides it
  std::array<Vec3, kFaces> axis;  // sum of the rays of each
  std::array<std::size_t, kFaces> pixels{};
};

int face_of(const Vec3& ray) {
  if (std::acos(ray.z()) <= kFrontFace_rad) return 0;
  const double turn = std::atan2(-ray.x(), ray.y()) / (2 * std::numbers::pi);  // from down the image on, in turns
  return 1 + (static_cast<int>(std::lround(turn * kAround)) + kAround) % kAround;
}

Division divide(const Camera& camera) {
  Division out;
  out.axis.fill(Vec3::Zero());
  out.face.reserve(static_cast<std::size_t>(camera.width()) * camera.height());
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      const auto ray = camera.hidden(Vec2(x, y), 0) ? std::nullopt : camera.ray(Vec2(x, y));
      if (!ray) {
        out.face.push_back(kNone);
        continue;
      }
      const auto face = static_cast<std::size_t>(face_of(*ray));
      out.face.push_back(static_cast<std::int8_t>(face));
      out.axis[face] += *ray;
      ++out.pixels[face];
    }
  return out;
}

/// Turns the z axis to where the face looks. The lens' own axes ahead.
Mat3 axes_of(int face, const Vec3& axis) {
  if (face == 0) return Mat3::Identity();
  Mat3 R;
  R.col(2) = axis.normalized();
  R.col(0) = Vec3::UnitZ().cross(axis).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

/// What the face shows: its pixels, and of the others as many around them as features keep from a mask's edge.
std::shared_ptr<const Mask> mask_of(const Camera& camera, const Division& division, int face) {
  Image others(camera.width(), camera.height(), 255), seen(camera.width(), camera.height(), 0);
  const auto at = [&](int x, int y) { return division.face[static_cast<std::size_t>(y) * camera.width() + x]; };
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      if (at(x, y) == face) others.at(x, y) = 0;
  const Mask widened(others);
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      if (at(x, y) != kNone && widened.hides(Vec2(x, y), kMaskMargin_px)) seen.at(x, y) = 255;
  return std::make_shared<const Mask>(seen);
}

/// Columns x to x + width - 1 and rows y to y + height - 1 of an image.
struct Part {
  int x, y, width, height;
};

/// The smallest part with all that the mask leaves; with all rows where rows have times of their own.
Part part_of(const Camera& face, bool may_leave_rows) {
  int x0 = face.width(), x1 = 0, y0 = face.height(), y1 = 0;
  for (int y = 0; y < face.height(); ++y)
    for (int x = 0; x < face.width(); ++x) {
      if (face.hidden(Vec2(x, y), 0)) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
    }
  if (!may_leave_rows) y0 = 0, y1 = face.height();
  return {x0, y0, x1 - x0, y1 - y0};
}

/// A face with this part of its image alone. `R_lens`: its axes in the lens', null for the lens' own.
Camera cropped(const Camera& face, const Part& part, const Mat3* R_lens) {
  LensModel model = face.model();
  std::visit([&](auto& m) { m.cx -= part.x, m.cy -= part.y; }, model);
  Camera out(model, part.width, part.height);
  if (R_lens != nullptr) out = out.turned(*R_lens);
  Image seen(part.width, part.height, 0);
  for (int y = 0; y < part.height; ++y)
    for (int x = 0; x < part.width; ++x)
      if (!face.hidden(Vec2(x + part.x, y + part.y), 0)) seen.at(x, y) = 255;
  out.set_mask(std::make_shared<const Mask>(seen));
  out.set_own_times(face.own_times());
  return out;
}

}  // namespace

std::vector<MountedCamera> faces_of(const MountedCamera& mounted) {
  const Camera& camera = mounted.camera;
  if (!camera.sees_backwards()) return {mounted};
  const Division division = divide(camera);
  std::vector<MountedCamera> faces;
  for (int face = 0; face < kFaces; ++face) {
    const auto k = static_cast<std::size_t>(face);
    if (face > 0 && static_cast<double>(division.pixels[k]) < kLeastShare * static_cast<double>(division.face.size())) continue;
    const Mat3 R = axes_of(face, division.axis[k]);
    MountedCamera out{face == 0 ? camera : camera.turned(R), mounted.T_BC * Pose<C0, C0>(R, Vec3::Zero())};
    if (face == 0) out.T_BC = mounted.T_BC;
    out.camera.set_mask(mask_of(camera, division, face));
    faces.push_back(std::move(out));
  }
  return faces;
}

VirtualPinholes::VirtualPinholes(const StereoRig& rig) : lenses_(rig), rig_(rig) {
  std::vector<MountedCamera> ahead, around;
  std::vector<int> lens_of_around;
  for (int i = 0; i < rig.camera_count(); ++i) {
    const std::vector<MountedCamera> faces = faces_of(rig.mounted(i));
    any_ = any_ || rig.camera(i).sees_backwards();
    ahead.push_back(faces.front());
    lens_of_.push_back(i);
    around.insert(around.end(), faces.begin() + 1, faces.end());
    lens_of_around.resize(around.size(), i);
  }
  ahead.insert(ahead.end(), around.begin(), around.end());
  lens_of_.insert(lens_of_.end(), lens_of_around.begin(), lens_of_around.end());
  origins_px_.assign(ahead.size(), Vec2::Zero());
  if (!any_) return;
  for (std::size_t i = 0; i < ahead.size(); ++i) {
    if (!rig.camera(lens_of_[i]).sees_backwards()) continue;
    const Part part = part_of(ahead[i].camera, rig.times(lens_of_[i]).line_delay_s == 0);
    origins_px_[i] = Vec2(part.x, part.y);
    const Mat3 R_lens = (rig.T_BC(lens_of_[i]).q.conjugate() * ahead[i].T_BC.q).toRotationMatrix();
    const bool is_ahead = static_cast<int>(i) < rig.camera_count();
    ahead[i].camera = cropped(ahead[i].camera, part, is_ahead ? nullptr : &R_lens);
  }
  rig_ = with_cameras(rig, ahead);
}

std::shared_ptr<const Image> VirtualPinholes::part(const std::shared_ptr<const Image>& image, int camera) const {
  const Camera &whole = lenses_.camera(lens_of(camera)), &face = rig_.camera(camera);
  const bool is_whole = face.width() == whole.width() && face.height() == whole.height();
  if (is_whole || !image || image->width() != whole.width() || image->height() != whole.height()) return image;
  const auto x = static_cast<int>(origin_px(camera).x()), y = static_cast<int>(origin_px(camera).y());
  auto out = std::make_shared<Image>(face.width(), face.height());
  for (int row = 0; row < face.height(); ++row) std::copy_n(image->row(y + row) + x, face.width(), out->row(row));
  return out;
}

StereoFrame VirtualPinholes::spread(StereoFrame frame) const {
  if (!any()) return frame;
  StereoFrame out{frame.t};
  out.after_clock_step = frame.after_clock_step;
  for (int i = 0; i < rig_.camera_count(); ++i) {
    out.images.push_back(part(frame.image(lens_of(i)), i));
    out.offsets.set(i, frame.offsets.of(lens_of(i)));
  }
  return out;
}

TrackedFrame VirtualPinholes::gathered(TrackedFrame frame) const {
  for (TrackedFeature& feature : frame.features) {
    feature.lead = lens_of(feature.lead);
    const auto seen = std::exchange(feature.seen, {});
    for (Observation o : seen) {
      o.pixel += origin_px(o.camera);
      if (feature.by(lens_of(o.camera)) == nullptr)
        feature.see(lens_of(o.camera), o);  // where two faces of a lens meet, the first
    }
  }
  frame.cameras.resize(std::min(frame.cameras.size(), lenses_.cameras.size()));
  return frame;
}

Calibration VirtualPinholes::of_lenses(Calibration calibration) const {
  if (!any()) return calibration;
  calibration.cameras.resize(std::max<std::size_t>(2, lenses_.cameras.size()));
  if (!lenses_.has_right()) calibration.cameras[1] = lenses_.T_BC0();
  return calibration;
}

std::uint8_t VirtualPinholes::lenses_of(std::uint8_t cameras) const {
  if (!any()) return cameras;
  unsigned out = 0;
  for (int i = 0; i < rig_.camera_count(); ++i)
    if ((cameras >> i & 1U) != 0) out |= 1U << lens_of(i);
  return static_cast<std::uint8_t>(out);
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/surface_view.hpp"

#include <cmath>

#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace {

/// Places are this far apart in the image, more than the window of any depth sensor: their errors are independent.
constexpr int kStep_px = 20;
/// Fewer places do not say how the frame lies.
constexpr std::size_t kFewest = 30;
/// A place farther from the reference's surface than the larger of these is hidden there by something nearer.
constexpr double kFarthest_m = 0.1, kFarthest_sigma = 5;
/// What a depth sensor's surfaces are bent by, whatever its noise.
constexpr double kBent_m = 0.005;
/// With fewer landmarks surfaces are compared as well.
constexpr std::ptrdiff_t kEnoughLandmarks = 25;
/// Surfaces seen at a smaller angle have no reliable normal.
constexpr double kLeastCosine = 0.2;

}  // namespace

SurfaceFinder::SurfaceFinder(const StereoRig& rig) : camera_(rig.left()) {
  if (rig.depth) reader_.emplace(rig);
}

std::vector<SurfaceFinder::Place> SurfaceFinder::places(const DepthImage& depth, const Pose<B, C0>& T_BC) const {
  std::vector<Place> out;
  for (int y = kStep_px / 2; y < camera_.height(); y += kStep_px)
    for (int x = kStep_px / 2; x < camera_.width(); x += kStep_px) {
      if (camera_.hidden(Vec2(x, y), 0)) continue;
      const auto measured = reader_->at(depth, Vec2(x, y));
      const auto ray = measured ? camera_.undistort(Vec2(x, y)) : std::nullopt;
      if (!ray) continue;
      const double depth_m = 1 / measured->value;
      out.push_back({T_BC * Vec3(depth_m * ray->homogeneous()), measured->sigma * depth_m * depth_m});
    }
  return out;
}

/// (D1)-(D3): where the reference shows the place, its surface is the plane that its depths lie on.
std::vector<SurfaceDistance> SurfaceFinder::distances(const std::vector<Place>& places, const Frame& newest,
                                                      const Frame& reference, const Pose<B, C0>& T_BC) const {
  std::vector<SurfaceDistance> out;
  const Pose<C0, B> T_CN = T_BC.inverse() * (reference.state.T_FB.inverse() * newest.state.T_FB);
  for (const Place& place : places) {
    const Vec3 p_C = T_CN * place.p_B;
    const auto px = camera_.project(p_C);
    const auto surface = px && !camera_.hidden(*px, 0) ? reader_->at(*reference.depth, *px) : std::nullopt;
    if (!surface) continue;
    const Vec2 m = p_C.head<2>() / p_C.z();
    Mat2 J_pixel_normalised;
    camera_.distort(m, &J_pixel_normalised);
    const Vec2 slope = J_pixel_normalised.transpose() * surface->slope_1pm_px;
    const Vec3 plane(slope.x(), slope.y(), surface->value - slope.dot(m));  // plane . X = 1
    const Vec3 normal_C = plane.normalized();
    const double depth_m = 1 / surface->value, cosine = std::abs(normal_C.dot(m.homogeneous().normalized()));
    const double sigma_m = std::hypot(cosine * place.sigma_m, cosine * surface->sigma * depth_m * depth_m, kBent_m);
    const double away_m = normal_C.dot(p_C) - 1 / plane.norm();
    if (cosine < kLeastCosine || std::abs(away_m) > std::max(kFarthest_m, kFarthest_sigma * sigma_m)) continue;
    out.push_back({place.p_B, T_BC.q * normal_C, T_BC * Vec3(depth_m * m.homogeneous()), 1 / sigma_m});
  }
  return out;
}

std::shared_ptr<const SurfaceFactor> SurfaceFinder::find(const Frame& newest, const FrameList& window,
                                                         const Calibration& calibration) const {
  if (!reader_ || !reader_->is_usable(newest.depth.get())) return nullptr;
  const std::vector<Place> seen = places(*newest.depth, calibration.T_BC0());
  std::vector<SurfaceDistance> best;
  FrameId reference;
  for (const Frame& frame : window) {
    if (!frame.keyframe || !reader_->is_usable(frame.depth.get())) continue;
    std::vector<SurfaceDistance> found = distances(seen, newest, frame, calibration.T_BC0());
    if (found.size() > best.size()) best = std::move(found), reference = frame.id;
    if (2 * best.size() > seen.size()) break;
  }
  if (best.size() < kFewest) return nullptr;
  return std::make_shared<const SurfaceFactor>(newest.id, reference, std::move(best));
}

std::vector<std::shared_ptr<const Factor>> SurfaceMaker::make(const NewFrame& f) {
  if (f.of_start || std::ssize(landmark_observations(f.window, f.features, f.calibration)) >= kEnoughLandmarks) return {};
  std::shared_ptr<const SurfaceFactor> found = finder_.find(f.frame, f.window.frames(), f.calibration);
  if (found == nullptr) return {};
  return {std::move(found)};
}

}  // namespace fbvins

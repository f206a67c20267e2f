// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_points.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "fbvins/camera/lens_projection.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Views of a point at least, in keyframes at least; points of a keyframe that are enough.
constexpr std::size_t kFewestViews = 4;
constexpr int kFewestSeeing = 3, kEnough = 60;
constexpr double kNearest_m = 0.15;
/// Root mean square distance from which the views are not of one point, even with a calibration that is somewhat wrong.
constexpr double kWrong_px = 8;

Pose<Cn, W> pose_of(const FlightRig& rig, int camera, const NavState<W>& state) {
  return rig.T_CnC0[static_cast<std::size_t>(camera)] * (state.T_FB * rig.T_BC0).inverse();
}

/// Nearest to all rays; nullopt where they do not meet.
std::optional<Vec3> triangulated(const SeenPoint& point, const std::vector<FlightKeyframe>& keyframes, const FlightRig& rig) {
  Mat3 H = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (const SeenPoint::View& view : point.views) {
    const auto ray = rig.cameras[static_cast<std::size_t>(view.camera)].ray(view.pixel);
    if (!ray) return std::nullopt;
    const Pose<W, Cn> T_WC = pose_of(rig, view.camera, keyframes[static_cast<std::size_t>(view.keyframe)].state).inverse();
    const Vec3 d = T_WC.q * *ray;
    const Mat3 across = Mat3::Identity() - d * d.transpose();
    H += across, b += across * T_WC.p;
  }
  H.diagonal().array() += 1e-9;
  const Vec3 p_W = Ldlt<3>(H).solve(b);
  double sum = 0;
  for (const SeenPoint::View& view : point.views) {
    const Vec3 p_C = pose_of(rig, view.camera, keyframes[static_cast<std::size_t>(view.keyframe)].state) * p_W;
    const auto ray = rig.cameras[static_cast<std::size_t>(view.camera)].ray(view.pixel);
    const auto pixel = project_point(rig.cameras[static_cast<std::size_t>(view.camera)].model(), p_C);
    if (!pixel || p_C.dot(*ray) < kNearest_m) return std::nullopt;
    sum += (*pixel - view.pixel).squaredNorm();
  }
  if (sum > kWrong_px * kWrong_px * static_cast<double>(point.views.size())) return std::nullopt;
  return p_W;
}

int keyframes_of(const SeenPoint& point) {
  int count = 0, before = -1;
  for (const SeenPoint::View& view : point.views) count += view.keyframe != before, before = view.keyframe;
  return count;
}

}  // namespace

std::vector<SeenPoint> seen_points(const std::vector<FlightKeyframe>& keyframes, const FlightRig& rig) {
  std::map<TrackId, SeenPoint> tracks;
  for (std::size_t i = 0; i < keyframes.size(); ++i)
    for (const FlightView& view : keyframes[i].views)
      tracks[view.track].views.push_back({static_cast<int>(i), view.camera, view.pixel});
  std::vector<SeenPoint> points;
  for (auto& [id, point] : tracks)
    if (point.views.size() >= kFewestViews && keyframes_of(point) >= kFewestSeeing) points.push_back(std::move(point));
  std::stable_sort(points.begin(), points.end(),
                   [](const SeenPoint& a, const SeenPoint& b) { return a.views.size() > b.views.size(); });
  std::vector<int> seen(keyframes.size(), 0);
  std::vector<SeenPoint> chosen;
  for (SeenPoint& point : points) {
    const bool wanted = std::any_of(point.views.begin(), point.views.end(), [&](const SeenPoint::View& view) {
      return seen[static_cast<std::size_t>(view.keyframe)] < kEnough;
    });
    if (!wanted) continue;
    const auto p_W = triangulated(point, keyframes, rig);
    if (!p_W) continue;
    point.p_W = *p_W;
    int before = -1;
    for (const SeenPoint::View& view : point.views) {
      if (view.keyframe != before) ++seen[static_cast<std::size_t>(view.keyframe)];
      before = view.keyframe;
    }
    chosen.push_back(std::move(point));
  }
  return chosen;
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/landmark_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// A landmark is not triangulated while its inverse depth is less certain than this.
constexpr double kMaxInverseDepthSigma_1pm = 0.15;
/// No observation of a triangulated landmark may have a larger residual.
constexpr double kMaxError_sigma = 6.0;
/// Over a longer gap the difference of two observations is no good estimate of the velocity at either.
constexpr double kLongestGap_s = 0.25;

/// p_C = a + rho * b: a ray of the host frame, seen from a camera of another frame (W2, W3).
struct RayInCamera {
  Vec3 a, b;
};

/// `from`: the host's camera that the ray is of. Each camera is displaced from its place at the stamp.
RayInCamera ray_in_camera(const Vec2& ray, int from, const Vec3& displaced_from_B, const PairGeometry& pair,
                          const CameraGeometry& cameras, int camera, const Vec3& displaced_B) {
  const Vec3 direction_B = cameras.R_BC[from] * Vec3(ray.x(), ray.y(), 1);
  const Mat3& R_CB = cameras.R_CB[camera];
  const Vec3 from_B = cameras.t_BC[from] + displaced_from_B, at_B = cameras.t_BC[camera] + displaced_B;
  return {R_CB * (pair.R_th * direction_B), R_CB * (pair.R_th * from_B + pair.t_th - at_B)};
}

/// The landmark in a camera of a frame, times its inverse depth (W2, W3).
Vec3 scaled_point(const Landmark& landmark, const Frame& target, int camera, const FrameList& frames,
                  const Calibration& calibration) {
  const CameraGeometry cameras(calibration);
  PairGeometry pair;
  pair.set(frames.at(landmark.host).state.T_FB, target.state.T_FB);
  const RayInCamera line =
      ray_in_camera(landmark.alpha_beta_rho.head<2>(), landmark.ray_camera, Vec3::Zero(), pair, cameras, camera, Vec3::Zero());
  return line.a + landmark.alpha_beta_rho.z() * line.b;
}

}  // namespace

bool triangulate(Landmark& landmark, const FrameList& frames, const Calibration& calibration) {
  // Linear in rho: (a + rho b) is parallel to (z, 1) for every observation (W4).
  const CameraGeometry cameras(calibration);
  const NavState<G>& host = frames.at(landmark.host).state;
  const Observation& of_host = landmark.observations.front().seen;
  const Vec2 ray = of_host.normalised;
  const int from = of_host.camera;
  const Vec3 displaced_from_B = of_host.displacement_B(host.v_B());
  double numerator = 0, information = 0;
  const auto each = [&](auto&& visit) {
    PairGeometry pair;
    const NavState<G>* target = nullptr;
    for (std::size_t i = 0; i < landmark.observations.size(); ++i) {
      const auto& [frame, o, velocity] = landmark.observations[i];
      if (i == 0 || frame != landmark.observations[i - 1].frame) {
        target = &frames.at(frame).state;
        pair.set(host.T_FB, target->T_FB);
      }
      if (frame == landmark.host && o.camera == from) continue;
      visit(ray_in_camera(ray, from, displaced_from_B, pair, cameras, o.camera, o.displacement_B(target->v_B())), o);
    }
  };
  each([&](const RayInCamera& line, const Observation& o) {
    const Vec2 u = o.sqrt_information * (line.a.head<2>() - line.a.z() * o.normalised);
    const Vec2 w = o.sqrt_information * (line.b.head<2>() - line.b.z() * o.normalised);
    numerator -= u.dot(w);
    information += w.squaredNorm();
  });
  if (information < 1.0 / (kMaxInverseDepthSigma_1pm * kMaxInverseDepthSigma_1pm)) return false;
  const double sigma = 1.0 / std::sqrt(information);
  double rho = numerator / information;
  if (rho < -2 * sigma || rho > 1.0 / kNearestLandmark_m) return false;
  rho = std::max(rho, 1.0 / kFarthestLandmark_m);
  double worst = 0;
  each([&](const RayInCamera& line, const Observation& o) {
    const Vec3 p = line.a + rho * line.b;
    if (p.z() < kMinScaledDepth) worst = 1e9;
    else worst = std::max(worst, (o.sqrt_information * (p.head<2>() / p.z() - o.normalised)).squaredNorm());
  });
  if (worst > kMaxError_sigma * kMaxError_sigma) return false;
  const Vec3 p_C = ray.homogeneous() + rho * (cameras.R_CB[from] * displaced_from_B);  // from the camera's place at the stamp
  if (p_C.z() < kMinScaledDepth) return false;
  landmark.alpha_beta_rho = Vec3(p_C.x(), p_C.y(), rho) / p_C.z();
  landmark.ray_camera = from;
  return true;
}

Vec3 scaled_point_in_camera(const Landmark& landmark, const Frame& target, const FrameList& frames,
                            const Calibration& calibration) {
  return scaled_point(landmark, target, landmark.lead, frames, calibration);
}

void rehost(Landmark& landmark, FrameId new_host, const FrameList& frames, const Calibration& calibration) {
  const std::span<const Sighting> there = landmark.seen_by_cameras(new_host);
  const int camera = there.empty() ? landmark.lead : there.front().seen.camera;
  if (landmark.triangulated) {
    const Vec3 p = scaled_point(landmark, frames.at(new_host), camera, frames, calibration);
    if (p.z() < kMinScaledDepth) landmark.triangulated = false;
    else landmark.alpha_beta_rho = Vec3(p.x(), p.y(), landmark.alpha_beta_rho.z()) / p.z();
  }
  landmark.host = new_host;
  landmark.ray_camera = camera;
}

void set_velocities(std::span<Sighting> before, std::span<Sighting> now, double gap_s) {
  if (gap_s <= 0 || gap_s > kLongestGap_s) return;
  const auto by = [](std::span<Sighting> in, int camera) -> const Sighting* {
    const auto it = std::find_if(in.begin(), in.end(), [&](const Sighting& s) { return s.seen.camera == camera; });
    return it == in.end() ? nullptr : &*it;
  };
  std::optional<Vec2> first;  // of a camera that saw it both times: that of the others
  const auto difference = [&](const Sighting& s) -> std::optional<Vec2> {
    const Sighting* b = by(before, s.seen.camera);
    return b ? std::optional<Vec2>((s.seen.normalised - b->seen.normalised) / gap_s) : first;
  };
  for (const Sighting& s : now)
    if (first = difference(s); first) break;
  if (!first) return;
  for (Sighting& s : now) s.velocity = *difference(s);
  // The observations before have differences on both sides now: their mean is the velocity to second order.
  const double share = before.front().velocity.isZero(0) ? 1.0 : 0.5;
  for (Sighting& s : before) {
    const Sighting* n = by(now, s.seen.camera);
    s.velocity += share * ((n ? n->velocity : *first) - s.velocity);
  }
}

}  // namespace fbvins

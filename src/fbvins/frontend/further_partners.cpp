// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/further_partners.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/frontend/frame_images.hpp"
#include "fbvins/frontend/klt_options.hpp"
#include "fbvins/frontend/observe.hpp"
#include "fbvins/geometry/triangulation.hpp"

namespace fbvins {
namespace {

/// As in klt: most depths are known.
constexpr KltStereoEffort kEffort{.known_depth_level = 0, .sure_correlation = 0.9};
/// The search is on the coarsest.
constexpr int kLevels = 3;

/// That an observation was made with.
double sigma_px(const Camera& camera, const Observation& o) {
  Mat2 J;
  (void)camera.distort(o.normalised, &J);
  return std::sqrt(std::abs(J.determinant() / o.sqrt_information.determinant()));
}

}  // namespace

FurtherPartners::FurtherPartners(const StereoRig& rig, const std::vector<CameraGroup>& groups)
    : rig_(rig), images_(static_cast<std::size_t>(rig.camera_count())) {
  for (const CameraGroup& group : groups)
    for (const int camera : further_partners(rig, group))
      partners_.push_back({group, camera, {rig_of(rig, {group.first, camera}), KltFrontendOptions{}.min_depth_m, kEffort}});
}

void FurtherPartners::match(const StereoFrame& frame, std::vector<TrackedFeature>& features, FrontendStats& stats) {
  CpuTimer timer;
  for (Pyramid& image : images_) image.clear();
  for (Partner& partner : partners_) {
    if (has_images(partner, frame)) match(partner, features, stats);
    else partner.inverse_depths.clear();
  }
  stats.stereo_ms += timer.lap_ms();
}

bool FurtherPartners::has_images(const Partner& partner, const StereoFrame& frame) {
  if (frame.offsets.are_apart(partner.of.first, partner.camera)) return false;
  for (const int camera : {partner.of.first, partner.camera}) {
    Pyramid& pyramid = images_[static_cast<std::size_t>(camera)];
    const Image* image = frame.image(camera).get();
    if (pyramid.empty() && is_usable(image, rig_.camera(camera))) pyramid.build(image->view(), kLevels);
    if (pyramid.empty()) return false;
  }
  return true;
}

void FurtherPartners::match(Partner& partner, std::vector<TrackedFeature>& features, FrontendStats& stats) {
  const int lead = partner.of.first;
  const Pyramid &from = images_[static_cast<std::size_t>(lead)], &to = images_[static_cast<std::size_t>(partner.camera)];
  std::unordered_map<TrackId, double> found;
  for (TrackedFeature& feature : features) {
    const Observation* seen = feature.lead == lead ? feature.by(lead) : nullptr;
    if (seen == nullptr || !patch_.cut(from, seen->pixel, 0, 0)) continue;
    const StereoMatch match =
        partner.matcher.match(patch_, seen->pixel, seen->normalised, inverse_depth(partner, feature), from, to);
    if (match.failure != StereoFailure::none) continue;
    found.emplace(feature.id, match.inverse_depth);
    stats.stereo += !feature.by_several();
    feature.see(partner.camera,
                observe(rig_.camera(partner.camera), match.px, match.normalised, sigma_px(rig_.camera(lead), *seen)));
  }
  std::swap(partner.inverse_depths, found);
}

/// By another camera, or by this one an image ago.
std::optional<double> FurtherPartners::inverse_depth(const Partner& partner, const TrackedFeature& feature) const {
  const Vec3 ray = feature.by(partner.of.first)->normalised.homogeneous();
  for (const Observation& o : feature.seen) {
    if (o.camera == partner.of.first) continue;
    const Pose<C0, C0> T_other_lead = rig_.T_BC(o.camera).inverse() * rig_.T_BC(partner.of.first);
    if (const auto rho = inverse_depth_along(T_other_lead.q * ray, T_other_lead.p, o.normalised.homogeneous()))
      return std::max(*rho, 0.0);
  }
  const auto before = partner.inverse_depths.find(feature.id);
  return before == partner.inverse_depths.end() ? std::nullopt : std::optional(before->second);
}

}  // namespace fbvins

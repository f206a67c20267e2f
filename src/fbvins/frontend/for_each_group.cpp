// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/for_each_group.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/frontend/any_rig.hpp"
#include "fbvins/frontend/either_camera.hpp"
#include "fbvins/frontend/generic_lead.hpp"
#include "fbvins/frontend/rig_frontend.hpp"

namespace fbvins {

std::unique_ptr<Frontend> for_each_group(const StereoRig& rig, int max_features,
                                         const std::function<std::unique_ptr<LeadingFrontend>(const StereoRig&)>& lead) {
  const std::vector<CameraGroup> groups = leading_groups(rig);
  const auto leads = [&](int camera) { return std::ranges::find(groups, camera, &CameraGroup::first) != groups.end(); };
  std::vector<std::unique_ptr<Frontend>> frontends;
  for (const CameraGroup& group : groups) {
    const StereoRig cameras = rig_of(rig, group);
    if (group.second && !leads(*group.second))
      frontends.push_back(std::make_unique<EitherCamera>(cameras, lead(cameras), lead(mirrored(cameras))));
    else frontends.push_back(lead(cameras));
  }
  if (groups.size() == 1) return std::move(frontends.front());
  return std::make_unique<RigFrontend>(groups, std::move(frontends), max_features);
}

std::unique_ptr<Frontend> for_any_rig(const StereoRig& rig, int max_features, FrontendOfPair make) {
  return for_each_group(rig, max_features,
                        [&make](const StereoRig& cameras) { return std::make_unique<GenericLead>(cameras, make); });
}

}  // namespace fbvins

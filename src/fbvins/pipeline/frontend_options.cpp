// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/frontend_options.hpp"

namespace fbvins {
namespace {

/// The orb frontend's options with the distances that suit boosted descriptors.
OrbFrontendOptions boosted(OrbFrontendOptions orb, const BoostFrontendOptions& boost) {
  orb.matching.max_distance = boost.max_distance;
  orb.matching.max_ratio = boost.max_ratio;
  orb.stereo.max_distance = boost.stereo_max_distance;
  orb.stereo.max_ratio = boost.max_ratio;
  return orb;
}

}  // namespace

Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const FrontendOptions& options) {
  using Made = std::unique_ptr<Frontend>;
  if (options.kind == "klt") return Made(std::make_unique<KltFrontend>(rig, options.klt));
  if (options.kind == "orb") return Made(std::make_unique<OrbFrontend>(rig, options.orb));
  if (options.kind != "boost") return Error{ErrorCode::invalid_argument, "there is no frontend \"" + options.kind + "\""};
  Result<std::unique_ptr<DescriptorStage>> stage = make_booster_stage(options.boost.booster);
  if (!stage) return stage.error();
  return Made(std::make_unique<OrbFrontend>(rig, boosted(options.orb, options.boost), std::move(*stage)));
}

}  // namespace fbvins

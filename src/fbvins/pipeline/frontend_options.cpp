// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/frontend_options.hpp"

namespace fbvins {

std::unique_ptr<Frontend> make_frontend(const StereoRig& rig, const FrontendOptions& options) {
  if (options.kind == "orb") return std::make_unique<OrbFrontend>(rig, options.orb);
  return std::make_unique<KltFrontend>(rig, options.klt);
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// The frontends by name.
#pragma once

#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_frontend.hpp"
#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {

struct FrontendOptions {
  std::string kind = "klt";
  KltFrontendOptions klt;
  OrbFrontendOptions orb;

  template <class V>
  void visit(V&& v) {
    v("kind", kind, "klt|orb", "corners followed by Lucas-Kanade, or descriptors matched from image to image");
    v.group("klt", klt, "the klt frontend");
    v.group("orb", orb, "the orb frontend");
  }
};

std::unique_ptr<Frontend> make_frontend(const StereoRig& rig, const FrontendOptions& options);

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// The frontends by name.
#pragma once

#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_frontend.hpp"
#if __has_include("fbvins/frontend/orb_frontend.hpp")
#include "fbvins/frontend/orb_frontend.hpp"
#define FBVINS_HAS_ORB 1
#endif

namespace fbvins {

struct FrontendOptions {
  std::string kind = "klt";
  KltFrontendOptions klt;
#ifdef FBVINS_HAS_ORB
  OrbFrontendOptions orb;
#endif

  template <class V>
  void visit(V&& v) {
    v("kind", kind, "klt|orb", "corners followed by Lucas-Kanade, or descriptors matched from image to image");
    v.group("klt", klt, "the klt frontend");
#ifdef FBVINS_HAS_ORB
    v.group("orb", orb, "the orb frontend");
#endif
  }
};

std::unique_ptr<Frontend> make_frontend(const StereoRig& rig, const FrontendOptions& options);

}  // namespace fbvins

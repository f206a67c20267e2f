// SPDX-License-Identifier: Apache-2.0
// The frontends by name. A new one of the library is one line in the table of frontend_options.cpp, and a group below where it
// has options; one of your own is registered (frontend_registry.hpp). Programs and configuration files ask for the names.
//
//   for (const std::string& name : frontend_names()) offer(name);
//   Result<std::unique_ptr<Frontend>> frontend = make_frontend(rig, options);     // or make_frontend(rig, "orb")
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/features/booster_options.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_options.hpp"
#include "fbvins/frontend/orb_options.hpp"

namespace fbvins {

/// All frontends, the library's first, of these the cheapest first.
std::vector<std::string> frontend_names();
/// The one that is used if none is named.
std::string default_frontend();
/// The names as the choices of an option: "klt|orb|boost".
std::string frontend_choices();
/// One line about all of them, for the help of that option.
std::string frontend_meanings();

/// The boost frontend is the orb frontend, with its options, and a network that improves descriptors.
struct BoostFrontendOptions {
  BoosterOptions booster;

  template <class V>
  void visit(V&& v) {
    v.group("booster", booster, "the network");
  }
};

struct FrontendOptions {
  std::string kind = default_frontend();
  KltFrontendOptions klt;
  OrbFrontendOptions orb;
  BoostFrontendOptions boost;
  std::string own;  ///< for a registered one, in whatever form it reads

  template <class V>
  void visit(V&& v) {
    v("kind", kind, frontend_choices(), frontend_meanings());
    v.group("klt", klt, "the klt frontend");
    v.group("orb", orb, "the orb frontend");
    v.group("boost", boost, "the boost frontend, in addition to the orb frontend's options");
    v("own", own, "", "what a frontend of a plugin is told, in its own form");
  }
};

/// An error if there is no frontend of that name, or the booster's weights cannot be used.
Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const FrontendOptions& options);
/// The same with the options' defaults.
Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const std::string& name);

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// The frontends by name. A new frontend is one line in the table of frontend_options.cpp, and a group below where it has
// options; programs and configuration files ask for the names.
//
//   for (const std::string& name : frontend_names()) offer(name);
//   Result<std::unique_ptr<Frontend>> frontend = make_frontend(rig, options);     // or make_frontend(rig, "orb")
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_frontend.hpp"
#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {

/// All there are; the first is the default.
std::vector<std::string> frontend_names();
/// The same as the choices of an option: "klt|orb|boost".
const std::string& frontend_choices();
/// One line about all of them, for the option.
const std::string& frontend_meanings();

/// The boost frontend is the orb frontend with improved descriptors, whose distances are others.
struct BoostFrontendOptions {
  BoosterOptions booster;
  int max_distance = 60;
  double max_ratio = 0.85;
  int stereo_max_distance = 64;

  template <class V>
  void visit(V&& v) {
    v.group("booster", booster, "the network");
    v("max_distance", max_distance, "bit", "largest Hamming distance of a match over time", 1, 256);
    v("max_ratio", max_ratio, "", "largest ratio of the best to the second-best distance", 0.1, 1.0);
    v("stereo_max_distance", stereo_max_distance, "bit", "largest Hamming distance of a match from left to right", 1, 256);
  }
};

struct FrontendOptions {
  std::string kind = frontend_names().front();
  KltFrontendOptions klt;
  OrbFrontendOptions orb;
  BoostFrontendOptions boost;

  template <class V>
  void visit(V&& v) {
    v("kind", kind, frontend_choices(), frontend_meanings());
    v.group("klt", klt, "the klt frontend");
    v.group("orb", orb, "the orb frontend");
    v.group("boost", boost, "what the boost frontend does other than the orb frontend");
  }
};

/// An error where there is no frontend of that name, or what it needs (the booster's weights) cannot be used.
Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const FrontendOptions& options);
/// The same with the options' defaults.
Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const std::string& name);

}  // namespace fbvins

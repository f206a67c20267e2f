// SPDX-License-Identifier: Apache-2.0
// Private: the parameters with which PX4 fuses our poses (docs/px4.md), as a file to load and as sentences about those of a
// vehicle. Pure functions.
//
//   write(px4_parameter_file({.gps = true}));
//   for (const Px4Finding& finding : judge_px4({}, values)) print(finding.sentence);
#pragma once

#include <map>
#include <string>
#include <vector>

namespace fbvins {

enum class Px4Link { none, serial, ethernet };  ///< none: the simulator, or set up otherwise

struct Px4VisionSetup {
  bool gps = false, compass = false;  ///< fused beside vision
  bool barometer = true;              ///< a second height, for when vision fails
  Px4Link link = Px4Link::none;
  int system_id = 1;  ///< live.mavlink.system_id
};

struct Px4Parameter {
  std::string name;
  double value = 0;
  bool whole = true;    ///< INT32, else a float
  bool reboot = false;  ///< takes effect after one
  std::string why;
  bool at_least = false, at_most = false;  ///< larger (smaller) values are fine
};

/// In the order of the document.
std::vector<Px4Parameter> px4_parameters(const Px4VisionSetup& setup);

/// As QGroundControl and MAVSDK load it: vehicle, component, name, value and type, separated by tabs.
std::string px4_parameter_file(const Px4VisionSetup& setup);

/// The names that judge_px4() looks at: those above, and some that explain.
std::vector<std::string> px4_parameter_names(const Px4VisionSetup& setup);

struct Px4Finding {
  bool wrong = true;  ///< false: a remark
  std::string name, sentence;
};

/// One sentence for each parameter that is wrong or that this PX4 does not have (it is not in `values`), and remarks.
std::vector<Px4Finding> judge_px4(const Px4VisionSetup& setup, const std::map<std::string, double>& values);

}  // namespace fbvins

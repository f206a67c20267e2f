// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/spoilers.hpp"

#include <array>

#include "fbvins/doctor/spoiler_lists.hpp"

namespace fbvins {

std::vector<Spoiler> spoilers(const StereoRig& rig) {
  std::vector<Spoiler> all;
  for (std::vector<Spoiler>& some :
       std::array{spoil::of_the_imu(), spoil::of_gaps(), spoil::of_the_calibration(rig), spoil::of_the_images(rig)})
    for (Spoiler& spoiler : some) all.push_back(std::move(spoiler));
  return all;
}

}  // namespace fbvins

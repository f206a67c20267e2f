// SPDX-License-Identifier: Apache-2.0
#include "tests/support/setup_faults.hpp"

#include <array>

#include "tests/support/setup_fault_lists.hpp"

namespace fbvins {

std::vector<SetupFault> setup_faults(const StereoRig& rig) {
  std::vector<SetupFault> all;
  for (std::vector<SetupFault>& some : std::array{setup_fault::of_the_imu(), setup_fault::of_gaps(),
                                                  setup_fault::of_the_calibration(rig), setup_fault::of_the_images(rig)})
    for (SetupFault& fault : some) all.push_back(std::move(fault));
  return all;
}

}  // namespace fbvins

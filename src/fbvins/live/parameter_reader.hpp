// SPDX-License-Identifier: Apache-2.0
// Private: reads a flight controller's parameters by MAVLink, once, in wall time. One thread.
//
//   auto values = read_parameters("udp:127.0.0.1:14580", {"EKF2_EV_CTRL"}, {});
#pragma once

#include <map>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct ParameterReaderOptions {
  int system_id = 1;
  double heard_within_s = 5;  ///< of a heartbeat
  double answer_s = 0.3;      ///< before a request is sent again
  int tries = 4;
};

/// Values by name; names that are not answered are left out. An error where the address is none, its port cannot be opened, or no
/// flight controller is heard.
Result<std::map<std::string, double>> read_parameters(const std::string& address, const std::vector<std::string>& names,
                                                      const ParameterReaderOptions& options);

}  // namespace fbvins

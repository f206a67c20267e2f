// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// What a flight can be asked to do while it goes on. `act` returns at once and tells, once and on any thread, what was done, or
/// why not.
struct FlightCommand {
  using Told = std::function<void(const Result<std::string>& done)>;
  std::string name;  ///< "save_map"
  std::function<void(Told told)> act;
  std::string never = {};  ///< why this flight cannot do it at all, in one sentence; empty: it can
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// Private: what is said of readings and images that were never taken at the same time, and why that may be. Any thread.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

struct StampRange {
  Time first, last;
};

/// "NAME: stamps 5.0 to 9.0 s do not overlap the images' 7000.0 to 9000.0 s: ...": where the ratio is that of two units, which;
/// else by how much the clocks are apart. `name`: of the readings; `part`: the images are those of a part that was asked for.
Error no_overlap(const std::string& name, const StampRange& readings, const StampRange& images, bool part);

/// What is said where many rows have the stamp of the one before; empty where few do.
std::string shared_stamps(int rows, int duplicates);

}  // namespace fbvins

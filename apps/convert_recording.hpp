// SPDX-License-Identifier: Apache-2.0
// A recording in another format, as `fbvins convert` writes it: a bag for FILE.bag, a flight record for FILE.mcap, else an EuRoC
// folder. One thread.
#pragma once

#include <functional>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins::app {

/// The number of stereo frames. An error where `out` exists already or the disk is full.
Result<int> convert_recording(Dataset& data, const std::string& out, const std::function<void(int frames)>& on_frame);

}  // namespace fbvins::app

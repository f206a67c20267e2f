// SPDX-License-Identifier: Apache-2.0
// Private to bags: the calibration that is given with a recording, put into its options. One thread.
#pragma once

#include <filesystem>
#include <string>

#include "fbvins/bags/recording.hpp"

namespace fbvins {

void find_tum_vi(const std::filesystem::path& folder, RecordingOptions& options);
void choose_imu(const std::string& path, RecordingOptions& options);
Result<void> take_calibration(bool bag, RecordingOptions& options);

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// Private to io: the EuRoC ASL layout (cam0, cam1, imu0, state_groundtruth_estimate0), in a folder
// or a zip archive, below mav0 or any other name.
#pragma once

#include "fbvins/io/dataset.hpp"

namespace fbvins {

Result<DatasetContents> open_euroc(const std::string& path, const DatasetOptions& options);

}  // namespace fbvins

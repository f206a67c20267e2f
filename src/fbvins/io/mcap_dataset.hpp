// SPDX-License-Identifier: Apache-2.0
// Private: flight records as recordings. They are scanned once when opened; images are read from the file when they are
// delivered.
#pragma once

#include "fbvins/core/byte_source.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// By the first bytes, or by the ending of the name.
bool is_mcap(const std::string& path);
Result<DatasetContents> open_mcap(const std::string& path, const DatasetOptions& options);
/// The same of bytes; `name` is only for messages.
Result<DatasetContents> read_mcap(std::shared_ptr<const ByteSource> bytes, const std::string& name,
                                  const DatasetOptions& options);

/// The configuration that the flight was flown with, as YAML.
Result<std::string> recorded_configuration(const std::string& path);

/// The poses that a flight record has on /odometry, in its order; none where the file is no record of ours.
Trajectory<W> recorded_odometry(const std::string& path);

}  // namespace fbvins

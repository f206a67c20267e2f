// SPDX-License-Identifier: Apache-2.0
// Private to io: where in a folder or an archive a EuRoC recording lies, and what it is called.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {

/// The folder, within `files`, that holds cam0 and imu0; an error where there is none, or where there are several.
Result<std::string> find_root(const FileSource& files, const std::string& path);
/// Last part of the path, without mav0 and without .zip.
std::string dataset_name(const std::string& path);

}  // namespace fbvins

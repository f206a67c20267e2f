// SPDX-License-Identifier: Apache-2.0
// Private: files that are given where a calibration is wanted, and are something else. A pure function, any thread.
#pragma once

#include <string>

namespace fbvins {

/// What the text is, and what to do with it, as the end of a sentence "FILE: this is ...": empty where it is not known.
std::string foreign_file(const std::string& text);

}  // namespace fbvins

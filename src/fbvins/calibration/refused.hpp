// SPDX-License-Identifier: Apache-2.0
// Private to the calibration: what cannot be calibrated from, or has no certain answer, as an error.
#pragma once

#include <string>
#include <utility>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// `sentence` without its full stop.
inline Error refused(std::string sentence) { return {ErrorCode::invalid_argument, std::move(sentence)}; }

}  // namespace fbvins

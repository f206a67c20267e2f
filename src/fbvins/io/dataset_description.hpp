// SPDX-License-Identifier: Apache-2.0
// Private to io: counts, rates and gaps of what a format's reader has found.
#pragma once

#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// Fills in what `contents.info` says of its frames and IMU samples, with a warning for each long gap. Needs a frame.
void describe(DatasetContents& contents);

}  // namespace fbvins

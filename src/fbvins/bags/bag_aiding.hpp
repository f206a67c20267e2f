// SPDX-License-Identifier: Apache-2.0
// Private to bags: readings of aiding sensors. Pure functions.
#pragma once

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// Fills `out` with those on the chosen topics, each where its sensor sits. An error where the bag does not know its place;
/// warnings name what is there and not used.
Result<void> read_aiding(const BagContents& contents, const ChosenTopics& topics, DatasetContents& out);

}  // namespace fbvins

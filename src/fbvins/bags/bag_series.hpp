// SPDX-License-Identifier: Apache-2.0
// Private to bags: the files that a recorder has split one recording into, as one bag. The parts are read one after the
// other.
//
//   std::unique_ptr<BagReader> bag = join_bags(std::move(parts));
#pragma once

#include <memory>
#include <vector>

#include "fbvins/bags/bag_reader.hpp"

namespace fbvins {

/// In the order of recording; at least one. With only() all parts are read: each would count from its own first message.
std::unique_ptr<BagReader> join_bags(std::vector<std::unique_ptr<BagReader>> parts);

}  // namespace fbvins

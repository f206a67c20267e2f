// SPDX-License-Identifier: Apache-2.0
// Private: what a measurement or a report says of the machine that it was made on.
#pragma once

#include <string>

namespace fbvins {

/// Processor, cores, memory and kernel, in one line.
std::string describe_machine();

}  // namespace fbvins

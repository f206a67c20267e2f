// SPDX-License-Identifier: Apache-2.0
// Private to bags: stamps that drivers did not set, and clocks that did not run on. Functions of what was read, any thread.
//
//   if (Result<void> good = leave_out_zero_stamps(contents, topics, warnings); !good) return good;
//   JoinedClock clock = continue_clock(contents, topics);
#pragma once

#include <string>
#include <vector>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/clock_steps.hpp"

namespace fbvins {

/// Messages that were written in another order than they were recorded in, put in that order. A clock that was set back while
/// recording looks the same, but for stamps that come close to each other in the order of times: then nothing is done.
void sort_by_recording(BagContents& contents);

/// Header stamps of zero, which a driver that does not stamp leaves: an error where all are, else they are left out, and said.
Result<void> leave_out_zero_stamps(BagContents& contents, const ChosenTopics& topics, std::vector<std::string>& warnings);

/// Continues the stamps on these topics, and of the ground truth, where their clock wrapped or stepped back (clock_steps.hpp).
JoinedClock continue_clock(BagContents& contents, const ChosenTopics& topics);

}  // namespace fbvins

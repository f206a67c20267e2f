// SPDX-License-Identifier: Apache-2.0
// Private: an MCAP file of ROS 2's messages written again, whole: with index, statistics and footer, whatever happened to its
// writer. Nothing is decoded, so that each message, attachment and piece of metadata is as it was. One thread.
//
//   Result<RecoveredMcap> done = recover_mcap("cut.mcap", "whole.mcap", {});
#pragma once

#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

struct RecoveredMcap {
  int messages = 0;
  int parts_left_out = 0;    ///< damaged
  std::string first_damage;  ///< "file: byte N: sentence"
  bool was_cut_off = false;
};

/// Only messages recorded in [from, to).
struct McapPart {
  Time from{0}, to{std::int64_t{1} << 62};
};

/// An error where `in` is no such file, holds no message, or `out` exists already or cannot be written.
Result<RecoveredMcap> recover_mcap(const std::string& in, const std::string& out, const McapPart& part = {});

}  // namespace fbvins

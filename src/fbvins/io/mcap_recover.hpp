// SPDX-License-Identifier: Apache-2.0
// Private: an MCAP file of ROS 2's messages written again, whole: with index, statistics and footer, whatever happened to its
// writer. Nothing is decoded, so that each message, attachment and piece of metadata is as it was. One thread.
//
// A flight record whose topics get other names, or that is to lie in a folder of rosbag2, becomes a bag: its calibration is then
// on kRigTopic (rig_text.hpp), with the names of its topics, where it would else be an attachment that ROS's programs do not
// keep.
//
//   Result<RecoveredMcap> done = recover_mcap("cut.mcap", "whole.mcap", {});
#pragma once

#include <map>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

struct RecoveredMcap {
  struct Topic {
    std::string name, type;
    int messages = 0;
  };
  int messages = 0;
  std::vector<Topic> topics;  ///< as written
  Time first, last;           ///< messages written
  int parts_left_out = 0;     ///< damaged
  std::string first_damage;   ///< "file: byte N: sentence"
  bool was_cut_off = false;
};

/// Only messages recorded in [from, to).
struct McapPart {
  Time from{0}, to{std::int64_t{1} << 62};
  std::map<std::string, std::string> names = {};  ///< topics that get another name
  bool bag = false;                               ///< a bag, though no name changes
};

/// An error where `in` is no such file, holds no message, or `out` exists already or cannot be written; where a topic that gets
/// another name is not there, or two would have one name.
Result<RecoveredMcap> recover_mcap(const std::string& in, const std::string& out, const McapPart& part = {});

}  // namespace fbvins

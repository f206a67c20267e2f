// SPDX-License-Identifier: Apache-2.0
// Private to io: the readings of aiding sensors in a flight record, and where they sit. One owner.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/mcap_reader.hpp"

namespace fbvins {

class RecordedAiding {
 public:
  /// Any message of the record; false for one that is not what its topic says.
  bool take(const McapMessage& message);
  /// In order of stamps, where the record says that each sensor sits; without those of which it does not.
  std::vector<AidingSample> readings() const;

 private:
  std::vector<AidingMessage> messages_;
  std::map<std::string, Pose<B, B>> mounted_;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/messages.hpp"

#include <algorithm>

namespace fbvins {

StatusTextMessage status_text(MavSeverity severity, const std::string& sentence) {
  StatusTextMessage message;
  message.severity = severity;
  std::copy_n(sentence.begin(), std::min(sentence.size(), message.text.size()), message.text.begin());
  return message;
}

}  // namespace fbvins

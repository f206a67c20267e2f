// SPDX-License-Identifier: Apache-2.0
// Private: encodes an image as a JPEG that is small enough for a radio link. One thread per encoder.
#pragma once

#include <memory>
#include <string>

#include "fbvins/types/image.hpp"

namespace fbvins {

class GreyJpeg {
 public:
  GreyJpeg();
  /// Halved until it is at most 800 pixels wide; empty where it cannot be encoded.
  std::string encode(const Image& image);

 private:
  struct Close {
    void operator()(void* handle) const;
  };
  std::unique_ptr<void, Close> encoder_;
};

}  // namespace fbvins

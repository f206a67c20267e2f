// SPDX-License-Identifier: Apache-2.0
// Images that may be kept. Those in a driver's buffers, of which there are few, have to be given back soon.
//
//   kept.push_back(owned(frame));
#pragma once

#include <memory>

#include "fbvins/types/image.hpp"

namespace fbvins {

/// The image itself, or a copy where its pixels lie in foreign memory.
inline std::shared_ptr<const Image> owned(const std::shared_ptr<const Image>& image) {
  if (!image || !image->foreign()) return image;
  auto copy = std::make_shared<Image>(*image);
  copy->row(0);  // to be written: the pixels move
  return copy;
}

inline StereoFrame owned(StereoFrame frame) {
  for (auto& image : frame.images) image = owned(image);
  return frame;
}

}  // namespace fbvins

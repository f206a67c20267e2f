// SPDX-License-Identifier: Apache-2.0
// Private: whether a recording's images can be read at all, found out before anybody relies on it. One thread.
//
//   if (Result<void> readable = check_images(contents); !readable) return readable.error();
//
// Single damaged images are left out and counted while they are delivered (ImageCounts). That all of a camera's images are of
// another size or encoding than is understood is a mistake in the setup, and a recording without that camera is not what was
// asked for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// An error where not one of up to eight images of a camera or of the depth sensor, spread over the recording, can be read: the
/// sentence about the first.
Result<void> check_images(const DatasetContents& contents);

/// A rig whose lenses are scaled to the images that there are.
struct ScaledRig {
  StereoRig rig;
  std::vector<ScaledLens> cameras;  ///< that were scaled, one at least
};
/// None where images are of the calibration's size, or of another shape. Of a camera all images tried must be of one size.
std::optional<ScaledRig> scaled_to_images(const DatasetContents& contents);

/// Places of up to eight images, in equal steps from the first to the last; `file` is that of a frame, empty where it has none.
std::vector<std::string> images_to_try(const std::vector<FrameEntry>& frames,
                                       const std::function<std::string(const FrameEntry&)>& file);

}  // namespace fbvins

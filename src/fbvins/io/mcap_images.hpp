// SPDX-License-Identifier: Apache-2.0
// Images of a flight record, read from its file when a frame is asked for.
//
//   entry.file(0) = mcap_image_name(message.offset, message.data.size());
//   std::unique_ptr<FrameLoader> loader = make_mcap_loader(bytes, "flight.mcap", rig);
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/byte_source.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// How a FrameEntry names the image whose message is at this byte of the file and so many bytes long.
std::string mcap_image_name(std::uint64_t offset, std::uint64_t length);

/// Loads images of the rig's cameras from messages at the places that mcap_image_name() has named. An image that cannot be read,
/// or has another size than its camera, is left out, counted, and the first one told with `name` and its byte.
std::unique_ptr<FrameLoader> make_mcap_loader(std::shared_ptr<const ByteSource> bytes, std::string name, const StereoRig& rig);

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/image_check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace fbvins {
namespace {

constexpr std::size_t kTried = 8;

Result<void> check_camera(const DatasetContents& contents, std::string FrameEntry::*file, const char* name) {
  const std::vector<FrameEntry> frames = frames_to_try(contents.frames, file);
  std::string first;
  for (const FrameEntry& frame : frames) {
    FrameEntry one_image{frame.t, "", "", std::nullopt};
    one_image.*file = frame.*file;
    const LoadedFrame loaded = contents.loader->load(one_image);
    if (loaded.frame.left || loaded.frame.right || loaded.frame.depth) return {};
    if (first.empty()) first = loaded.problem;
  }
  if (frames.empty()) return {};
  return Error{ErrorCode::unsupported, fmt::format("{} (none of {} {} images tried can be used)", first, frames.size(), name)};
}

}  // namespace

std::vector<FrameEntry> frames_to_try(const std::vector<FrameEntry>& frames, std::string FrameEntry::*file) {
  std::vector<const FrameEntry*> with_image;
  for (const FrameEntry& frame : frames)
    if (!(frame.*file).empty()) with_image.push_back(&frame);
  std::vector<FrameEntry> out;
  const std::size_t count = std::min(kTried, with_image.size());
  for (std::size_t i = 0; i < count; ++i) out.push_back(*with_image[count == 1 ? 0 : i * (with_image.size() - 1) / (count - 1)]);
  return out;
}

Result<void> check_images(const DatasetContents& contents) {
  if (Result<void> left = check_camera(contents, &FrameEntry::left_file, "left"); !left) return left;
  if (Result<void> right = check_camera(contents, &FrameEntry::right_file, "right"); !right) return right;
  return check_camera(contents, &FrameEntry::depth_file, "depth");
}

}  // namespace fbvins

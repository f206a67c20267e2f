// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/image_check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace fbvins {
namespace {

constexpr std::size_t kTried = 8;

/// `put`: names the image's place in an entry that has nothing else.
Result<void> check_sensor(const DatasetContents& contents, const std::string& name,
                          const std::function<std::string(const FrameEntry&)>& file,
                          const std::function<void(FrameEntry&, std::string)>& put) {
  const std::vector<std::string> images = images_to_try(contents.frames, file);
  std::string first;
  for (const std::string& image : images) {
    FrameEntry one_image{contents.frames.front().t, "", ""};
    put(one_image, image);
    const LoadedFrame loaded = contents.loader->load(one_image);
    if (!loaded.frame.without_images() || loaded.frame.depth) return {};
    if (first.empty()) first = loaded.problem;
  }
  if (images.empty()) return {};
  return Error{ErrorCode::unsupported, fmt::format("{} (none of {} {} images tried can be used)", first, images.size(), name)};
}

Result<void> check_camera(const DatasetContents& contents, int camera) {
  const std::string name = camera == 0 ? "left" : camera == 1 ? "right" : fmt::format("camera {}", camera);
  return check_sensor(
      contents, name, [=](const FrameEntry& f) { return f.file(camera); },
      [=](FrameEntry& f, std::string image) {
        if (camera > 1) f.more_files.resize(static_cast<std::size_t>(camera - 1));
        (camera == 0 ? f.left_file : camera == 1 ? f.right_file : f.more_files.back()) = std::move(image);
      });
}

}  // namespace

std::vector<std::string> images_to_try(const std::vector<FrameEntry>& frames,
                                       const std::function<std::string(const FrameEntry&)>& file) {
  std::vector<std::string> all;
  for (const FrameEntry& frame : frames)
    if (std::string image = file(frame); !image.empty()) all.push_back(std::move(image));
  std::vector<std::string> out;
  const std::size_t count = std::min(kTried, all.size());
  for (std::size_t i = 0; i < count; ++i) out.push_back(all[count == 1 ? 0 : i * (all.size() - 1) / (count - 1)]);
  return out;
}

Result<void> check_images(const DatasetContents& contents) {
  for (int i = 0; i < contents.rig.camera_count(); ++i)
    if (Result<void> good = check_camera(contents, i); !good) return good;
  return check_sensor(
      contents, "depth", [](const FrameEntry& f) { return f.depth_file; },
      [](FrameEntry& f, std::string image) { f.depth_file = std::move(image); });
}

}  // namespace fbvins

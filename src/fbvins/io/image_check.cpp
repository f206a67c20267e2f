// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/image_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "fbvins/camera/scaled_lens.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kTried = 8;

/// Names an image's place in an entry that has nothing else.
using Put = std::function<void(FrameEntry&, std::string)>;

LoadedFrame load_alone(const DatasetContents& contents, const std::string& image, const Put& put) {
  FrameEntry one_image{contents.frames.front().t};
  put(one_image, image);
  return contents.loader->load(one_image);
}

Result<void> check_sensor(const DatasetContents& contents, const std::string& name,
                          const std::function<std::string(const FrameEntry&)>& file, const Put& put) {
  const std::vector<std::string> images = images_to_try(contents.frames, file);
  std::string first;
  for (const std::string& image : images) {
    const LoadedFrame loaded = load_alone(contents, image, put);
    if (!loaded.frame.without_images() || loaded.frame.depth) return {};
    if (first.empty()) first = loaded.problem;
  }
  if (images.empty()) return {};
  return Error{ErrorCode::unsupported, fmt::format("{} (none of {} {} images tried can be used)", first, images.size(), name)};
}

Put put_image_of(int camera) {
  return [camera](FrameEntry& f, std::string image) { f.file(camera) = std::move(image); };
}

Result<void> check_camera(const DatasetContents& contents, int camera) {
  const std::string name = camera == 0 ? "left" : camera == 1 ? "right" : fmt::format("camera {}", camera);
  return check_sensor(
      contents, name, [=](const FrameEntry& f) { return f.file(camera); }, put_image_of(camera));
}

/// Of a camera's images, where all that are tried have one, which is not the calibration's.
std::optional<ImageSize> other_size_of(const DatasetContents& contents, int camera) {
  std::optional<ImageSize> size;
  for (const std::string& image : images_to_try(contents.frames, [=](const FrameEntry& f) { return f.file(camera); })) {
    const LoadedFrame loaded = load_alone(contents, image, put_image_of(camera));
    if (!loaded.frame.without_images()) return std::nullopt;
    if (!loaded.other_size) continue;  // broken
    if (size && *size != *loaded.other_size) return std::nullopt;
    size = loaded.other_size;
  }
  return size;
}

}  // namespace

std::optional<ScaledRig> scaled_to_images(const DatasetContents& contents) {
  ScaledRig out{contents.rig, {}};
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < contents.rig.camera_count(); ++i) {
    cameras.push_back(contents.rig.mounted(i));
    const std::optional<ImageSize> size = other_size_of(contents, i);
    if (!size) continue;
    std::optional<Camera> scaled = scaled_to(cameras.back().camera, size->width, size->height);
    if (!scaled) scaled = middle_of(cameras.back().camera, size->width, size->height);
    if (!scaled) return std::nullopt;
    out.cameras.push_back({i, {cameras.back().camera.width(), cameras.back().camera.height()}, *size});
    cameras.back().camera = *scaled;
  }
  if (out.cameras.empty()) return std::nullopt;
  out.rig = with_cameras(out.rig, cameras);
  return out;
}

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
    if (Result<void> good = check_camera(contents, i); !good) {
      const bool scales = scaled_to_images(contents).has_value();
      return Error{good.error().code,
                   good.error().message + (scales ? "; `fbvins doctor --fix` scales or cuts a calibration" : "")};
    }
  return check_sensor(
      contents, "depth", [](const FrameEntry& f) { return f.depth_file; },
      [](FrameEntry& f, std::string image) { f.depth_file = std::move(image); });
}

}  // namespace fbvins

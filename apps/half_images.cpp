// SPDX-License-Identifier: Apache-2.0
#include "apps/half_images.hpp"

#include <memory>
#include <optional>

#include "fbvins/camera/scaled_lens.hpp"

namespace fbvins::app {
namespace {

/// Each pixel is the mean of four; an odd last column or row is left out.
std::shared_ptr<const Image> half_of(const std::shared_ptr<const Image>& image) {
  if (!image) return nullptr;
  auto half = std::make_shared<Image>(image->width() / 2, image->height() / 2);
  for (int y = 0; y < half->height(); ++y)
    for (int x = 0; x < half->width(); ++x) {
      const std::uint8_t *above = image->row(2 * y) + 2 * x, *below = image->row(2 * y + 1) + 2 * x;
      half->at(x, y) = static_cast<std::uint8_t>((above[0] + above[1] + below[0] + below[1] + 2) / 4);
    }
  return half;
}

/// One distance of four: a mean would lie between an object and what is behind it.
std::shared_ptr<const DepthImage> half_of(const std::shared_ptr<const DepthImage>& depth) {
  if (!depth) return nullptr;
  auto half = std::make_shared<DepthImage>(DepthImage{depth->width / 2, depth->height / 2, {}});
  for (int y = 0; y < half->height; ++y)
    for (int x = 0; x < half->width; ++x) half->mm.push_back(depth->row(2 * y)[2 * x]);
  return half;
}

bool halve(Camera& camera) {
  const std::optional<Camera> half = scaled_to(camera, camera.width() / 2, camera.height() / 2);
  if (!half) return false;
  CameraTimes times = camera.own_times();
  times.line_delay_s *= 2;  // half as many rows in the same time
  camera = *half;
  camera.set_own_times(times);
  return true;
}

}  // namespace

Result<StereoRig> with_half_images(StereoRig rig) {
  bool done = true;
  for (MountedCamera& mounted : rig.cameras) done = done && halve(mounted.camera);
  if (rig.depth && rig.depth->own) done = done && halve(rig.depth->own->camera);
  rig.line_delay_s *= 2;
  if (!done) return Error{ErrorCode::invalid_argument, "the images are too small to be halved"};
  return rig;
}

StereoFrame with_half_images(StereoFrame frame) {
  for (auto& image : frame.images) image = half_of(image);
  frame.depth = half_of(frame.depth);
  return frame;
}

}  // namespace fbvins::app

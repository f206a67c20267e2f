// SPDX-License-Identifier: Apache-2.0
// Images of the odometry in NumPy's arrays.
#pragma once

#include <memory>

#include "bindings.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"
#include "python_types.hpp"

namespace fbvins::python {

/// An image in an array's memory, which is not copied: the array is kept alive until the last reader is done.
inline std::shared_ptr<const Image> image_of(nb::handle object, const char* name, const Camera& camera) {
  if (object.is_none()) return nullptr;
  auto array = checked<std::uint8_t>(object, name, {camera.height(), camera.width()});
  PyObject* kept = array.keeper.release().ptr();
  std::shared_ptr<const std::uint8_t> keeper(array.data, [kept](const std::uint8_t*) {
    const nb::gil_scoped_acquire acquired;
    Py_DECREF(kept);
  });
  return std::make_shared<const Image>(camera.width(), camera.height(), std::move(keeper));
}

/// A copy: a depth image is read at a few places, once.
inline std::shared_ptr<const DepthImage> depth_of(nb::handle object, const StereoRig& rig) {
  if (object.is_none()) return nullptr;
  if (!rig.depth) throw nb::value_error("depth: the rig has no depth sensor");
  const Camera& camera = rig.depth_camera();
  const auto array = checked<std::uint16_t>(object, "depth", {camera.height(), camera.width()});
  auto depth = std::make_shared<DepthImage>(DepthImage{camera.width(), camera.height(), {}});
  depth->mm.assign(array.data, array.data + static_cast<std::size_t>(depth->width) * depth->height);
  return depth;
}

}  // namespace fbvins::python

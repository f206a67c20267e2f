// SPDX-License-Identifier: Apache-2.0
#include "apps/open_cameras.hpp"

#include <fmt/format.h>

#ifdef FBVINS_WITH_BAGS
#include "fbvins/bags/camera_bag.hpp"
#endif

namespace fbvins::app {

Result<CameraRecording> open_cameras(const std::string& path, const std::vector<std::string>& topics) {
#ifdef FBVINS_WITH_BAGS
  if (is_camera_bag(path)) return open_camera_bag(path, topics);
  const char* others = "";
#else
  const char* others = " (this fbvins was built without the reader of bags and flight records)";
#endif
  if (!topics.empty())
    return Error{ErrorCode::invalid_argument, fmt::format("{}: is no bag, which alone has topics{}", path, others)};
  Result<CameraRecording> recording = open_euroc_cameras(path);
  if (!recording) return Error{recording.error().code, recording.error().message + others};
  return recording;
}

}  // namespace fbvins::app

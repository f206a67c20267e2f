// SPDX-License-Identifier: Apache-2.0
// From a frontend for one camera, or for a pair whose left camera never fails, to one for any rig.
//
//   class MyFrontend : public Frontend { ... };   // follows features in rig.left(), and finds them again in rig.right()
//   const auto make = [](const StereoRig& pair) { return std::make_unique<MyFrontend>(pair); };
//   std::unique_ptr<Frontend> frontend = for_any_rig(rig, 150, make);
#pragma once

#include <functional>
#include <memory>

#include "fbvins/camera/camera.hpp"
#include "fbvins/frontend/frontend.hpp"

namespace fbvins {

/// Makes a frontend for a rig of one or two cameras.
using FrontendOfPair = std::function<std::unique_ptr<Frontend>(const StereoRig& cameras)>;

/// Each group of cameras that overlap has a frontend of its own (camera_groups.hpp), and one more for the mirrored pair goes on
/// where the left camera's images do not come, with new tracks. It is made anew then, and numbers its tracks from 0 as before:
/// they are numbered on. Left out are features that the cameras' masks hide or whose numbers are not finite. Whether a usable
/// image came is filled in. `max_features`: that a frontend of one pair follows; of a rig with several each is told its share.
std::unique_ptr<Frontend> for_any_rig(const StereoRig& rig, int max_features, FrontendOfPair make);

}  // namespace fbvins

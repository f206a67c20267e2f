// SPDX-License-Identifier: Apache-2.0
// What the doctor keeps of a recording: feature positions and statistics, and a few small images. Values.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/doctor/gradient_energies.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// A feature of a left image.
struct SeenFeature {
  std::int64_t id = 0;
  Vec2 px = Vec2::Zero();    ///< raw image
  double inverse_depth = 0;  ///< 1/m, along z of C0, by the working rig; 0 where it was not matched
  bool bright_dot = false;   ///< looks like the spot of a projector
};

struct SeenFrame {
  Time t;
  bool has_depths = false;  ///< its features were searched in the right image
  GradientEnergies gradients;
  std::vector<SeenFeature> features;  ///< by ascending id
};

/// The same point in both raw images, found without the calibration.
struct StereoPoint {
  Vec2 left = Vec2::Zero(), right = Vec2::Zero();
};
struct StereoView {
  Time t;
  std::vector<StereoPoint> points;
};

/// Both images at half their size.
struct SmallView {
  Time t;
  Vec2 moved_px = Vec2::Zero();  ///< of the scene in the left image since the view before; 0 where that is not known
  std::shared_ptr<const Image> left, right;
};

/// Counts of images that equal the one before, and of pairs whose two images are equal, to the last bit.
struct RepeatedImages {
  int frames = 0, left = 0, right = 0, same_pair = 0;
};

/// Which right image belongs to which left one, from the first seconds in motion.
struct StereoStep {
  int lag = 0;               ///< the right image that belongs to a left one comes this many images later
  double as_stamped_px = 0;  ///< epipolar error by the calibration, of images with the same stamp
  double in_step_px = 0;     ///< the same of images `lag` apart
  double period_s = 0;       ///< of the images
};

struct Evidence {
  StereoRig rig;               ///< as calibrated
  StereoRig working_rig;       ///< corrected by a stereo fit to the first seconds: good enough for depths
  StereoOrder order;           ///< of the first seconds' images
  bool swapped = false;        ///< left and right images were exchanged, and all that follows has them in order
  StereoStep step;             ///< right images that were late or early are in order as well
  std::vector<ImuSample> imu;  ///< corrected by the calibration's axes
  std::vector<Time> stamps;    ///< of all stereo images
  bool untriggered = false;    ///< right images were taken at other times than left ones, as their stamps say
  std::vector<SeenFrame> frames;
  std::vector<StereoView> stereo;
  std::vector<SmallView> views;  ///< of the times at which the scene had moved, over the whole recording
  RepeatedImages repeated;
};

}  // namespace fbvins

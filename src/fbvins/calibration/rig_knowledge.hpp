// SPDX-License-Identifier: Apache-2.0
// Private: what views of a board tell of the cameras so far, also where it is too little for a calibration: a lens near the truth
// for each camera, and the information about all parameters. What to record next follows from it (next_view.hpp). Pure functions.
#pragma once

#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/residual_summary.hpp"
#include "fbvins/calibration/rig_adjustment.hpp"

namespace fbvins {

struct RigKnowledge {
  std::vector<Camera> cameras;
  std::vector<Pose<Cn, C0>> T_CnC0;
  Eigen::MatrixXd information;          ///< of RigAdjustment's parameters, for a noise of 1 px
  double noise_px = 0.3;                ///< of a corner's coordinate
  std::vector<bool> joined;             ///< whether a camera has seen the board together with another: T_CnC0 is known
  std::vector<std::vector<bool>> used;  ///< cells of each camera's image that have held corners

  std::vector<RigCamera> rig() const;
};

RigKnowledge knowledge_of(const CameraCalibration& found);

/// Of cameras with known sizes, whether or not they have seen anything: a lens as start_camera() finds it, or the model's plain
/// lens with the focal length of usual lenses.
RigKnowledge rough_knowledge(const Detections& detections, const Board& board, const std::vector<std::string>& models,
                             double pair_tolerance_s);

}  // namespace fbvins

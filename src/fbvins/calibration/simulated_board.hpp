// SPDX-License-Identifier: Apache-2.0
// Views of a board as cameras would deliver them, for tests and the bench: exact projection and noise. Pure functions.
#pragma once

#include <numbers>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {

/// One of each model, with numbers like those of real lenses.
inline std::vector<Camera> example_cameras() {
  return {{PinholeRadtan{458.7, 457.3, 367.2, 248.4, -0.2834, 0.0740, 1.9e-4, 1.8e-5}, 752, 480},
          {KannalaBrandt{190.98, 190.97, 254.93, 256.90, 0.0034, 0.0007, -0.0020, 0.0002}, 512, 512},
          {DoubleSphere{158.3, 158.2, 254.9, 256.9, -0.172, 0.593}, 512, 512},
          {ExtendedUnified{190.9, 190.8, 254.9, 256.9, 0.63, 1.04}, 512, 512},
          {UnifiedRadtan{520.3, 519.8, 322.1, 241.7, 1.25, -0.12, 0.03, 4e-4, -3e-4}, 640, 480},
          {PinholeRadtan5{434.1, 433.2, 321.7, 238.5, -0.055, 0.066, -3e-4, 6e-4, -0.021}, 640, 480},
          {PinholeRational{505.0, 505.2, 321.0, 243.5, 0.52, -2.44, 4e-4, -1e-4, 1.42, 0.40, -2.26, 1.35}, 640, 480}};
}

struct SimulatedRig {
  std::vector<Camera> cameras;
  std::vector<Pose<Cn, C0>> T_CnC0;
};

/// Two cameras of a kind, the second of slightly other numbers, 11 cm apart.
inline SimulatedRig simulated_stereo(const Camera& left) {
  std::vector<double> other = lens_parameters(left.model());
  other[0] *= 1.004, other[1] *= 1.004, other[2] += 6, other[3] -= 4;
  return {{left, Camera(with_parameters(left.model(), other.data()), left.width(), left.height())},
          {{}, {so3_exp(Vec3(0.008, -0.012, 0.004)), Vec3(-0.11, 0.0008, -0.0012)}}};
}

/// A view by hand: the board somewhere in the image of `towards`, nearer or farther, tilted by up to 50 degrees, turned.
inline Pose<C0, T> random_board_pose(const SimulatedRig& rig, int towards, const Board& board, Rng& rng,
                                     double largest_tilt_rad = 0.87) {
  const Camera& camera = rig.cameras[towards];
  const double u = camera.width() * rng.uniform(0.12, 0.88), v = camera.height() * rng.uniform(0.12, 0.88);
  const auto n = camera.undistort({u, v});
  const Vec3 ray = n ? Vec3(n->x(), n->y(), 1).normalized() : Vec3(0, 0, 1);
  const double extent_m = board.corner(board.corner_count() - 1).norm();
  const double distance_m = extent_m * camera.focal_px() / camera.width() * rng.uniform(1.1, 2.6);
  const double axis = rng.uniform(0, 2 * std::numbers::pi), tilt = rng.uniform(0, largest_tilt_rad), roll = rng.uniform(-1, 1);
  const Quat facing = so3_between(Vec3(0, 0, 1), ray) * Quat(0, 1, 0, 0);  // z of the board towards the camera
  const Quat q = facing * so3_exp(tilt * Vec3(std::cos(axis), std::sin(axis), 0)) * so3_exp(Vec3(0, 0, roll));
  const Vec3 centre_T = 0.5 * board.corner(board.corner_count() - 1);
  const Pose<Cn, T> T_CnT(q, Vec3(distance_m * ray - q * centre_T));
  return rig.T_CnC0[towards].inverse() * T_CnT;
}

/// What the camera sees of the board: corners inside of the image, with noise.
inline BoardView simulated_view(const SimulatedRig& rig, int camera, const Board& board, const Pose<C0, T>& T_C0T, Time t,
                                double noise_px, Rng& rng) {
  BoardView view{t, camera, {}};
  const Pose<Cn, T> T_CnT = rig.T_CnC0[camera] * T_C0T;
  for (int index = 0; index < board.corner_count(); ++index) {
    const auto pixel = rig.cameras[camera].project(T_CnT * board.corner(index));
    const double du = noise_px * rng.normal(), dv = noise_px * rng.normal();
    if (pixel && rig.cameras[camera].inside(*pixel, 3)) view.corners.push_back({index, *pixel + Vec2(du, dv)});
  }
  return view;
}

struct SimulatedViews {
  Detections detections;
  std::vector<Pose<C0, T>> T_C0T;
};

/// `count` stamps, 50 ms apart; each looks at the board with the cameras in turn.
inline SimulatedViews simulated_views(const SimulatedRig& rig, const Board& board, int count, double noise_px, std::uint64_t seed,
                                      double largest_tilt_rad = 0.87) {
  SimulatedViews out;
  Rng rng(seed);
  const int cameras = static_cast<int>(rig.cameras.size());
  for (int i = 0; i < count; ++i) {
    out.T_C0T.push_back(random_board_pose(rig, i % cameras, board, rng, largest_tilt_rad));
    for (int k = 0; k < cameras; ++k) {
      BoardView view = simulated_view(rig, k, board, out.T_C0T.back(), Time{1'000'000'000 + i * 50'000'000ll}, noise_px, rng);
      if (!view.corners.empty()) out.detections.views.push_back(std::move(view));
    }
  }
  for (int k = 0; k < cameras; ++k) out.detections.sizes[k] = {rig.cameras[k].width(), rig.cameras[k].height()};
  return out;
}

}  // namespace fbvins

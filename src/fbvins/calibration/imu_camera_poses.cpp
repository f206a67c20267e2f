// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/refused.hpp"
#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kFewestCorners = 8;
constexpr double kPoorFit = 2.5;        // of a pose, over the median
constexpr double kWorstFit_px = 4;      // median over the images of one camera
constexpr double kWeakestTurns = 0.75;  // correlation of a camera's turns with the IMU's

/// Of a camera on the first one, from images of both at the same time; nullopt without such.
std::optional<Pose<C0, Cn>> seen_from_first(const std::vector<SeenPose>& first, const std::vector<SeenPose>& other) {
  std::vector<Pose<C0, Cn>> all;
  std::size_t i = 0;
  for (const SeenPose& pose : other) {
    while (i < first.size() && first[i].t_s < pose.t_s - 1e-4) ++i;
    if (i < first.size() && std::abs(first[i].t_s - pose.t_s) <= 1e-4)
      all.push_back((first[i].T_TC.inverse() * pose.T_TC).cast_frames<C0, Cn>());
  }
  if (all.size() < 5) return std::nullopt;
  // The one that is nearest to all others in each number: medians of position, and of turns against any one of them.
  const Quat q0 = all[all.size() / 2].q;
  Vec3 p, turn;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> ps, turns;
    for (const auto& pose : all) ps.push_back(pose.p(k)), turns.push_back(so3_log(q0.conjugate() * pose.q)(k));
    p(k) = median_of(ps), turn(k) = median_of(turns);
  }
  return Pose<C0, Cn>((q0 * so3_exp(turn)).normalized(), p);
}

}  // namespace

Result<CameraPoses> locate_all(const ImuCameraInput& input, Time reference) {
  CameraPoses poses(input.cameras.size());
  std::vector<std::size_t> seen(input.cameras.size(), 0);
  for (const BoardView& view : input.views) {
    const auto c = static_cast<std::size_t>(view.camera);
    if (view.corners.size() < kFewestCorners) continue;
    ++seen[c];
    if (const auto pose = find_board_pose(input.cameras[c], input.board, view.corners))
      poses[c].push_back({view.camera, (view.t - reference).seconds(), pose->T_CnT.inverse(), pose->rms_px});
  }
  for (std::size_t c = 0; c < poses.size(); ++c) {
    if (seen[c] >= kFewestBoardViews && 2 * poses[c].size() < seen[c])
      return refused(fmt::format(
          "the corners that camera {} sees do not lie as on this board: is it the right board file and the right lens?", c));
    if (poses[c].size() < kFewestBoardViews)
      return refused(fmt::format("camera {} shows the board in {} images with at least {} corners: {} are needed", c,
                                 poses[c].size(), kFewestCorners, kFewestBoardViews));
    std::sort(poses[c].begin(), poses[c].end(), [](const SeenPose& a, const SeenPose& b) { return a.t_s < b.t_s; });
    std::vector<double> fits;
    for (const SeenPose& pose : poses[c]) fits.push_back(pose.sigma_px);
    if (const double fit = median_of(fits); fit > kWorstFit_px)
      return refused(fmt::format(
          "the corners that camera {} sees do not lie as on this board ({:.1f} px off, in the median): is it the right "
          "board file and the right lens?",
          c, fit));
  }
  return poses;
}

CameraPoses good_ones(CameraPoses poses) {
  for (std::vector<SeenPose>& camera : poses) {
    std::vector<double> fits;
    for (const SeenPose& pose : camera) fits.push_back(pose.sigma_px);
    const double limit_px = kPoorFit * median_of(fits);
    std::erase_if(camera, [&](const SeenPose& pose) { return pose.sigma_px > limit_px; });
  }
  return poses;
}

Result<std::vector<Pose<B, Cn>>> first_extrinsics(const ImuCameraInput& input, const CameraPoses& poses, const GyroIntegral& gyro,
                                                  const TurnMatch& match) {
  std::vector<Pose<B, Cn>> T_BC = {{match.R_BC, Vec3(Vec3::Zero())}};
  const Pose<B, C0> first = T_BC[0].cast_frames<B, C0>();
  for (std::size_t c = 1; c < input.cameras.size(); ++c) {
    if (!input.T_CnC0.empty()) {
      T_BC.push_back(first * input.T_CnC0[c].inverse());
    } else if (const auto together = seen_from_first(poses[0], poses[c])) {
      T_BC.push_back(first * *together);
    } else {
      const auto own = match_turns_at(poses[c], gyro, match.time_offset_s);
      if (!own || own->agreement < kWeakestTurns)
        return refused(fmt::format("camera {} does not turn as camera 0 and the IMU do: is it of the same recording?", c));
      T_BC.push_back({own->R_BC, Vec3(Vec3::Zero())});
    }
  }
  return T_BC;
}

std::vector<BodyPose> body_poses(const CameraPoses& poses, const std::vector<Pose<B, Cn>>& T_BC,
                                 const std::vector<double>& offsets_s) {
  std::map<long, SeenPose> by_time;  // in steps of 0.1 ms
  for (const auto& camera : poses)
    for (const SeenPose& pose : camera) {
      const double t_s = pose.t_s + (offsets_s[static_cast<std::size_t>(pose.camera)] - offsets_s[0]);
      const auto [at, fresh] = by_time.emplace(std::lround(t_s * 1e4), pose);
      if (!fresh && pose.sigma_px < at->second.sigma_px) at->second = pose;
    }
  std::vector<BodyPose> out;
  for (const auto& [step, pose] : by_time)
    out.push_back({pose.t_s + offsets_s[static_cast<std::size_t>(pose.camera)],
                   pose.T_TC * T_BC[static_cast<std::size_t>(pose.camera)].inverse()});
  return out;
}

}  // namespace fbvins

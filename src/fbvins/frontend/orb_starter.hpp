// SPDX-License-Identifier: Apache-2.0
// Starts tracks: first in image cells with less than their share, then anywhere. Where the image has too few sharp corners
// (dark, blurred, plain walls), also less sharp ones at half the distance.
// Buffers are reused; one instance, one thread.
//
//   OrbStarter starter(camera, 180, 14);
//   starter.start(tracks, view, left, stats);
#pragma once

#include <array>
#include <vector>

#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbStarter {
 public:
  OrbStarter(const Camera& camera, int wanted, double min_distance_px)
      : camera_(camera), wanted_(wanted), min_distance_px_(min_distance_px) {}

  void want(int tracks) { wanted_ = tracks; }
  /// Starts tracks at keypoints that no track has. Counts observed tracks and those started.
  void start(OrbTracks& tracks, OrbView& view, const Pyramid& left, FrontendStats& stats);

 private:
  static constexpr int kColumns = 8, kRows = 5;
  struct Pass {
    bool only_poor_cells;
    double max_uncertainty_px;
    double min_distance_px;
  };
  std::size_t cell_of(const Vec2& px) const;
  void list_unused(const OrbView& view);
  void run(const Pass& pass, OrbTracks& tracks, OrbView& view, const Pyramid& left, FrontendStats& stats);
  bool start_track(std::size_t keypoint, double max_uncertainty_px, OrbTracks& tracks, OrbView& view, const Pyramid& left) const;

  Camera camera_;
  int wanted_;
  double min_distance_px_;
  std::vector<Vec2> occupied_;                 // positions of tracks
  std::array<int, kColumns * kRows> count_{};  // tracks in each cell
  std::vector<std::size_t> strongest_first_;   // keypoints without a track
};

}  // namespace fbvins

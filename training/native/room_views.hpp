// SPDX-License-Identifier: Apache-2.0
// Pairs of views of simulated rooms with true geometry: wide baselines, occlusion, surfaces seen at an angle, light that
// changes with time, which no homography of one picture has. Same seed, same bytes.
//
//   Result<RoomViews> room = RoomViews::render(7, 40);    // a preset, a world and a flight by seed; 40 frames
//   if (auto pair = room->choose(rng)) room->transfer(pair->from, pair->to, pixel);
//   Result<RoomViews> later = RoomViews::render_changed(7);   // and after months: other lamps, furniture, viewpoints, exposure
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

class RoomViews {
 public:
  static Result<RoomViews> render(int seed, int frames);
  /// Views along a flight, and the same places seen again under random changes.
  static Result<RoomViews> render_changed(int seed);

  struct Pair {
    std::size_t from = 0, to = 0;
  };
  const Image& image(std::size_t frame) const { return frames_[frame].image; }
  /// Two frames of which the second sees 15 to 95 % of what the first sees; nullopt when 200 random pairs contain none.
  std::optional<Pair> choose(Rng& rng) const;
  /// Position in frame `to` of the surface at a pixel of frame `from`; nullopt where it is not visible or there is no surface.
  std::optional<Vec2> transfer(std::size_t from, std::size_t to, const Vec2& px) const;

 private:
  struct Frame {
    Image image;
    std::vector<float> depth_m;
    Pose<W, C0> T_WC;
  };
  void add(const RenderedFrame& rendered, const Pose<W, B>& T_WB);
  double overlap(std::size_t from, std::size_t to) const;
  float depth_at(const Frame& frame, const Vec2& px) const;

  StereoRig rig_;
  std::vector<Frame> frames_;
};

}  // namespace fbvins

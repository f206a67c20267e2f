// SPDX-License-Identifier: Apache-2.0
// What is fixed in a camera's view: edges that stay at their pixels while the scene moves across them, and what lies between
// them. The doctor looks for it in a whole recording, LensWatch in the newest seconds of a flight. Buffers grow; one instance,
// one thread.
//
//   FixedEdges fixed(camera, {});
//   fixed.add({small_image, moved_px, turned_rad, 0});     // for each look
//   Image black_where_fixed = fixed.parts(fixed.edges());
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// Lengths and areas are in pixels of the small image.
struct FixedEdgeRule {
  int reduction = 2;  ///< pixels of the camera along one of the small image
  /// Motion across an edge after which another one lies there, pixels of the camera: of the scene, and by the rig's turn alone,
  /// which moves what is far away, or ahead, as well.
  float across_px = 8;
  int fewest_pairs = 20;  ///< of looks between which the scene moved across an edge, to say that it is fixed
  int around_px = 15;     ///< what pixels so near have in common is vignetting, and no edge
  int gap_px = 5, speck_px = 1,
      smallest_px = 80;     ///< gaps in a fixed thing that are filled, specks that are none, the smallest one
  int largest_hole_px = 0;  ///< what edges enclose up to this area is taken for a part of the thing
  int skirt_px = 1;         ///< the outer side of an edge, where the scene shows through the blur
};

/// Looks are compared with the one so many before: an odd number, so that of a rig that swings two different ones meet.
inline constexpr std::size_t kLooksApart = 3;
/// Of the image: less is nothing to tell, more is an image that does not move.
inline constexpr double kLeastFixedShare = 0.002, kMostFixedShare = 0.6;
/// What is found so near to an existing mask is the edge of the same thing, masked by hand a little too small.
inline constexpr double kBesideMask_px = 12;

/// A small image of the camera, and what happened since the one kLooksApart before; zero where that is not known.
struct Look {
  std::shared_ptr<const Image> image;
  Eigen::Vector2f moved_px = Eigen::Vector2f::Zero();    ///< the scene, pixels of the camera
  Eigen::Vector3f turned_rad = Eigen::Vector3f::Zero();  ///< the camera, in its frame
  float by_bias_rad = 0;                                 ///< of which so much may be the gyroscope's bias
};

class FixedEdges {
 public:
  FixedEdges(const Camera& camera, const FixedEdgeRule& rule) : camera_(camera), rule_(rule) {}

  /// Images are of one size. Where there are `most` already, the oldest goes.
  void add(Look look, std::size_t most = SIZE_MAX);
  std::size_t size() const { return looks_.size(); }
  /// The small image, black at edges that stay. With `before`, the result of earlier looks: an edge that was fixed is one until
  /// it is clearly gone, and where the scene did not move across it nothing new is said.
  Image edges(const Image* before = nullptr) const;
  /// Black where something fixed is: edges with what they enclose, without specks.
  Image parts(Image edges) const;

 private:
  enum class Verdict { fixed, not_fixed, unknown };
  void count(const Image& added, const Image* dropped);
  Verdict judge(int x, int y, const Eigen::Vector2f& shared, bool was_fixed) const;
  Verdict judge_each_look(int x, int y, const Eigen::Vector2f& mean, const Eigen::Vector2f& shared, float ease) const;
  Eigen::Matrix<float, 2, 3> motion_by_turn(int x, int y) const;

  Camera camera_;
  FixedEdgeRule rule_;
  int width_ = 0, height_ = 0;
  std::vector<Look> looks_;
  // Of eight times the gradients, row by row, and of their squares; the image's border has none.
  std::vector<std::int32_t> sums_x_, sums_y_, squares_;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// What is fixed in a camera's view: edges that stay at their pixels while the scene moves across them, and what lies between
// them, in the small images of a whole recording. Buffers grow; one instance, one thread.
//
//   FixedEdges fixed(camera);
//   fixed.add({small_image, moved_px, turned_rad, 0});     // for each look
//   Image black_where_fixed = fixed.parts(fixed.edges());
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// Pixels of the camera along one of the small image.
inline constexpr int kReduction = 2;
/// Motion across an edge after which another one lies there, pixels of the camera: of the scene, and by the rig's turn alone,
/// which moves what is far away, or ahead, as well.
inline constexpr float kAcross_px = 8;
/// Of looks between which the scene moved across an edge, to say that it is fixed.
inline constexpr int kFewestPairs = 20;
/// Looks are compared with the one so many before: an odd number, so that of a rig that swings two different ones meet.
inline constexpr std::size_t kLooksApart = 3;
/// A small image of the camera, and what happened since the one kLooksApart before; zero where that is not known.
struct Look {
  std::shared_ptr<const Image> image;
  Eigen::Vector2f moved_px = Eigen::Vector2f::Zero();    ///< the scene, pixels of the camera
  Eigen::Vector3f turned_rad = Eigen::Vector3f::Zero();  ///< the camera, in its frame
  float by_bias_rad = 0;                                 ///< of which so much may be the gyroscope's bias
};

class FixedEdges {
 public:
  explicit FixedEdges(const Camera& camera) : camera_(camera) {}

  /// Images are of one size.
  void add(Look look);
  /// The small image, black at edges that stay.
  Image edges() const;
  /// Black where something fixed is: edges with what they enclose, without specks.
  Image parts(Image edges) const;

 private:
  bool stays(int x, int y, const Eigen::Vector2f& shared) const;
  bool stays_in_each_look(int x, int y, const Eigen::Vector2f& mean, const Eigen::Vector2f& shared) const;
  Eigen::Matrix<float, 2, 3> motion_by_turn(int x, int y) const;

  Camera camera_;
  int width_ = 0, height_ = 0;
  std::vector<Look> looks_;
  // Of eight times the gradients, row by row, and of their squares; the image's border has none.
  std::vector<std::int32_t> sums_x_, sums_y_, squares_;
};

}  // namespace fbvins

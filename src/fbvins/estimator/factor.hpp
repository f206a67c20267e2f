// SPDX-License-Identifier: Apache-2.0
// What a window estimates and what it measures, apart from landmarks: variables, and the factors of the cost over them
// (docs/architecture.md, "How do I add a factor?").
//
// One more factor is one file with a class like this one, its entry in factor_makers.cpp, and one test (factor_test.hpp):
//
//   class Wind : public Factor { ... };
//   frame.factors.push_back({order, std::make_shared<const Wind>(frame.id, reading)});
//
// A factor is a value that is never modified: window problems share it.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct WindowProblem;
struct NormalEquations;

/// A variable of the window, by what it is, not by its place: that changes as frames come and go.
struct Variable {
  enum class Kind {
    pose,         ///< of a frame: dp in G, dtheta in B
    motion,       ///< of a frame: velocity in G, biases of gyroscope and accelerometer
    tilt,         ///< of gravity in G
    calibration,  ///< of the cameras
    own,          ///< what factors bring along (OwnVariable)
  };
  Kind kind = Kind::pose;
  FrameId frame = {};  ///< of pose and motion
  int own = -1;        ///< the number of one of the factors' own

  static Variable pose_of(FrameId frame) { return {Kind::pose, frame}; }
  static Variable motion_of(FrameId frame) { return {Kind::motion, frame}; }
  static Variable tilt_of_gravity() { return {Kind::tilt}; }
  static Variable own_one(int number) { return {Kind::own, {}, number}; }
  bool is_of_frame() const { return kind == Kind::pose || kind == Kind::motion; }
  bool operator==(const Variable&) const = default;
};

/// A frame that is dropped and whose measurements its successor may take over.
struct DroppedFrame {
  FrameId frame, successor;
  Pose<B, B> T_successor_dropped;                                 ///< as estimated
  Vec3 v_dropped_B = Vec3::Zero(), v_successor_B = Vec3::Zero();  ///< likewise, each in its own axes
};

class Factor {
 public:
  virtual ~Factor() = default;
  /// Of its kind, the same string for all of one.
  virtual std::string_view name() const = 0;
  /// What it depends on. It goes into the prior with the first frame of these that is marginalised, and its derivatives are in
  /// these rows alone.
  virtual std::vector<Variable> variables() const = 0;
  /// At the window's estimate.
  virtual double cost(const WindowProblem& window) const = 0;
  /// The same, and adds gradient and information. Derivatives are taken at WindowProblem::linearisation_point().
  virtual double linearise(const WindowProblem& window, NormalEquations& out) const = 0;
  /// What is left of it when one of its frames is dropped without being marginalised: one that the successor has instead, or
  /// nothing.
  virtual std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const = 0;

  bool touches(FrameId frame) const;
};

/// A factor that a frame has brought, and its place in the order in which kinds are added up.
struct FrameFactor {
  int order = 0;
  std::shared_ptr<const Factor> factor;
};

}  // namespace fbvins

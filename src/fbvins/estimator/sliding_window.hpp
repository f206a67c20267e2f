// SPDX-License-Identifier: Apache-2.0
// Who is in the sliding window: keyframes, the newest frames beside them, and the landmarks they see
// (paper 2.1.2). Keeps the books; the numbers are WindowProblem's.
//
// frames: [ keyframes ... | newest_frames ... ], oldest first. One owner, one thread.
#pragma once

#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/known_landmarks.hpp"
#include "fbvins/estimator/window_marginalisation.hpp"
#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// A frame of the window. `imu` joins it to the frame before it in the window.
struct Frame {
  FrameId id;
  Time t;
  NavState state;
  NavState first_estimate;
  bool in_prior = false;
  bool keyframe = false;
  bool standstill = false;
  std::optional<Preintegration> imu;
  StereoFrame images;  ///< of keyframes, until they have been handed on
};

/// A landmark seen from one frame.
struct Sighting {
  FrameId frame;
  Observation left;
  std::optional<Observation> right;
  Vec2 left_velocity = Vec2::Zero();  ///< of the normalised position, 1/s
  Vec2 right_velocity = Vec2::Zero();
};

/// A track and, once triangulated, the point it shows.
struct Landmark {
  LandmarkId id;
  TrackId track;
  FrameId host;
  Vec3 alpha_beta_rho = Vec3::Zero();
  bool triangulated = false;
  std::optional<LandmarkBelief> belief;  ///< of one that was known before
  int strikes = 0;                       ///< times an observation of it was thrown out
  std::vector<Sighting> sightings;       ///< oldest first
};

class SlidingWindow {
 public:
  explicit SlidingWindow(const EstimatorOptions& options) : options_(options), known_(options.known_landmarks) {}

  void clear();
  const std::vector<Frame>& frames() const { return frames_; }
  std::vector<Frame>& frames() { return frames_; }
  const std::vector<Landmark>& landmarks() const { return landmarks_; }
  const Frame& newest() const { return frames_.back(); }
  Frame& newest() { return frames_.back(); }
  const Tilt& tilt() const { return tilt_; }
  /// Level is turned about this point from now on.
  void set_pivot(const Vec3& p_W) { tilt_.pivot_W = p_W; }
  const WindowPrior& prior() const { return prior_; }
  void set_prior(WindowPrior prior);
  /// Moves the linearisation point of the prior to the present states; what it believes stays. Only
  /// while it is linear by nature: the belief about the first frame, not yet the memory of measurements.
  void restart_first_estimates();

  /// Appends a frame and files the sightings of its features; triangulates what can be.
  void add_frame(Frame frame, const std::vector<TrackedFeature>& features, const Calibration& calibration);

  /// Fills `problem` with the window; landmarks() indices of the chosen ones in landmark_of_problem().
  void build(WindowProblem& problem, const Calibration& calibration, const WindowWeights& weights);
  /// Takes the solution back.
  void accept(const WindowProblem& problem);
  /// Landmarks far from where they are believed to be are others, or have been moved: they count as new ones. Returns how many.
  int refuse_beliefs(const WindowProblem& problem);
  /// Removes observations far off after a solve, and landmarks that are left with too little.
  int remove_outliers(const WindowProblem& problem, double threshold_sigma);

  /// A frame that is not a keyframe leaves: its IMU readings join those of the next frame.
  void drop_frame(int index, WindowProblem& problem, const Calibration& calibration, const WindowWeights& weights);
  /// A keyframe leaves through marginalisation, with the landmarks it hosts; they are known from now on.
  void marginalise_keyframe(int index, WindowProblem& problem, const Calibration& calibration, const WindowWeights& weights);

  /// Triangulated landmarks seen in the newest frame.
  int landmarks_in_view() const;
  /// Share of the newest frame's features that the last keyframe saw, and the median rotation-free
  /// motion of these in px of a camera with this focal length.
  struct KeyframeDistance {
    double shared_ratio = 0;
    double parallax_px = 0;
    Duration age;
  };
  KeyframeDistance distance_to_last_keyframe(const Calibration& calibration, double focal_px) const;
  /// Levelled, as is what follows.
  WindowSnapshot snapshot(const Calibration& calibration) const;
  /// The frame as a keyframe for loop closure, with what it sees; its images move out.
  Keyframe take_keyframe(int index, const Calibration& calibration);

  int index_of(FrameId id) const;
  /// Landmarks that have left the window.
  KnownLandmarks& known() { return known_; }
  /// Whether landmarks that leave are remembered: worth it only where they are seen again.
  void remember_landmarks(bool on) { remembers_ = on; }
  bool remembers_landmarks() const { return remembers_; }

 private:
  static constexpr int kStrikesUntilBanned = 3;
  Landmark& landmark_of(TrackId track);
  void set_velocities(Sighting& before, Sighting& now) const;
  bool triangulate(Landmark& landmark, const Calibration& calibration) const;
  void refuse_distant_belief(Landmark& landmark, const Calibration& calibration);
  void disbelieve(Landmark& landmark);
  void rehost(Landmark& landmark, FrameId new_host, const Calibration& calibration) const;
  void forget_sightings(FrameId frame, const Calibration& calibration);
  void forget_frame(int index);
  void remember_leaving(const WindowProblem& problem, const std::vector<std::uint8_t>& leaves, const Calibration& calibration);
  void remove_flagged(const std::vector<std::uint8_t>& remove);
  Vec3 scaled_point_in_camera(const Landmark& landmark, const Frame& target, const Calibration& calibration) const;

  EstimatorOptions options_;
  std::vector<Frame> frames_;
  std::vector<Landmark> landmarks_;
  std::unordered_map<TrackId, int> landmark_of_track_;
  std::map<TrackId, int> banned_;  ///< tracks that proved wrong, with their strikes
  std::vector<int> landmark_of_problem_;
  KnownLandmarks known_;
  bool remembers_ = false;
  WindowPrior prior_;
  Tilt tilt_;
  std::int64_t next_landmark_ = 0;
  WindowProblem marginalisation_problem_, marginalisation_scratch_;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// Whether cameras and IMU agree. Each image is compared with the prediction by the readings: by each camera, and by the pose that
// the images alone give. Where they contradict each other, the rest decides who is right, and the wrong
// one counts less, or not at all (docs/derivations/integrity.md). It decides what a measurement is worth; the window estimates.
//
//   const ConsistencyMonitor::Verdict verdict = monitor.check(landmark_observations(window, features, calibration), calibration,
//   predicted, dt); if (verdict.imu_contradicts) use(*verdict.seen); covariance += monitor.doubt(T_GB);
//
// One owner, one thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/estimator/accumulated_doubt.hpp"
#include "fbvins/estimator/pose_refinement.hpp"
#include "fbvins/estimator/tilt_check.hpp"
#include "fbvins/estimator/window_turns.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class ConsistencyMonitor {
 public:
  struct Verdict {
    bool imu_contradicts = false;    ///< images agree with one another, but not with the readings
    std::uint8_t wrong = 0;          ///< these cameras, bits as in Health::without_cameras, alone contradict the readings
    std::optional<Pose<G, B>> seen;  ///< by the images alone, where the readings are contradicted
    ImuNoiseScale noise;             ///< with which the readings count
  };

  /// `calibrating`: mounting or time offset are still being found, which contradict the readings, too.
  ConsistencyMonitor(const ImuNoise& assumed, bool calibrating);

  /// A window begins.
  void restart();
  /// `observations`: landmarks of the window seen in the new image; `predicted`: by the readings of `dt` since the image before,
  /// with the velocity `v_B`, which counts where not all was seen at the stamp.
  Verdict check(const std::vector<LandmarkObservation>& observations, const Calibration& calibration, const Pose<G, B>& predicted,
                Duration dt, const Vec3& v_B = Vec3::Zero());
  /// Of the next prediction, standard deviations: what all residuals of an image may have in common.
  struct Uncertainty {
    double stamp_s = 0;       ///< when an image was taken
    double velocity_mps = 0;  ///< of the image before
    ImuNoiseScale noise;      ///< of the readings since
  };
  void expect(const Uncertainty& prediction) { expected_ = prediction; }
  /// The images go on alone, without readings to compare with.
  void pass(Duration dt);

  /// The readings are cut at other times than before: biases take up the difference.
  void forget_biases() { tilt_.forget_biases(); }
  /// After each solve: the biases are where a wrong tilt shows, and faults of the IMU that begin without a contradiction.
  void take(const BiasEstimate& biases);
  /// And the turns of the window. `now`: its newest pose, `dt` after the one before.
  void take(const WindowTurns& turns, const Pose<G, B>& now, Duration dt);

  /// A contradiction was seen within the last half second, or nothing explains the images, or gravity has not confirmed the
  /// attitude since.
  bool contradicted() const { return contradicted_ || tilt_.in_doubt() || unexplained_; }
  /// The accelerometer's bias moves farther than is usual (TiltCheck::suspected).
  bool bias_suspected() const { return tilt_.suspected(); }
  /// The images are right against the readings, as far as is known.
  bool follows_images() const { return contradicted_; }
  /// The newest image is a contradiction, and not only one within the last half second.
  bool contradicts_now() const { return contradicted_ && calm_s_ == 0; }
  /// A contradiction is over that leaves too large a doubt about position and heading for a pose called good. True once.
  bool take_reset();
  /// W is a new one. A second time within a few seconds is unrecoverable.
  void count_reset();
  /// Gravity has to confirm the tilt.
  void doubt_tilt() { tilt_.doubt(); }
  /// After darkness: the velocity is being found again.
  bool settling() const { return settling_ > 0; }
  /// The estimate is wrong, and will not recover by itself: gravity does not fit the attitude, or contradictions go on.
  bool unrecoverable() const { return unrecoverable_; }
  /// Covariance of (dp in G [m], dtheta in B [rad]) that contradictions since the last reset leave at this pose.
  Mat6 doubt(const Pose<G, B>& T_GB) const { return doubt_.covariance(T_GB); }
  /// And of this velocity, in G.
  Mat3 velocity_doubt(const Vec3& v_GB) const { return doubt_.velocity_covariance(v_GB); }

 private:
  using OfEachCamera = std::array<Vec2, kMostCameras>;
  void blind(Duration dt);
  void take_agreement(double excess, Duration dt);
  void take_unexplained(Duration dt);
  bool exclude(bool for_drift_alone, Duration dt);
  void learn(const OfEachCamera& shift, double patience, Duration dt);
  double spread(const Quat& predicted, const Vec3& v_B, double focal, Duration dt) const;
  void follow(const Pose<G, B>& seen, const Pose<G, B>& predicted, Duration dt, Verdict& out);
  void add_drift(const OfEachCamera& shift, double focal, const Quat& predicted, double patience, Duration dt);
  double largest_drift() const;
  static OfEachCamera none() {
    OfEachCamera zero;
    zero.fill(Vec2::Zero());
    return zero;
  }
  void take_doubt(const Pose<G, B>& predicted, const Vec3& turn_B, const Vec3& shift_G);

  ImuNoise assumed_;
  bool calibrating_;
  Uncertainty expected_;
  double usual_shift_, learned_s_ = 0;  ///< of this rig's images, in standard deviations of a feature, and over which time
  double excluded_s_ = 0;               ///< for how long one camera has been excluded for drift alone
  OfEachCamera drift_ = none();         ///< of all that is seen, added up
  double turned_sigma_ = 0;             ///< by which it may be
  double lasting_s_ = 0;                ///< cumulative sum of what it is more than usual
  double since_sudden_s_ = 1e9;         ///< since a drift that was a contradiction at once
  Quat predicted_ = Quat::Identity();
  double evidence_ = 0;              ///< cumulative sum (CUSUM)
  double calm_s_ = 0, blind_s_ = 0;  ///< without a contradiction, and without images to compare
  double unexplained_s_ = 0;         ///< for how long images were in contradiction with everything, less those that agreed since
  bool unexplained_ = false;
  bool contradicted_ = false, unrecoverable_ = false;
  AccumulatedDoubt doubt_;  ///< since the last reset
  TiltCheck tilt_;
  Vec3 ahead_G_ = Vec3::Zero();                     ///< from the pose to the middle of what is in view
  double turning_noise_ = 1;                        ///< of the gyroscope, while the window turns in another way than it
  bool turns_contradict_ = false;                   ///< and that is more than a suspicion
  bool may_be_away_ = false, turned_away_ = false;  ///< the pose may have moved, and has, since the last reset
  int settling_ = 0;                                ///< images after darkness that are not judged
  double since_reset_s_ = 1e9;
};

}  // namespace fbvins

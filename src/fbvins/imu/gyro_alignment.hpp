// SPDX-License-Identifier: Apache-2.0
// What the gyroscope and the directions of tracks say of one another, without depth, scale or a start: the camera's time offset,
// the line delay of its shutter, the rotation of its mounting and the gyroscope's bias (docs/derivations/gyro_alignment.md,
// Y1-Y6).
//
//   GyroAlignment alignment(rig.T_BC0().R(), {});
//   alignment.add(frame);                                   // each tracked frame
//   if (const auto found = alignment.solve()) use(found->time_offset_s, found->time_offset_sigma_s());
//
// One owner, one thread. Memory: the newest pairs of images of at most 40 tracks, and their readings.
#pragma once

#include <cmath>
#include <deque>
#include <optional>
#include <vector>

#include "fbvins/imu/gyro_turns.hpp"
#include "fbvins/imu/stamp_noise.hpp"
#include "fbvins/imu/turn_by_tracks.hpp"
#include "fbvins/types/imu_state.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Standard deviations before any measurement.
struct GyroAlignmentPrior {
  double gyro_bias_radps = 0.1;  ///< as of an unknown IMU (initial_prior.cpp)
  double time_offset_s = 0.05;   ///< of what is given: cameras behind a driver's buffers are late by up to a tenth of a second
  double line_delay_s = 40e-6;   ///< the common sensors take 10 to 100 us a row
  double rotation_rad = 0.02;    ///< of a mounting by its drawing
  std::optional<TimeOffsetEstimate> known_offset = {};  ///< instead, until it is contradicted
};

/// Corrections of what the rig says.
struct GyroAlignmentEstimate {
  static constexpr int kSize = 8;
  using Vec = Eigen::Matrix<double, kSize, 1>;
  using Mat = Eigen::Matrix<double, kSize, kSize>;

  Vec x = Vec::Zero();
  Mat covariance = Mat::Zero();
  std::vector<LateImage> late;  ///< in the order of their images
  double stamp_sigma_s = 0;     ///< noise of each image's stamp, 0 where it does not show
  double rms = 0;               ///< of the residuals, in standard deviations of a track
  int pairs = 0;

  Vec3 gyro_bias_radps() const { return x.head<3>(); }
  double time_offset_s() const { return x(3); }  ///< t_imu = t_image + the rig's offset + this
  double line_delay_s() const { return x(4); }
  Vec3 rotation_rad() const { return x.tail<3>(); }  ///< R_BC = exp(rotation) R_BC of the rig
  double time_offset_sigma_s() const { return std::sqrt(covariance(3, 3)); }
  double line_delay_sigma_s() const { return std::sqrt(covariance(4, 4)); }
};

class GyroAlignment {
 public:
  /// The largest offset, in both directions, that is looked for.
  static constexpr double kLargestOffset_s = 0.1;
  /// The newest ones are kept: 7.5 s at 20 Hz.
  static constexpr std::size_t kMostPairs = 150;

  /// `line_delay_s`: the rig's; what is found is in addition to it.
  GyroAlignment(const Mat3& R_BC, double middle_row_px, double line_delay_s, const GyroAlignmentPrior& prior,
                std::size_t most_pairs = kMostPairs)
      : R_BC_(R_BC), middle_row_px_(middle_row_px), line_delay_s_(line_delay_s), prior_(prior), most_pairs_(most_pairs) {}

  /// A frame with the readings since the one before. `given`: the rig's time offset; the segment says with which it was cut.
  void add(const TrackedFrame& frame, Duration given);
  /// Nothing before any pair of images has its readings.
  std::optional<GyroAlignmentEstimate> solve();
  /// Of images, that are compared.
  int pairs() const { return static_cast<int>(pairs_.size()); }

 private:
  struct Sight {
    TrackId id;
    Vec3 ray_B;
    double sigma, rows;
  };
  struct View {
    Time t;  ///< on the IMU's clock, by the rig's offset
    std::vector<Sight> sights;
  };
  struct Pair {
    Time from, to;
    std::vector<SeenTwice> tracks;
  };
  /// A pair's tracks, compared with one turn: what they say of turns that differ little follows without them.
  struct Compared {
    bool yet = false;
    PredictedTurnOfPair turn;
    TurnError error;
  };
  struct Normal {
    GyroAlignmentEstimate::Mat H = GyroAlignmentEstimate::Mat::Zero();
    GyroAlignmentEstimate::Vec g = GyroAlignmentEstimate::Vec::Zero();
    double cost = 0;
    double rows = 0;
    int compared = 0;  ///< pairs whose tracks had to be
  };
  struct Turned;

  void forget();
  View view_of(const TrackedFrame& frame, Time t) const;
  void make_pairs();
  void add_pair(const View& a, const View& b);
  Turned turned(const Pair& pair, const GyroAlignmentEstimate::Vec& x) const;
  Normal linearise(const GyroAlignmentEstimate::Vec& x, std::deque<Compared>& compared) const;
  double difference_sigmas(const Pair& pair, const Compared& compared, const Turned& now) const;
  GyroAlignmentEstimate solve_from(const GyroAlignmentEstimate::Vec& x, std::deque<Compared>& compared) const;
  bool contradicts_known(const GyroAlignmentEstimate& found) const;
  void search(GyroAlignmentEstimate& best);
  std::vector<LateImage> late_images(const GyroAlignmentEstimate::Vec& x) const;

  Mat3 R_BC_;
  double middle_row_px_, line_delay_s_;
  GyroAlignmentPrior prior_;
  std::size_t most_pairs_;
  std::deque<View> views_;  ///< whose pairs are not made yet, and those before that they are compared with
  std::size_t paired_ = 0;  ///< of these
  std::deque<Pair> pairs_;
  std::deque<Compared> compared_;  ///< each pair near the last solution
  GyroTurns turns_;
  GyroAlignmentEstimate::Vec last_ = GyroAlignmentEstimate::Vec::Zero();
  bool settled_ = false;
  std::size_t searched_ = 0;  ///< with so many pairs
};

}  // namespace fbvins

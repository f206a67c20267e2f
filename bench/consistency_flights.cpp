// SPDX-License-Identifier: Apache-2.0
// Runs the estimator alone, on synthetic tracks (synthetic_tracks.hpp) along real or simulated trajectories with real or
// simulated IMU readings, and prints its errors and its NEES.
//
//   consistency_flights --trajectory V1_02/groundtruth.csv --imu V1_02/imu0.csv --start 10 --seconds 60 --recognise
//   consistency_flights normal --seed 4 --movers 8
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "bench/synthetic_tracks.hpp"
#include "fbvins/estimator/estimator.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/eval/nees.hpp"

namespace fbvins::bench {
namespace {

struct Wanted {
  std::string preset = "normal";
  SimulationOptions simulation;
  TrackOptions tracks;
  bool known = true;
  double accel_noise_scale = EstimatorOptions{}.accel_noise_scale;
};

const TrueState& truth_at(const Simulation& s, Time t) {
  const auto it =
      std::lower_bound(s.imu.truth.begin(), s.imu.truth.end() - 1, t, [](const TrueState& x, Time y) { return x.t < y; });
  return *it;
}

double squared(const Vec3& e, const Mat3& P) { return e.dot(P.ldlt().solve(e)); }

/// Compares estimates with the truth, pose by pose.
class Comparison {
 public:
  explicit Comparison(const Simulation& flight) : flight_(flight) {}

  void take(const Odometry& o) {
    known_ += o.stats.known_landmarks;
    ms_ += o.stats.total_ms();
    resets_ = o.reset_counter;
    if (!o.health.has_pose()) return;
    truth_.push_back({o.t, true_pose(o.t)});
    estimate_.push_back({o.t, o.T_WB});
    covariances_.push_back(o.pose_covariance);
    const ImuBias& bias = truth_at(flight_, o.t).bias;
    gyro_bias_ += squared(o.bias.gyro_radps - bias.gyro_radps, o.gyro_bias_covariance);
    accel_bias_ += squared(o.bias.accel_mps2 - bias.accel_mps2, o.accel_bias_covariance);
  }

  /// One line: errors after SE3 alignment, NEES with the truth levelled, means over the poses.
  Result<std::string> summary() const {
    const std::vector<PosePair> pairs = associate(truth_, estimate_, {});
    const Result<Similarity> se3 = align(pairs, Alignment::se3);
    if (!se3) return se3.error();
    const Result<LevelledStart> start = align_start_levelled(pairs);
    if (!start) return start.error();
    const ErrorStatistics errors = statistics_of(absolute_errors_m(apply(*se3, pairs)));
    const NeesSummary nees_levelled = nees(pairs, covariances_, start->to_truth);
    const auto n = static_cast<double>(pairs.size());
    return fmt::format("rmse {:.4f} max {:.4f} nees {:.1f} {:.1f} bias {:.1f} {:.1f} known {:.1f} ms {:.2f} resets {}",
                       errors.rmse, errors.max, nees_levelled.mean.position, nees_levelled.mean.orientation, gyro_bias_ / n,
                       accel_bias_ / n, known_ / n, ms_ / n, resets_);
  }

 private:
  Pose<W, B> true_pose(Time t) const { return flight_.flight.pose((t - flight_.start).seconds()); }

  const Simulation& flight_;
  Trajectory<W> truth_, estimate_;
  std::vector<Mat6> covariances_;
  double gyro_bias_ = 0, accel_bias_ = 0;  // sums of normalised errors squared
  double known_ = 0, ms_ = 0;
  std::uint32_t resets_ = 0;
};

int fly(const Wanted& wanted) {
  const Result<Simulation> flight = prepare_simulation(wanted.simulation);
  if (!flight) {
    fmt::print(stderr, "{}\n", flight.error().message);
    return 1;
  }
  SyntheticTracks tracks(*flight, wanted.tracks);
  EstimatorOptions options;
  options.known_landmarks.enabled = wanted.known;
  options.accel_noise_scale = wanted.accel_noise_scale;
  Estimator estimator(flight->rig, options);
  Comparison comparison(*flight);
  StatePrior before, prior;
  for (std::size_t k = 0; k < flight->frames.size(); ++k) {
    const Estimate e = estimator.process(tracks.frame(k, before));
    before = prior;  // two images late, as in a System
    prior = estimator.prior();
    tracks.locate(e.landmarks);
    comparison.take(e.odometry);
  }
  const Result<std::string> summary = comparison.summary();
  fmt::print(summary ? stdout : stderr, "{}\n", summary ? *summary : summary.error().message);
  return summary ? 0 : 1;
}

int run(int argc, char** argv) {
  CLI::App app("run the estimator on synthetic tracks");
  Wanted w;
  double seconds = 30, start = 0;
  int seed = 1;
  std::string trajectory, imu;
  app.add_option("preset", w.preset, "preset of fbvins simulate");
  app.add_option("--trajectory", trajectory, "trajectory of a real flight, instead of a simulated one");
  app.add_option("--imu", imu, "with --trajectory: its IMU readings");
  app.add_option("--start", start, "with --trajectory: where to begin, s");
  app.add_option("--seconds", seconds, "length, s");
  app.add_option("--seed", seed, "of room, tracks and noise");
  app.add_option("--movers", w.tracks.movers, "number of moving boxes");
  app.add_option("--bad-start", w.tracks.bad_start_s, "seconds at the start with bad tracks");
  app.add_flag("--recognise", w.tracks.recognise, "corners that come back into view are re-observed");
  app.add_flag("!--forget", w.known, "landmarks that leave the window are not kept");
  app.add_option("--accel-noise-scale", w.accel_noise_scale, "assumed noise of the accelerometer, times that of the calibration");
  CLI11_PARSE(app, argc, argv);
  const auto preset = simulation_preset(w.preset);
  if (!preset) {
    fmt::print(stderr, "{}\n", preset.error().message);
    return 2;
  }
  w.simulation = *preset;
  w.simulation.seed = seed;
  w.simulation.flight.duration_s = seconds;
  w.simulation.recorded.trajectory = trajectory;
  w.simulation.recorded.imu = imu;
  w.simulation.recorded.start_s = start;
  w.tracks.seed = static_cast<std::uint64_t>(seed);
  return fly(w);
}

}  // namespace
}  // namespace fbvins::bench

int main(int argc, char** argv) { return fbvins::bench::run(argc, argv); }

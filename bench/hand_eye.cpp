// SPDX-License-Identifier: Apache-2.0
// How accurately lever arm, rotation and clock offset of motion capture are found from a minute of flight: twenty synthetic
// recordings with gaps, another body and a flip in each, against exact truth; and the errors to expect by their covariances.
//
//   hand_eye lively | gentle                     synthetic flights and odometry errors (hand_eye_scene.hpp)
//   hand_eye TRUTH ESTIMATE [ESTIMATE...]        minutes of real estimates, with markers computed from their ground truth
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "fbvins/io/trajectory.hpp"
#include "tests/support/hand_eye_scene.hpp"

using namespace fbvins;

namespace {

constexpr int kRecordings = 20;
constexpr double kMinute_s = 60, kLeverBar_mm = 2;

/// A minute of a ground truth, interpolated linearly between its poses.
class RecordedMinute {
 public:
  RecordedMinute(const Trajectory<W>& truth, Time start, double duration_s)
      : truth_(truth), start_(start), duration_s_(duration_s) {}
  double duration_s() const { return duration_s_; }
  Pose<W, B> at(double t) const {
    const Time when = start_ + Duration::from_seconds(t);
    const auto after =
        std::lower_bound(truth_.begin() + 1, truth_.end() - 1, when, [](const StampedPose<W>& a, Time b) { return a.t < b; });
    const StampedPose<W>& a = *std::prev(after);
    const double u = std::clamp((when - a.t).seconds() / (after->t - a.t).seconds(), 0.0, 1.0);
    return {a.T.q.slerp(u, after->T.q).normalized(), Vec3(a.T.p + u * (after->T.p - a.T.p))};
  }

 private:
  const Trajectory<W>& truth_;
  Time start_;
  double duration_s_;
};

class Table {
 public:
  Table() {
    fmt::print(
        "| recording | lever arm error [mm] | sigma | rotation error [deg] | sigma | clock error [ms] | sigma | NEES of 7 |\n|---|---|---|---|---|---|---|---|\n");
  }

  void add(const std::string& name, const test::MarkerRecording& recording, const Trajectory<W>& estimate) {
    const auto found = align_hand_eye(inspect(recording.track).kept(recording.track), estimate, {});
    if (!found) {
      ++refused_;
      fmt::print("| {} | {} |\n", name, found.error().message);
      return;
    }
    const Eigen::Matrix<double, 7, 1> e = test::error_of(found->calibration, recording.truth);
    const Eigen::Matrix<double, 7, 7> P = test::covariance_of(*found);
    const double nees = e.dot(P.llt().solve(e)), degrees = 180 / std::numbers::pi;
    const Vec3 sizes(1e3 * e.head<3>().norm(), degrees * e.segment<3>(3).norm(), 1e3 * std::abs(e(6)));
    fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.1f} |\n", name, sizes(0),
               1e3 * std::sqrt(P.topLeftCorner<3, 3>().trace()), sizes(1), degrees * std::sqrt(P.block<3, 3>(3, 3).trace()),
               sizes(2), 1e3 * std::sqrt(P(6, 6)), nees);
    worst_ = worst_.cwiseMax(sizes), squares_ += sizes.cwiseAbs2(), nees_ += nees, ++count_;
    within_ += sizes(0) <= kLeverBar_mm;
    lever_factors_.push_back(1e3 * Mat3(P.topLeftCorner<3, 3>().llt().matrixL()));
  }

  void finish() const {
    const Vec3 rms = (squares_ / count_).cwiseSqrt();
    fmt::print(
        "\n{} recordings, {} refused. RMS {:.2f} mm, {:.3f} deg, {:.3f} ms; worst {:.2f} mm, {:.3f} deg, {:.3f} ms; lever arm within 2 mm in {}; mean NEES {:.2f} of 7\n",
        count_, refused_, rms(0), rms(1), rms(2), worst_(0), worst_(1), worst_(2), within_, nees_ / count_);
    print_expected();
  }

 private:
  /// Errors of the lever arm sampled from the covariances: what the information in these recordings allows.
  void print_expected() const {
    constexpr int kTimes = 10000;
    Rng rng(1, 1);
    std::vector<double> worst_mm(kTimes, 0.0);
    double squares = 0;
    for (double& worst : worst_mm)
      for (const Mat3& factor : lever_factors_) {
        const double size = (factor * test::normal3(rng)).norm();
        worst = std::max(worst, size), squares += size * size;
      }
    std::sort(worst_mm.begin(), worst_mm.end());
    const auto within = std::upper_bound(worst_mm.begin(), worst_mm.end(), kLeverBar_mm) - worst_mm.begin();
    fmt::print(
        "lever arm as the covariances say: RMS {:.2f} mm, worst of {} in the median {:.2f} mm, all within {} mm {:.0f} times of 100\n",
        std::sqrt(squares / (kTimes * count_)), count_, worst_mm[kTimes / 2], kLeverBar_mm,
        100.0 * static_cast<double>(within) / kTimes);
  }

  std::vector<Mat3> lever_factors_;  ///< square roots of covariances, mm
  Vec3 worst_ = Vec3::Zero(), squares_ = Vec3::Zero();
  double nees_ = 0;
  int count_ = 0, refused_ = 0, within_ = 0;
};

void simulated(bool lively) {
  constexpr Time kStart{1'700'000'000'000'000'000};
  Table table;
  for (std::uint64_t seed = 1; seed <= kRecordings; ++seed) {
    const test::ExactFlight flight(seed, kMinute_s, lively);
    table.add(std::to_string(seed), test::record(flight, kStart, {}, seed), test::estimate_of(flight, kStart, {}, seed));
  }
  table.finish();
}

int recorded(const std::string& truth_path, char** paths, int count) {
  const auto truth = read_trajectory(truth_path);
  if (!truth) return fmt::print(stderr, "{}\n", truth.error().message), 2;
  const Trajectory<W> poses = truth->poses();
  Table table;
  for (int i = 0; i < kRecordings; ++i) {
    const std::string path = paths[i % count];
    const auto file = read_trajectory(path);
    if (!file) return fmt::print(stderr, "{}\n", file.error().message), 2;
    const Trajectory<W> estimate = file->poses();
    const double spare_s = std::max(0.0, (estimate.back().t - estimate.front().t).seconds() - kMinute_s);
    const Time start =
        estimate.front().t + Duration::from_seconds(spare_s * (i / count) / std::max(1, (kRecordings - 1) / count));
    Trajectory<W> minute;
    for (const StampedPose<W>& pose : estimate)
      if (pose.t >= start && (pose.t - start).seconds() <= kMinute_s) minute.push_back(pose);
    const RecordedMinute flight(poses, start, std::min(kMinute_s, (minute.back().t - start).seconds()));
    table.add(fmt::format("{}, from {:.0f} s", path, (start - estimate.front().t).seconds()),
              test::record(flight, start, {}, static_cast<std::uint64_t>(i) + 1), minute);
  }
  table.finish();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "lively" || first == "gentle") return simulated(first == "lively"), 0;
  if (argc > 2) return recorded(argv[1], argv + 2, argc - 2);
  fmt::print(stderr, "usage: hand_eye lively | gentle | TRUTH ESTIMATE...\n");
  return 2;
}

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/sliding_window.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

/// p_C = a + rho * b of a ray hosted in one frame, in some camera of another (W2, W3).
struct RayInCamera {
  Vec3 a, b;
};

RayInCamera ray_in_camera(const Vec2& ray, const PairGeometry& pair, const CameraGeometry& cameras, bool right) {
  const Vec3 direction_B = cameras.R_BC0 * Vec3(ray.x(), ray.y(), 1);
  const Mat3& R_CB = cameras.R_CB[right];
  return {R_CB * (pair.R_th * direction_B), R_CB * (pair.R_th * cameras.t_BC0 + pair.t_th - cameras.t_BC[right])};
}

}  // namespace

void SlidingWindow::clear() {
  frames_.clear();
  landmarks_.clear();
  landmark_of_track_.clear();
  banned_.clear();
  known_.clear();
  prior_ = {};
  tilt_ = {};
}

int SlidingWindow::index_of(FrameId id) const {
  const auto it = std::lower_bound(frames_.begin(), frames_.end(), id, [](const Frame& f, FrameId i) { return f.id < i; });
  return it != frames_.end() && it->id == id ? static_cast<int>(it - frames_.begin()) : -1;
}

void SlidingWindow::set_prior(WindowPrior prior) {
  prior_ = std::move(prior);
  assert(prior_.quadratic.size() == prior_.frames_row() + 15 * static_cast<int>(prior_.frames.size()));
  for (int i : prior_.frames) {
    if (frames_[i].in_prior) continue;
    frames_[i].in_prior = true;
    frames_[i].first_estimate = frames_[i].state;
  }
}

void SlidingWindow::restart_first_estimates() {
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(prior_.quadratic.size());
  int at = prior_.frames_row();
  for (int i : prior_.frames) {
    dx.segment<15>(at) = frames_[i].state.boxminus(frames_[i].first_estimate);
    frames_[i].first_estimate = frames_[i].state;
    at += 15;
  }
  prior_.quadratic = shifted(std::move(prior_.quadratic), dx);
}

Landmark& SlidingWindow::landmark_of(TrackId track) {
  const auto [it, is_new] = landmark_of_track_.try_emplace(track, static_cast<int>(landmarks_.size()));
  if (is_new) {
    Landmark landmark;
    landmark.id = LandmarkId{next_landmark_++};
    landmark.track = track;
    const auto banned = banned_.find(track);
    if (banned != banned_.end()) landmark.strikes = banned->second;
    landmark.belief = known_.find(track);
    landmarks_.push_back(std::move(landmark));
  }
  return landmarks_[it->second];
}

void SlidingWindow::add_frame(Frame frame, const std::vector<TrackedFeature>& features, const Calibration& calibration) {
  frames_.push_back(std::move(frame));
  for (const TrackedFeature& feature : features) {
    const auto banned = banned_.find(feature.id);
    if (banned != banned_.end() && banned->second >= kStrikesUntilBanned) continue;
    Landmark& landmark = landmark_of(feature.id);
    Sighting sighting{frames_.back().id, feature.left, feature.right, Vec2::Zero(), Vec2::Zero()};
    if (!landmark.sightings.empty()) set_velocities(landmark.sightings.back(), sighting);
    if (landmark.sightings.empty()) landmark.host = frames_.back().id;
    landmark.sightings.push_back(sighting);
    if (landmark.triangulated) continue;
    landmark.triangulated = triangulate(landmark, calibration);
    if (landmark.triangulated && landmark.belief) refuse_distant_belief(landmark, calibration);
  }
}

void SlidingWindow::set_velocities(Sighting& before, Sighting& now) const {
  constexpr double kLongestGap_s = 0.25;  // over a longer one the difference says little of the moment
  const double dt = (frames_.back().t - frames_[index_of(before.frame)].t).seconds();
  if (dt <= 0 || dt > kLongestGap_s) return;
  now.left_velocity = (now.left.normalised - before.left.normalised) / dt;
  now.right_velocity =
      now.right && before.right ? Vec2((now.right->normalised - before.right->normalised) / dt) : now.left_velocity;
  // Of the sighting before, the difference on its other side is known only now: their mean is good to second order.
  const double share = before.left_velocity.isZero(0) ? 1.0 : 0.5;
  before.left_velocity += share * (now.left_velocity - before.left_velocity);
  before.right_velocity += share * (now.right_velocity - before.right_velocity);
}

bool SlidingWindow::triangulate(Landmark& landmark, const Calibration& calibration) const {
  // Linear in rho: (a + rho b) is parallel to (z, 1) for every observation (W4).
  const CameraGeometry cameras(calibration);
  const int host = index_of(landmark.host);
  const Vec2 ray = landmark.sightings.front().left.normalised;
  double numerator = 0, information = 0;
  const auto each = [&](auto&& visit) {
    for (const Sighting& s : landmark.sightings) {
      PairGeometry pair;
      pair.set(frames_[host].state.T_WB, frames_[index_of(s.frame)].state.T_WB);
      if (s.frame != landmark.host) visit(ray_in_camera(ray, pair, cameras, false), s.left);
      if (s.right) visit(ray_in_camera(ray, pair, cameras, true), *s.right);
    }
  };
  each([&](const RayInCamera& line, const Observation& o) {
    const Vec2 u = o.sqrt_information * (line.a.head<2>() - line.a.z() * o.normalised);
    const Vec2 w = o.sqrt_information * (line.b.head<2>() - line.b.z() * o.normalised);
    numerator -= u.dot(w);
    information += w.squaredNorm();
  });
  constexpr double kMaxSigma_1pm = 0.15;  // an inverse depth known worse than this is not worth starting with
  if (information < 1.0 / (kMaxSigma_1pm * kMaxSigma_1pm)) return false;
  const double sigma = 1.0 / std::sqrt(information);
  double rho = numerator / information;
  if (rho < -2 * sigma || rho > 1.0 / options_.min_depth_m) return false;
  rho = std::max(rho, 1.0 / options_.max_depth_m);
  double worst = 0;
  each([&](const RayInCamera& line, const Observation& o) {
    const Vec3 p = line.a + rho * line.b;
    if (p.z() < kMinScaledDepth) worst = 1e9;
    else worst = std::max(worst, (o.sqrt_information * (p.head<2>() / p.z() - o.normalised)).squaredNorm());
  });
  if (worst > 6.0 * 6.0) return false;
  landmark.alpha_beta_rho << ray, rho;
  return true;
}

Vec3 SlidingWindow::scaled_point_in_camera(const Landmark& landmark, const Frame& target, const Calibration& calibration) const {
  const CameraGeometry cameras(calibration);
  PairGeometry pair;
  pair.set(frames_[index_of(landmark.host)].state.T_WB, target.state.T_WB);
  const RayInCamera line = ray_in_camera(landmark.alpha_beta_rho.head<2>(), pair, cameras, false);
  return line.a + landmark.alpha_beta_rho.z() * line.b;
}

void SlidingWindow::rehost(Landmark& landmark, FrameId new_host, const Calibration& calibration) const {
  if (landmark.triangulated) {
    const Vec3 p = scaled_point_in_camera(landmark, frames_[index_of(new_host)], calibration);
    if (p.z() < kMinScaledDepth) landmark.triangulated = false;
    else landmark.alpha_beta_rho = Vec3(p.x(), p.y(), landmark.alpha_beta_rho.z()) / p.z();
  }
  landmark.host = new_host;
}

void SlidingWindow::build(WindowProblem& problem, const Calibration& calibration, const WindowWeights& weights) {
  problem.frames.clear();
  for (const Frame& f : frames_)
    problem.frames.push_back({f.state, f.first_estimate, f.in_prior, f.imu ? &*f.imu : nullptr, f.standstill});
  problem.tilt = tilt_;
  problem.calibration = calibration;
  problem.weights = weights;
  problem.prior = prior_;
  problem.landmarks.clear();
  problem.observations.clear();
  problem.beliefs.clear();

  // Landmarks seen by most frames first, when there are too many; filed order among equals.
  landmark_of_problem_.clear();
  for (std::size_t i = 0; i < landmarks_.size(); ++i)
    if (landmarks_[i].triangulated && landmarks_[i].sightings.size() >= 2) landmark_of_problem_.push_back(static_cast<int>(i));
  if (static_cast<int>(landmark_of_problem_.size()) > options_.max_landmarks) {
    std::stable_sort(landmark_of_problem_.begin(), landmark_of_problem_.end(),
                     [&](int a, int b) { return landmarks_[a].sightings.size() > landmarks_[b].sightings.size(); });
    landmark_of_problem_.resize(options_.max_landmarks);
    std::sort(landmark_of_problem_.begin(), landmark_of_problem_.end());
  }
  for (int i : landmark_of_problem_) {
    const Landmark& landmark = landmarks_[i];
    WindowLandmark out;
    out.host = index_of(landmark.host);
    out.alpha_beta_rho = landmark.alpha_beta_rho;
    out.first_observation = static_cast<int>(problem.observations.size());
    for (const Sighting& s : landmark.sightings) {
      const int frame = index_of(s.frame);
      problem.observations.push_back({frame, false, s.left.normalised, s.left_velocity, s.left.sqrt_information});
      if (s.right)
        problem.observations.push_back({frame, true, s.right->normalised, s.right_velocity, s.right->sqrt_information});
    }
    out.observation_count = static_cast<int>(problem.observations.size()) - out.first_observation;
    if (landmark.belief) {
      out.belief = static_cast<int>(problem.beliefs.size());
      problem.beliefs.push_back(*landmark.belief);
    }
    problem.landmarks.push_back(out);
  }
}

void SlidingWindow::accept(const WindowProblem& problem) {
  tilt_ = problem.tilt;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    frames_[i].state = problem.frames[i].state;
    if (frames_[i].imu && frames_[i].imu->needs_repropagation(frames_[i - 1].state.bias))
      frames_[i].imu->repropagate(frames_[i - 1].state.bias);
  }
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i)
    landmarks_[landmark_of_problem_[i]].alpha_beta_rho = problem.landmarks[i].alpha_beta_rho;
}

void SlidingWindow::forget_sightings(FrameId frame, const Calibration& calibration) {
  std::vector<std::uint8_t> gone(landmarks_.size(), 0);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    Landmark& landmark = landmarks_[i];
    const auto it =
        std::find_if(landmark.sightings.begin(), landmark.sightings.end(), [&](const Sighting& s) { return s.frame == frame; });
    if (it == landmark.sightings.end()) continue;
    landmark.sightings.erase(it);
    if (landmark.sightings.empty()) gone[i] = 1;
    else if (landmark.host == frame) rehost(landmark, landmark.sightings.front().frame, calibration);
  }
  remove_flagged(gone);
}

void SlidingWindow::forget_frame(int index) {
  frames_.erase(frames_.begin() + index);
  for (int& f : prior_.frames) f -= f > index;
}

void SlidingWindow::drop_frame(int index, WindowProblem& problem, const Calibration& calibration, const WindowWeights& weights) {
  Frame& leaving = frames_[index];
  Frame& next = frames_[index + 1];
  if (leaving.in_prior) {
    build(problem, calibration, weights);
    WindowPrior prior =
        marginalise_frame(problem, index, std::vector<std::uint8_t>(problem.landmarks.size(), 0), marginalisation_scratch_);
    next.imu.reset();
    forget_sightings(leaving.id, calibration);
    set_prior(std::move(prior));
  } else {
    if (next.imu && leaving.imu) {
      Preintegration joined = std::move(*leaving.imu);
      joined.append(*next.imu);
      next.imu = std::move(joined);
    } else {
      next.imu.reset();
    }
    forget_sightings(leaving.id, calibration);
  }
  forget_frame(index);
}

void SlidingWindow::marginalise_keyframe(int index, WindowProblem& problem, const Calibration& calibration,
                                         const WindowWeights& weights) {
  build(problem, calibration, weights);
  const FrameId id = frames_[index].id;
  const int zone_end = static_cast<int>(frames_.size()) - options_.keyframes.newest_frames;

  // Landmarks this keyframe hosts leave with it. Those still in view give up what keyframes saw of
  // them and start anew from the newest frames' sightings: no observation is used twice.
  std::vector<std::uint8_t> leaves(problem.landmarks.size(), 0);
  std::vector<std::uint8_t> gone(landmarks_.size(), 0);
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    Landmark& landmark = landmarks_[landmark_of_problem_[i]];
    if (landmark.host != id) continue;
    const bool in_view = landmark.sightings.back().frame == frames_.back().id;
    WindowLandmark& numbers = problem.landmarks[i];
    if (in_view) {
      int keep = 0, last_frame = -1, distinct = 0;
      while (keep < numbers.observation_count) {
        const int f = problem.observations[numbers.first_observation + keep].frame;
        if (f >= zone_end) break;
        distinct += f != last_frame;
        last_frame = f;
        ++keep;
      }
      if (distinct < 2) continue;  // says nothing about motion: just rehosted below
      numbers.observation_count = keep;
    }
    leaves[i] = 1;
    landmark.sightings.erase(std::remove_if(landmark.sightings.begin(), landmark.sightings.end(),
                                            [&](const Sighting& s) { return !in_view || index_of(s.frame) < zone_end; }),
                             landmark.sightings.end());
    if (landmark.sightings.empty()) gone[landmark_of_problem_[i]] = 1;
    else rehost(landmark, landmark.sightings.front().frame, calibration);
  }
  WindowPrior prior = marginalise_frame(problem, index, leaves, marginalisation_scratch_);
  if (remembers_) remember_leaving(problem, leaves, calibration);
  if (index + 1 < static_cast<int>(frames_.size())) frames_[index + 1].imu.reset();
  remove_flagged(gone);
  forget_sightings(id, calibration);
  set_prior(std::move(prior));
  forget_frame(index);
}

int SlidingWindow::landmarks_in_view() const {
  return static_cast<int>(std::count_if(landmarks_.begin(), landmarks_.end(), [&](const Landmark& l) {
    return l.triangulated && l.sightings.back().frame == frames_.back().id && l.sightings.size() >= 2;
  }));
}

SlidingWindow::KeyframeDistance SlidingWindow::distance_to_last_keyframe(const Calibration& calibration, double focal_px) const {
  KeyframeDistance out;
  const auto last = std::find_if(frames_.rbegin() + 1, frames_.rend(), [](const Frame& f) { return f.keyframe; });
  if (last == frames_.rend()) return out;
  out.age = newest().t - last->t;
  const Mat3 R_BC = calibration.T_BC0.R();
  const Mat3 R_new_last = (newest().state.T_WB.R() * R_BC).transpose() * last->state.T_WB.R() * R_BC;
  int seen = 0;
  std::vector<double> motion;
  for (const Landmark& l : landmarks_) {
    if (l.sightings.back().frame != newest().id) continue;
    ++seen;
    for (const Sighting& s : l.sightings) {
      if (s.frame != last->id) continue;
      const Vec3 p = R_new_last * Vec3(s.left.normalised.x(), s.left.normalised.y(), 1);
      motion.push_back(focal_px * (p.head<2>() / p.z() - l.sightings.back().left.normalised).norm());
    }
  }
  if (seen > 0) out.shared_ratio = static_cast<double>(motion.size()) / seen;
  if (!motion.empty()) {
    std::nth_element(motion.begin(), motion.begin() + motion.size() / 2, motion.end());
    out.parallax_px = motion[motion.size() / 2];
  }
  return out;
}

Keyframe SlidingWindow::take_keyframe(int index, const Calibration& calibration) {
  Frame& frame = frames_[index];
  Keyframe out;
  out.id = frame.id;
  out.t = frame.t;
  const NavState level = tilt_.levelled(frame.state);
  out.T_WB = level.T_WB;
  out.v_WB = level.v_WB;
  out.images = std::exchange(frame.images, {});
  for (const Landmark& l : landmarks_) {
    if (!l.triangulated) continue;
    const auto seen =
        std::find_if(l.sightings.begin(), l.sightings.end(), [&](const Sighting& s) { return s.frame == frame.id; });
    if (seen == l.sightings.end()) continue;
    const Vec3 p_C = scaled_point_in_camera(l, frame, calibration) / l.alpha_beta_rho.z();
    out.landmarks.push_back({l.track, seen->left.pixel, calibration.T_BC0 * p_C});
  }
  return out;
}

WindowSnapshot SlidingWindow::snapshot(const Calibration& calibration) const {
  WindowSnapshot out;
  for (const Frame& f : frames_) out.frames.push_back({f.id, f.t, tilt_.levelled(f.state.T_WB), f.keyframe});
  for (const Landmark& l : landmarks_) {
    if (!l.triangulated) continue;
    const Pose<W, C0> T_WC = frames_[index_of(l.host)].state.T_WB * calibration.T_BC0;
    const Vec3 p_C = Vec3(l.alpha_beta_rho.x(), l.alpha_beta_rho.y(), 1) / l.alpha_beta_rho.z();
    out.landmarks.push_back({l.id, l.track, tilt_.levelled(Vec3(T_WC * p_C)), static_cast<int>(l.sightings.size())});
  }
  return out;
}

}  // namespace fbvins

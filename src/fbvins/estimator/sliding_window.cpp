// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/sliding_window.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "fbvins/estimator/imu_factor.hpp"

namespace fbvins {

namespace {

/// At most `limit` landmarks, those seen by most frames; the older ones among equals. The order stays.
void keep_most_observed(std::vector<const Landmark*>& landmarks, int limit) {
  int spare = limit - static_cast<int>(landmarks.size());
  if (spare >= 0) return;
  std::vector<int> seen_by;  // number of landmarks seen by so many frames
  for (const Landmark* l : landmarks) {
    const auto frames = static_cast<std::size_t>(l->frame_count());
    if (seen_by.size() <= frames) seen_by.resize(frames + 1);
    ++seen_by[frames];
  }
  int least = 0;  // frames: landmarks seen by fewer leave
  while (spare < 0) spare += seen_by[static_cast<std::size_t>(least++)];
  // Of those seen by the fewest that are left out the oldest fill up what is spare.
  std::erase_if(landmarks, [&](const Landmark* l) {
    const int n = l->frame_count();
    return n < least && (n + 1 < least || spare-- <= 0);
  });
}

/// Those of readings first, then kind by kind.
void fill_factors(const FrameList& frames, std::vector<std::shared_ptr<const Factor>>& out) {
  out.clear();
  for (int i = 1; i < frames.size(); ++i)
    if (const auto& imu = frames[i].imu; imu && !imu->empty())
      out.push_back(std::make_shared<const ImuFactor>(frames[i - 1].id, frames[i].id, imu));
  std::vector<FrameFactor> brought;
  for (const Frame& f : frames)
    for (const FrameFactor& factor : f.factors) {
      const std::vector<Variable> variables = factor.factor->variables();
      const auto is_here = [&](const Variable& v) { return !v.is_of_frame() || frames.index_of(v.frame) >= 0; };
      if (std::all_of(variables.begin(), variables.end(), is_here)) brought.push_back(factor);
    }
  std::stable_sort(brought.begin(), brought.end(), [](const FrameFactor& a, const FrameFactor& b) { return a.order < b.order; });
  for (FrameFactor& factor : brought) out.push_back(std::move(factor.factor));
}

}  // namespace

SlidingWindow::SlidingWindow(const EstimatorOptions& options, const WindowWeights& weights)
    : options_(options), weights_(weights), known_(options.known_landmarks) {}

void SlidingWindow::clear() {
  frames_.clear();
  landmarks_.clear();
  known_.clear();
  prior_ = {};
  tilt_ = {};
  own_.clear();
}

int SlidingWindow::add_own(std::string name, const Eigen::VectorXd& value) {
  own_.push_back({next_own_, std::move(name), value, true});
  return next_own_++;
}

const OwnVariable* SlidingWindow::own(int number) const {
  const auto it = std::find_if(own_.begin(), own_.end(), [&](const OwnVariable& v) { return v.number == number; });
  return it == own_.end() ? nullptr : &*it;
}

void SlidingWindow::end_own(int number) {
  for (OwnVariable& v : own_)
    if (v.number == number) v.is_wanted = false;
  forget_unused_own();
}

void SlidingWindow::forget_unused_own() {
  std::erase_if(own_, [&](const OwnVariable& v) {
    const auto names_it = [&](const FrameFactor& f) {
      const std::vector<Variable> variables = f.factor->variables();
      return std::find(variables.begin(), variables.end(), Variable::own_one(v.number)) != variables.end();
    };
    return !v.is_wanted && std::find(prior_.own.begin(), prior_.own.end(), v.number) == prior_.own.end() &&
           std::none_of(frames_.begin(), frames_.end(),
                        [&](const Frame& frame) { return std::any_of(frame.factors.begin(), frame.factors.end(), names_it); });
  });
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

void SlidingWindow::add_frame(Frame frame, const std::vector<TrackedFeature>& features, const Calibration& calibration) {
  frames_.add(std::move(frame));
  const Frame& newest = frames_.newest();
  for (const TrackedFeature& feature : features) {
    if (landmarks_.rejected(feature.id)) continue;
    auto [landmark, is_new] = landmarks_.of_track(feature.id);
    if (is_new) landmark.prior = known_.find(feature.id), landmark.lead = feature.lead;
    if (landmark.observations.empty()) landmark.host = newest.id;
    add_observations(landmark, feature);
    if (landmark.triangulated) continue;
    landmark.triangulated = triangulate(landmark, frames_, calibration);
    if (landmark.triangulated && landmark.prior) refuse_distant_prior(landmark, calibration);
  }
}

void SlidingWindow::add_observations(Landmark& landmark, const TrackedFeature& feature) const {
  std::vector<Sighting>& all = landmark.observations;
  const std::size_t older = all.size(), of_last = older == 0 ? 0 : landmark.newest().size();
  if (older == 0) all.reserve(feature.seen.size());
  for (const Observation& o : feature.seen) all.push_back({frames_.newest().id, o});
  if (older == 0) return;
  const std::span<Sighting> before(all.data() + older - of_last, of_last);
  set_velocities(before, {all.data() + older, feature.seen.size()},
                 (frames_.newest().t - frames_.at(before.front().frame).t).seconds());
}

void SlidingWindow::fill_problem(const Calibration& calibration, WindowProblem& out) const {
  out.frames.clear();
  for (const Frame& f : frames_) out.frames.push_back({f.id, f.state, f.first_estimate, f.in_prior});
  fill_factors(frames_, out.factors);
  out.own = own_;
  out.tilt = tilt_;
  out.calibration = calibration;
  out.weights = weights_;
  out.prior = prior_;
  out.landmarks.clear();
  out.observations.clear();
  out.landmark_priors.clear();

  std::vector<const Landmark*> chosen;
  for (const Landmark& l : landmarks_.all())
    if (l.triangulated && l.by_several_frames()) chosen.push_back(&l);
  keep_most_observed(chosen, options_.max_landmarks);
  for (const Landmark* landmark : chosen) {
    WindowLandmark l;
    l.id = landmark->id;
    l.host = frames_.index_of(landmark->host);
    l.camera = landmark->ray_camera;
    l.alpha_beta_rho = landmark->alpha_beta_rho;
    l.first_observation = static_cast<int>(out.observations.size());
    FrameId id;
    int frame = -1;
    for (const Sighting& s : landmark->observations) {
      if (s.frame != id) id = s.frame, frame = frames_.index_of(id);
      const Observation& o = s.seen;
      const Vec3 displacement_B = o.after_s == 0 ? Vec3::Zero() : o.displacement_B(frames_[frame].state.v_B());
      out.observations.push_back({frame, o.camera, o.normalised, s.velocity, o.sqrt_information, o.rows, displacement_B});
    }
    l.observation_count = static_cast<int>(out.observations.size()) - l.first_observation;
    if (landmark->prior) {
      l.prior = static_cast<int>(out.landmark_priors.size());
      out.landmark_priors.push_back(*landmark->prior);
    }
    out.landmarks.push_back(l);
  }
}

void SlidingWindow::take_estimates(const WindowProblem& solved) {
  tilt_ = solved.tilt;
  for (const OwnVariable& v : solved.own)
    for (OwnVariable& own : own_)
      if (own.number == v.number) own.value = v.value;
  for (const WindowFrame& f : solved.frames)
    if (const int i = frames_.index_of(f.id); i >= 0) frames_[i].state = f.state;
  for (int i = 1; i < frames_.size(); ++i) {
    const ImuBias& bias = frames_[i - 1].state.bias;
    if (!frames_[i].imu || !frames_[i].imu->needs_repropagation(bias)) continue;
    Preintegration anew = *frames_[i].imu;
    anew.repropagate(bias);
    frames_[i].imu = std::make_shared<const Preintegration>(std::move(anew));
  }
  for (const WindowLandmark& l : solved.landmarks)
    if (Landmark* landmark = landmarks_.find(l.id)) landmark->alpha_beta_rho = l.alpha_beta_rho;
}

void SlidingWindow::forget_observations(FrameId frame, const Calibration& calibration) {
  for (Landmark& landmark : landmarks_.all()) {
    if (std::erase_if(landmark.observations, [&](const Sighting& s) { return s.frame == frame; }) == 0) continue;
    if (!landmark.observations.empty() && landmark.host == frame)
      rehost(landmark, landmark.observations.front().frame, frames_, calibration);
  }
  landmarks_.remove_unseen();
}

void SlidingWindow::forget_frame(int index) {
  const FrameId id = frames_[index].id;
  if (index + 1 < frames_.size())  // what it has brought of other frames stays
    for (FrameFactor& f : frames_[index].factors)
      if (!f.factor->touches(id)) frames_[index + 1].factors.push_back(std::move(f));
  frames_.remove(index);
  for (Frame& frame : frames_)
    std::erase_if(frame.factors, [&](const FrameFactor& f) { return f.factor->touches(id); });  // they are in the prior
  for (int& f : prior_.frames) f -= f > index;
  forget_unused_own();
}

/// Of all frames: a factor of another frame may be about this one, too.
void SlidingWindow::take_over_factors(const Frame& leaving, Frame& next) {
  const DroppedFrame dropped{leaving.id, next.id, next.state.T_FB.inverse() * leaving.state.T_FB, leaving.state.v_B(),
                             next.state.v_B()};
  std::vector<FrameFactor> taken;
  for (const FrameFactor& f : leaving.factors)
    if (auto left = f.factor->touches(leaving.id) ? f.factor->without(dropped) : f.factor)
      taken.push_back({f.order, std::move(left)});
  next.factors.insert(next.factors.begin(), taken.begin(), taken.end());
  for (Frame& frame : frames_) {
    if (frame.id == leaving.id) continue;
    for (FrameFactor& f : frame.factors)
      if (f.factor->touches(leaving.id)) f.factor = f.factor->without(dropped);
    std::erase_if(frame.factors, [](const FrameFactor& f) { return f.factor == nullptr; });
  }
}

void SlidingWindow::drop_frame(int index, const Calibration& calibration) {
  Frame& leaving = frames_[index];
  Frame& next = frames_[index + 1];
  if (leaving.in_prior) {
    fill_problem(calibration, leaving_.problem);
    Marginalised marginalised = marginalise_frame(leaving_.problem, index, {}, leaving_.memory);
    next.imu.reset();
    forget_observations(leaving.id, calibration);
    set_prior(std::move(marginalised.prior));
  } else {
    if (next.imu && leaving.imu) {
      Preintegration joined = *leaving.imu;
      joined.append(*next.imu);
      next.imu = std::make_shared<const Preintegration>(std::move(joined));
    } else {
      next.imu.reset();
    }
    take_over_factors(leaving, next);
    leaving.factors.clear();
    forget_observations(leaving.id, calibration);
  }
  forget_frame(index);
}

void SlidingWindow::marginalise_keyframe(int index, const Calibration& calibration) {
  const FrameId id = frames_[index].id;
  const int newest_begin = frames_.size() - options_.keyframes.newest_frames;
  WindowProblem& problem = leaving_.problem;
  fill_problem(calibration, problem);
  const std::vector<LeavingLandmark> leaving = landmarks_leaving_with(problem, index, newest_begin);
  Marginalised marginalised = marginalise_frame(problem, index, leaving, leaving_.memory);
  remember(problem, leaving, marginalised.landmark_information);
  for (const LeavingLandmark& l : leaving) keep_newest_observations(problem, l, newest_begin, calibration);
  if (index + 1 < frames_.size()) frames_[index + 1].imu.reset();
  landmarks_.remove_unseen();
  forget_observations(id, calibration);
  set_prior(std::move(marginalised.prior));
  forget_frame(index);
}

/// Its observations by keyframes are in the prior; those by the newest frames start it anew.
void SlidingWindow::keep_newest_observations(const WindowProblem& problem, const LeavingLandmark& leaving, int newest_begin,
                                             const Calibration& calibration) {
  Landmark& landmark = *landmarks_.find(problem.landmarks[leaving.index].id);
  std::erase_if(landmark.observations,
                [&](const Sighting& s) { return !leaving.in_view || frames_.index_of(s.frame) < newest_begin; });
  if (!landmark.observations.empty()) rehost(landmark, landmark.observations.front().frame, frames_, calibration);
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "fbvins/calibration/flight_learning.hpp"
#include "fbvins/camera/camera_times.hpp"

namespace fbvins {
namespace {

/// Pieces of a part at least, so that there is something to judge by.
constexpr std::size_t kFewestPieces = 2;
/// A piece: shorter ones of short flights, so that each half has two.
constexpr double kPiece_s = 8, kShortestPiece_s = 2.2;
/// Keyframes nearer to one another add little but work.
constexpr double kKeyframeStep_s = 0.18;
constexpr int kFewestKeyframes = 5, kFewestPoints = 20;
/// Pieces of all flights together, and of each at least, that bound the work.
constexpr std::size_t kMostPieces = 40, kFewestOfEach = 4;
/// By how much all held-out parts together must be predicted better, in units of half a squared standard deviation; and by how
/// much any of them may be predicted worse, which is chance. What is known to be rough need not be predicted so much better.
constexpr double kLeastGain = 3;

struct OwnedPiece {
  std::size_t flight = 0;
  std::unique_ptr<FlightPiece> piece;
};

/// Stretches of keyframes with readings between them.
std::vector<std::vector<FlightKeyframe>> stretches_of(const FlightTracks& flight, double longest_s) {
  std::vector<std::vector<FlightKeyframe>> out;
  std::vector<ImuSegment> skipped;
  for (const FlightKeyframe& k : flight.keyframes) {
    const bool breaks = out.empty() || k.imu.empty() || k.new_frame;
    skipped.insert(skipped.end(), k.imu.begin(), k.imu.end());
    if (!breaks && (k.t - out.back().back().t).seconds() < kKeyframeStep_s) continue;
    if (breaks || (k.t - out.back().front().t).seconds() > longest_s) out.emplace_back();
    out.back().push_back(k);
    out.back().back().imu = std::exchange(skipped, {});
  }
  std::erase_if(out, [&](const std::vector<FlightKeyframe>& s) {
    return static_cast<int>(s.size()) < kFewestKeyframes || (s.back().t - s.front().t).seconds() < 0.5 * longest_s;
  });
  return out;
}

std::vector<OwnedPiece> pieces_of(const std::vector<FlightTracks>& flights, const FlightRig& given) {
  std::vector<OwnedPiece> out;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    double longest_s = kPiece_s;
    std::vector<std::vector<FlightKeyframe>> stretches = stretches_of(flights[f], longest_s);
    while (stretches.size() < 2 * kFewestPieces && longest_s > kShortestPiece_s) {
      longest_s = std::max(kShortestPiece_s, longest_s - 1);
      stretches = stretches_of(flights[f], longest_s);
    }
    const std::size_t most = std::max(kFewestOfEach, kMostPieces / flights.size());
    const std::size_t count = std::min(most, stretches.size());
    for (std::size_t i = 0; i < count; ++i) {  // evenly spread over the flight
      std::vector<FlightKeyframe>& stretch = stretches[i * stretches.size() / count];
      auto piece = std::make_unique<FlightPiece>(std::move(stretch), flights[f].noise, flights[f].gravity_mps2, given);
      if (piece->points() >= kFewestPoints) out.push_back({f, std::move(piece)});
    }
  }
  return out;
}

/// The part of each piece, each of which is predicted by the others: flights, or the two halves of a single one.
std::vector<std::size_t> parts_of(const std::vector<OwnedPiece>& pieces, std::size_t flights) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < pieces.size(); ++i) out.push_back(flights > 1 ? pieces[i].flight : 2 * i / pieces.size());
  return out;
}

/// What is flown: axes that were free in the fit, but are not refined, are as given.
FlightRig as_flown(const FlightLesson& lesson) {
  FlightRig rig = lesson.rig;
  const std::vector<FlightParameter> parameters = flight_parameters(rig);
  std::size_t at = 0;
  while (parameters[at].group != FlightGroup::gyro_axes) ++at;
  const auto take = [&](double& element, double given) {
    if (lesson.findings[at++] != FlightFinding::refined) element = given;
  };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) take(rig.axes.gyro(i, j), i == j);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) take(rig.axes.accel(i, j), i == j);
  return rig;
}

/// Pieces of which one part is held out, and what the others say.
struct Division {
  std::string name;
  FlightPieces others, held_out;
  FlightSurvey survey;
};

HeldOutPart judged(const Division& division, const FlightRig& given, const FlightQuestion& question) {
  const FlightLesson lesson = learn_from(division.others, given, division.survey, question);
  HeldOutPart out{division.name, lesson.changed};
  if (!lesson.changed) return out;
  out.given = settled_cost(division.held_out, given, lesson.noise);
  out.refined = settled_cost(division.held_out, as_flown(lesson), lesson.noise);
  out.gain = (out.given - out.refined) / lesson.noise.spread;
  return out;
}

void fill_parameters(const FlightLesson& lesson, const FlightRig& given, FlightCalibration& out) {
  out.covariance = lesson.covariance;
  const std::vector<FlightParameter> parameters = flight_parameters(given);
  const Eigen::VectorXd before = values(given), after = values(lesson.rig), change = step_between(given, lesson.rig);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const FlightParameter& p = parameters[i];
    const bool keeps = lesson.findings[i] != FlightFinding::refined;
    out.parameters.push_back({p.name, p.unit, before[k], keeps ? before[k] : after[k], keeps ? 0 : change[k],
                              std::sqrt(std::max(0.0, lesson.covariance(k, k))), p.prior_sigma, lesson.findings[i]});
  }
}

double total_gain(const FlightCalibration& found) {
  double sum = 0;
  for (const HeldOutPart& part : found.held_out) sum += part.gain;
  return sum;
}

/// Why the calibration stays as given; empty where it does not.
std::string objection_to(const FlightCalibration& found, bool changed, double least_gain) {
  const bool determined = std::any_of(found.parameters.begin(), found.parameters.end(),
                                      [](const RefinedParameter& p) { return p.finding != FlightFinding::not_determined; });
  if (!determined) return "these flights determine no parameter: the calibration stays as given";
  if (!changed) return "what these flights determine is as given: the calibration stays";
  for (const HeldOutPart& part : found.held_out)
    if (part.gain < -kLeastGain)
      return fmt::format("{} is predicted worse by the calibration refined without it than by the one given, which stays",
                         part.name);
  if (total_gain(found) < least_gain)
    return "what was held out is hardly predicted better by the refined calibration than by the one given, which stays";
  return {};
}

Result<void> check(const std::vector<FlightTracks>& flights, const std::vector<std::string>& names, const StereoRig& rig) {
  if (rig.depth) return Error{ErrorCode::unsupported, "a rig with a depth sensor cannot be refined from flights yet"};
  if (has_rolling_shutter(rig)) return Error{ErrorCode::unsupported, "a rolling shutter cannot be refined from flights yet"};
  for (std::size_t i = 0; i < flights.size(); ++i) {
    if (flights[i].untriggered)
      return Error{ErrorCode::unsupported,
                   fmt::format("{}: cameras without a common trigger cannot be refined from flights yet", names[i])};
    if (flights[i].keyframes.empty())
      return Error{ErrorCode::invalid_argument, fmt::format("{}: no pose could be estimated", names[i])};
  }
  return {};
}

/// A sentence where a part has too little to judge by.
Result<void> check_parts(const std::vector<OwnedPiece>& pieces, const std::vector<std::string>& names) {
  for (std::size_t f = 0; f < names.size(); ++f) {
    const auto count =
        static_cast<std::size_t>(std::count_if(pieces.begin(), pieces.end(), [&](const auto& p) { return p.flight == f; }));
    const std::size_t needed = names.size() > 1 ? 1 : 2 * kFewestPieces;
    if (count < needed)
      return Error{ErrorCode::invalid_argument,
                   fmt::format("{}: is too short: {:.0f} s with good poses, readings and features are needed", names[f],
                               static_cast<double>(needed) * kShortestPiece_s + 1)};
  }
  return {};
}

std::vector<Division> divisions_of(const std::vector<OwnedPiece>& pieces, const std::vector<std::string>& names) {
  std::vector<Division> out;
  if (names.size() > 1)
    for (const std::string& name : names) out.push_back({name, {}, {}, {}});
  else out = {{"the first half", {}, {}, {}}, {"the second half", {}, {}, {}}};
  const std::vector<std::size_t> parts = parts_of(pieces, names.size());
  for (std::size_t d = 0; d < out.size(); ++d)
    for (std::size_t i = 0; i < pieces.size(); ++i)
      (parts[i] == d ? out[d].held_out : out[d].others).push_back(pieces[i].piece.get());
  return out;
}

FlightCalibration counted(const std::vector<OwnedPiece>& pieces, const StereoRig& rig, const FlightNoise& noise) {
  FlightCalibration out;
  out.rig = rig;
  out.sigma_px = noise.sigma_px, out.spread = noise.spread;
  out.pieces = static_cast<int>(pieces.size());
  for (const OwnedPiece& p : pieces) {
    out.keyframes += p.piece->keyframes(), out.points += p.piece->points(), out.views += p.piece->views();
    out.duration_s += p.piece->duration_s();
  }
  return out;
}

/// What is asked, one after the other, with fewer and fewer groups to refine: what predicts best is taken. Lenses trade off
/// against much else, distortion most of all.
std::vector<FlightQuestion> questions(const std::vector<FlightGroup>& rough) {
  using enum FlightGroup;
  const auto may_change = [&](FlightGroup group) { return rough.empty() || std::ranges::find(rough, group) != rough.end(); };
  FlightQuestion question;
  question.rough = !rough.empty();
  for (const FlightGroup group :
       {lever, mounting, time_offset, gyro_axes, accel_axes, baseline, between_cameras, focal, centre, distortion})
    if (!may_change(group)) question.left.push_back(group);
  std::vector<FlightQuestion> out{question};
  for (const FlightGroup group : {distortion, centre, focal}) {
    if (!may_change(group)) continue;
    question.left.push_back(group);
    out.push_back(question);
  }
  return out;
}

/// What all pieces answer, and how the held-out parts judge it.
FlightCalibration refined(const Division& all, const std::vector<Division>& divisions, const FlightRig& given,
                          const FlightQuestion& question, FlightCalibration out) {
  for (const Division& division : divisions) out.held_out.push_back(judged(division, given, question));
  const FlightLesson lesson = learn_from(all.others, given, all.survey, question);
  out.axes = lesson.rig.axes;
  fill_parameters(lesson, given, out);
  out.verdict = objection_to(out, lesson.changed, question.rough ? 0 : kLeastGain);
  out.better = out.verdict.empty();
  if (!out.better)
    for (RefinedParameter& p : out.parameters) p.value = p.given;
  if (!out.better) return out;
  out.rig = refined_rig(out.rig, as_flown(lesson));
  out.verdict = "what was held out is predicted better by the refined calibration than by the one given";
  return out;
}

}  // namespace

Result<FlightCalibration> calibrate_from_flights(const std::vector<FlightTracks>& flights, const std::vector<std::string>& names,
                                                 const StereoRig& rig, const FlightCalibrationOptions& options) {
  if (Result<void> good = check(flights, names, rig); !good) return good.error();
  const FlightRig given = flight_rig(rig);
  const std::vector<OwnedPiece> pieces = pieces_of(flights, given);
  if (Result<void> good = check_parts(pieces, names); !good) return good.error();
  const auto tell = [&](const std::string& what) {
    if (options.on_progress) options.on_progress(what);
  };
  std::vector<Division> divisions = divisions_of(pieces, names);
  for (Division& division : divisions) {
    tell("without " + division.name);
    division.survey = survey_of(division.others, given);
  }
  tell("all together");
  Division all{"", {}, {}, {}};
  for (const OwnedPiece& p : pieces) all.others.push_back(p.piece.get());
  all.survey = survey_of(all.others, given);
  std::optional<FlightCalibration> best;
  for (const FlightQuestion& question : questions(options.rough)) {
    tell(best ? "judging with less of the lenses refined" : "judging");
    FlightCalibration found = refined(all, divisions, given, question, counted(pieces, rig, all.survey.noise));
    found.gyro_noise_radps_rthz = all.survey.noise.gyro * flights.front().noise.gyro_noise_density_radps_rthz;
    found.accel_noise_mps2_rthz = all.survey.noise.accel * flights.front().noise.accel_noise_density_mps2_rthz;
    const bool unchanged = std::none_of(found.held_out.begin(), found.held_out.end(), [](const auto& p) { return p.changed; });
    if (!best || (found.better && (!best->better || total_gain(found) > total_gain(*best)))) best = std::move(found);
    if (unchanged) break;
  }
  return *std::move(best);
}

}  // namespace fbvins

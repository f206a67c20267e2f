// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "fbvins/calibration/flight_learning.hpp"

namespace fbvins {
namespace {

/// Pieces of a part at least, so that there is something to judge by.
constexpr std::size_t kFewestPieces = 2;
/// A piece: shorter ones of short flights, so that each half has two.
constexpr double kPiece_s = 8, kShortestPiece_s = 3;
/// Keyframes nearer to one another add little but work.
constexpr double kKeyframeStep_s = 0.18;
constexpr int kFewestKeyframes = 8, kFewestPoints = 20;
/// Pieces of all flights together, and of each at least, that bound the work.
constexpr std::size_t kMostPieces = 40, kFewestOfEach = 4;
/// By how much all held-out parts together must be predicted better, in units of half a squared standard deviation; and by how
/// much any of them may be predicted worse, which is chance.
constexpr double kLeastGain = 3;

struct OwnedPiece {
  std::size_t flight = 0;
  std::unique_ptr<FlightPiece> piece;
};

/// Stretches of keyframes with readings between them.
std::vector<std::vector<FlightKeyframe>> stretches_of(const FlightTracks& flight) {
  const double duration_s = (flight.keyframes.back().t - flight.keyframes.front().t).seconds();
  const double longest_s = std::clamp(duration_s / (2 * kFewestPieces) - 0.5, kShortestPiece_s, kPiece_s);
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
    std::vector<std::vector<FlightKeyframe>> stretches = stretches_of(flights[f]);
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

FlightRig as_flown(FlightRig rig) {
  rig.axes = {};
  return rig;
}

HeldOutPart judged(const FlightPieces& others, const FlightPieces& held_out, const FlightRig& given, std::string name) {
  const FlightLesson lesson = learn_from(others, given);
  HeldOutPart out{std::move(name), lesson.changed};
  if (!lesson.changed) return out;
  out.given = settled_cost(held_out, given, lesson.noise.sigma_px);
  out.refined = settled_cost(held_out, as_flown(lesson.rig), lesson.noise.sigma_px);
  out.gain = (out.given - out.refined) / lesson.noise.spread;
  return out;
}

void fill_parameters(const FlightLesson& lesson, const FlightRig& given, FlightCalibration& out) {
  const std::vector<FlightParameter> parameters = flight_parameters(given);
  const Eigen::VectorXd before = values(given), after = values(lesson.rig), change = step_between(given, lesson.rig);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const FlightParameter& p = parameters[i];
    const bool keeps = lesson.findings[i] != FlightFinding::refined;
    out.parameters.push_back({p.name, p.unit, before[k], keeps ? before[k] : after[k], keeps ? 0 : change[k], lesson.sigma[k],
                              p.prior_sigma, lesson.findings[i], is_flown(p.group)});
  }
}

std::string verdict_of(const FlightCalibration& found, bool changed) {
  const bool determined = std::any_of(found.parameters.begin(), found.parameters.end(), [](const RefinedParameter& p) {
    return p.flown && p.finding != FlightFinding::not_determined;
  });
  if (!determined) return "these flights determine no parameter: the calibration stays as given";
  if (!changed) return "what these flights determine is as given: the calibration stays";
  double gain = 0;
  for (const HeldOutPart& part : found.held_out) {
    gain += part.gain;
    if (part.gain < -kLeastGain)
      return fmt::format("{} is predicted worse by the calibration refined without it than by the one given, which stays",
                         part.name);
  }
  if (gain < kLeastGain)
    return "what was held out is hardly predicted better by the refined calibration than by the one given, which stays";
  return {};
}

Result<void> check(const std::vector<FlightTracks>& flights, const std::vector<std::string>& names, const StereoRig& rig) {
  if (rig.depth) return Error{ErrorCode::unsupported, "a rig with a depth sensor cannot be refined from flights yet"};
  if (rig.line_delay_s != 0) return Error{ErrorCode::unsupported, "a rolling shutter cannot be refined from flights yet"};
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
                   fmt::format("{}: is too short: {} s with good poses, readings and features are needed", names[f],
                               static_cast<double>(needed) * kShortestPiece_s + 1)};
  }
  return {};
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
  FlightCalibration out;
  out.rig = rig;
  FlightPieces all;
  for (const OwnedPiece& p : pieces) {
    all.push_back(p.piece.get());
    out.keyframes += p.piece->keyframes(), out.points += p.piece->points(), out.views += p.piece->views();
    out.duration_s += p.piece->duration_s();
  }
  out.pieces = static_cast<int>(pieces.size());
  const std::vector<std::size_t> parts = parts_of(pieces, flights.size());
  const std::size_t count = flights.size() > 1 ? flights.size() : 2;
  for (std::size_t part = 0; part < count; ++part) {
    const std::string name = flights.size() > 1 ? names[part] : part == 0 ? "the first half" : "the second half";
    tell("without " + name);
    FlightPieces others, held_out;
    for (std::size_t i = 0; i < all.size(); ++i) (parts[i] == part ? held_out : others).push_back(all[i]);
    out.held_out.push_back(judged(others, held_out, given, name));
  }
  tell("all together");
  const FlightLesson lesson = learn_from(all, given);
  out.sigma_px = lesson.noise.sigma_px, out.spread = lesson.noise.spread;
  out.axes = lesson.rig.axes;
  fill_parameters(lesson, given, out);
  out.verdict = verdict_of(out, lesson.changed);
  out.better = out.verdict.empty();
  if (!out.better) return out;
  out.rig = refined_rig(rig, lesson.rig);
  out.verdict = "what was held out is predicted better by the refined calibration than by the one given";
  return out;
}

}  // namespace fbvins

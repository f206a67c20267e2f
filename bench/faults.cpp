// SPDX-License-Identifier: Apache-2.0
// A campaign of faults: recorded flights whose sensors fail in the middle, each with one fault drawn at random (kind, size,
// moment, length), through the judgement of live sensors and the whole odometry. What counts is what is published as `good`.
//
//   fbvins_faults FLIGHT... --flights 300 --out rows.csv        goes on where it was stopped; the same rows in any order
//   fbvins_faults FLIGHT... --fault imu_frozen:8:2 --frontends klt     one fault, of every recording
//   fbvins_faults FLIGHT... --clean                              without faults: false alarms
//   fbvins_faults --tracks normal hover V1_02/@20 --flights 10000    synthetic tracks (faulty_tracks.hpp), without images
//
// With --tracks a flight is a preset of the simulator, or a folder with groundtruth.csv and imu0.csv and where to begin in it, s.
// A row for each flight. Errors are those since the fault's beginning: the estimate is laid over the truth by the poses before it
// (shift and heading), and by the first pose after a reset that was told.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/drawn_faults.hpp"
#include "bench/fault_flights.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/eval/alignment.hpp"
#include "fbvins/faults/sensor_faults.hpp"
#include "fbvins/live/ingest.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins::bench {
namespace {

/// False: a pose that is called good and is off by this much, and by as many standard deviations, at once.
constexpr double kFalse_m = 0.5, kFalseTilt_rad = 5 * kDegree, kFalse_sigma = 5;
/// Smaller errors are not counted in standard deviations: the truth has its own.
constexpr double kTruth_m = 0.05, kTruth_rad = 1.5 * kDegree;
/// The heading of W is not observable from poses of a smaller extent.
constexpr double kHeadingNeeds_m = 0.5;

/// A published pose with the moment at which its image was truly taken.
struct Published {
  Time taken;
  Odometry odometry;
};

/// The way of live data, in one thread and in the flight's own time.
class LiveWay final : public SensorInput {
 public:
  LiveWay(const Flight& flight, const SystemOptions& options, SystemParts parts)
      : ingest_(
            1, [this] { return now; }, nullptr, flight.rig.imu_noise, Duration::from_seconds(flight.rig.time_offset_s)),
        system_(*System::create(options, flight.rig, RunMode::deterministic, std::move(parts))) {
    system_.on_odometry([this](const Odometry& o) { published.push_back({taken_.at(o.t.ns), o}); });
  }
  void push(const ImuSample& sample) override { ingest_.push(sample), forward(); }
  void push(StereoFrame frame) override { ingest_.push(std::move(frame)), forward(); }
  void finish() { ingest_.close(), forward(), (void)system_.finish(); }
  LiveCounts counts() const { return ingest_.counts(); }

  Time now;
  bool held = false;  ///< data come later than they were taken, with their own stamps
  std::vector<Published> published;

 private:
  void forward() {
    ingest_.tick();
    while (std::optional<SensorEvent> event = ingest_.pop_waiting()) {
      if (const auto* frame = std::get_if<StereoFrame>(&*event)) taken_[frame->t.ns] = held ? frame->t : now;
      (void)system_.push(*std::move(event));
    }
  }
  Ingest ingest_;
  System system_;
  std::map<std::int64_t, Time> taken_;
};

/// Errors of position in standard deviations of the pose's worst direction, since the beginning of W: how many are above each.
constexpr double kRatios[] = {0, 2, 3, 4, 5, 6, 8, 10, 14, 20};
using Ratios = std::array<int, std::size(kRatios)>;

struct Errors {
  Ratios good_ratios{}, degraded_ratios{};
  int false_good = 0, good_after = 0, poses_after = 0, not_good = 0, lost = 0, resets = 0;
  double said_s = -1;        ///< from the fault's beginning to the first image that is not good; -1: never
  double good_again_s = -1;  ///< from the fault's end to the first image from which on all are good; -1: never
  double good_m = 0, good_sigma = 0, good_tilt_deg = 0, good_tilt_sigma = 0, largest_m = 0, last_m = 0, step_m = 0;
  std::set<std::string> reasons;
};

double direction_sigma(const Vec3& error, const Mat3& covariance) {
  const Vec3 u = error.normalized();
  return std::sqrt(std::max(0.0, u.dot(covariance * u)));
}

Similarity laid_on(const Pose<AnyWorld, B>& truth, const Pose<W, B>& estimate) {
  const Quat q = truth.q * estimate.q.conjugate();
  const Quat turn = Quat(q.w(), 0, 0, q.z()).normalized();
  return {1, turn, truth.p - turn * estimate.p};
}

/// Of the direction up in B.
double tilt_error_rad(const Pose<W, B>& estimate, const Pose<AnyWorld, B>& truth) {
  const double cosine = (estimate.q.conjugate() * Vec3::UnitZ()).dot(truth.q.conjugate() * Vec3::UnitZ());
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

/// Of the whole flight, laid on the truth by the first pose of each W.
void add_ratios(const Flight& flight, const std::vector<Published>& all, std::FILE* poses, Errors& out) {
  std::optional<Similarity> S;
  std::uint32_t reset = 0;
  for (const Published& p : all) {
    const Odometry& o = p.odometry;
    const auto truth = truth_at(flight, p.taken);
    if (!o.health.has_pose() || !truth) continue;
    if (!S || o.reset_counter != reset) S = laid_on(*truth, o.T_WB), reset = o.reset_counter;
    const Mat3 covariance = o.pose_covariance.topLeftCorner<3, 3>();
    const double worst_m = std::sqrt(Eigen::SelfAdjointEigenSolver<Mat3>(covariance, Eigen::EigenvaluesOnly).eigenvalues()(2));
    const double error_m = ((*S * o.T_WB).p - truth->p).norm(), ratio = error_m / worst_m;
    if (poses != nullptr)
      fmt::print(poses, "{:.3f},{},{},{},{:.4f},{:.4f},{:.3f},{:.3f}\n", (p.taken - flight.begin).seconds(),
                 to_string(o.health.state), to_string(o.health.reason), o.reset_counter, error_m, worst_m,
                 o.tilt_sigma_rad / kDegree, tilt_error_rad(o.T_WB, *truth) / kDegree);
    Ratios& ratios = o.health.state == HealthState::good ? out.good_ratios : out.degraded_ratios;
    for (std::size_t i = 0; i < ratios.size(); ++i) ratios[i] += ratio >= kRatios[i];
  }
}

double extent_m(const std::vector<PosePair>& pairs) {
  double out = 0;
  for (const PosePair& p : pairs) out = std::max(out, (p.truth.T.p - pairs.front().truth.T.p).norm());
  return out;
}

Errors judge(const Flight& flight, const std::vector<Published>& all, Time begin, Time end, std::FILE* poses) {
  Errors out;
  add_ratios(flight, all, poses, out);
  std::vector<PosePair> before;
  std::uint32_t reset = 0;
  for (const Published& p : all)
    if (p.taken < begin && p.odometry.health.has_pose()) {
      if (p.odometry.reset_counter != reset) before.clear(), reset = p.odometry.reset_counter;
      if (auto truth = truth_at(flight, p.taken))
        before.push_back({{p.taken, *truth}, {p.taken, p.odometry.T_WB.cast_frames<AnyWorld, B>()}});
    }
  std::optional<Similarity> S;
  if (auto aligned = align(before, Alignment::yaw)) S = *aligned;
  if (S && extent_m(before) < kHeadingNeeds_m) S = laid_on(before.back().truth.T, before.back().estimate.T.cast_frames<W, B>());
  // The first pose after the fault's beginning must not pay for what the alignment cannot fit.
  for (const Published& p : all) {
    const Odometry& o = p.odometry;
    if (p.taken < begin) continue;
    ++out.poses_after;
    const bool good = o.health.state == HealthState::good;
    if (!good) {
      ++out.not_good;
      if (out.said_s < 0) out.said_s = (p.taken - begin).seconds();
      out.reasons.insert(std::string(to_string(o.health.reason)));
      if (p.taken > end) out.good_again_s = -1;
    } else if (p.taken > end && out.good_again_s < 0) {
      out.good_again_s = (p.taken - end).seconds();
    }
    out.lost += o.health.state == HealthState::lost;
    if (!o.health.has_pose()) continue;
    const auto truth = truth_at(flight, p.taken);
    if (!truth) continue;
    if (!S || o.reset_counter != reset) {
      S = laid_on(*truth, o.T_WB), out.resets += o.reset_counter != reset, reset = o.reset_counter;
    }
    const Pose<W, B> laid = *S * o.T_WB;
    const Vec3 error_W = S->q.conjugate() * (laid.p - truth->p);
    const double size = error_W.norm(), sigma = size / direction_sigma(error_W, o.pose_covariance.topLeftCorner<3, 3>());
    const double tilt = tilt_error_rad(o.T_WB, *truth);
    const double tilt_sigma = tilt / o.tilt_sigma_rad;
    out.largest_m = std::max(out.largest_m, size), out.last_m = size;
    if (!good) continue;
    ++out.good_after;
    out.good_m = std::max(out.good_m, size);
    out.good_tilt_deg = std::max(out.good_tilt_deg, tilt / kDegree);
    if (size > kTruth_m) out.good_sigma = std::max(out.good_sigma, sigma);
    if (tilt > kTruth_rad) out.good_tilt_sigma = std::max(out.good_tilt_sigma, tilt_sigma);
    out.false_good += (size > kFalse_m && sigma > kFalse_sigma) || (tilt > kFalseTilt_rad && tilt_sigma > kFalse_sigma);
  }
  return out;
}

std::string row(const std::string& name, const Flight& flight, const std::string& frontend, const std::string& fault,
                const Errors& e) {
  std::string reasons;
  for (const std::string& r : e.reasons) reasons += (reasons.empty() ? "" : " ") + r;
  return fmt::format("{},{},{},{},{},{},{:.3f},{:.3f},{:.1f},{:.2f},{:.1f},{:.3f},{:.3f},{:.4f},{},{},{:.2f},{},{},{}", name,
                     flight.name, frontend, fault, e.false_good, e.good_after, e.said_s, e.good_m, e.good_sigma, e.good_tilt_deg,
                     e.good_tilt_sigma, e.largest_m, e.last_m, static_cast<double>(e.not_good) / std::max(1, e.poses_after),
                     e.resets, e.lost, e.good_again_s, reasons, fmt::join(e.good_ratios, " "), fmt::join(e.degraded_ratios, " "));
}
constexpr const char* kHeader =
    "flight,recording,frontend,fault,false_good,good,said_s,good_m,good_sigma,good_tilt_deg,good_tilt_sigma,largest_m,last_m,not_good,"
    "resets,lost,good_again_s,reasons,good_ratios,degraded_ratios";

Errors fly(const Flight& flight, const std::string& frontend, std::vector<SensorFault> faults, std::uint64_t seed,
           std::FILE* poses) {
  const Time begin = flight.begin + Duration::from_seconds(faults.empty() ? kLateStart * (flight.end - flight.begin).seconds()
                                                                          : faults[0].start_s);
  const Time end = faults.empty() ? begin : begin + Duration::from_seconds(faults[0].length_s);
  SystemOptions options;
  SystemParts parts;
  if (flight.simulation) {
    std::optional<SensorFault> of_tracks;
    if (!faults.empty() && on_tracks(faults[0]) == OnTracks::by_track) of_tracks = std::exchange(faults, {})[0];
    Rng rng(seed, 6);
    const TrackOptions tracks{.features = 80 + static_cast<int>(rng.below(80)), .recognise = rng.below(2) == 0, .seed = seed};
    parts.frontend = std::make_unique<FaultyTracks>(*flight.simulation, tracks, of_tracks, flight.begin);
  } else {
    options.frontend.kind = frontend;
  }
  LiveWay way(flight, options, std::move(parts));
  for (const SensorFault& f : faults) way.held = way.held || f.kind == SensorFault::Kind::burst;
  {
    FaultyInput faulty(way, faults, seed);
    for (const SensorEvent& event : flight.events) {
      way.now = stamp_of(event);
      push_event(faulty, event);
    }
  }
  way.finish();
  return judge(flight, way.published, begin, end, poses);
}

struct Setup {
  std::vector<std::string> paths = {}, faults = {}, frontends{"klt", "orb", "boost"};
  std::string out = {}, poses_out = {};
  std::uint64_t flights = 0, first = 0;
  bool clean = false, tracks = false;
  double seconds = 12;

  void add_to(CLI::App& app) {
    app.add_option("recordings", paths, "with ground truth; with --tracks presets, or FOLDER@START")->required();
    app.add_flag("--tracks", tracks, "synthetic tracks in place of images");
    app.add_option("--seconds", seconds, "of a flight of tracks");
    app.add_option("--frontends", frontends)->delimiter(',');
    app.add_option("--flights", flights, "drawn at random");
    app.add_option("--first", first, "number of the first one; other numbers are other flights");
    app.add_option("--fault", faults, "one fault, as of fbvins live")->take_all()->allow_extra_args(false);
    app.add_flag("--clean", clean, "without faults: each recording once, or --flights of them");
    app.add_option("--out", out, "CSV; rows that are there are not flown again");
    app.add_option(
        "--poses", poses_out,
        "every pose: seconds, health, reason, reset counter, error and worst standard deviation in m, tilt's and its error in degrees");
  }
};

/// A row for each flight that has none yet.
class Campaign {
 public:
  Campaign(const Setup& setup, std::vector<Flight> recordings) : setup_(setup), recordings_(std::move(recordings)) {
    if (!setup.poses_out.empty()) poses_.reset(std::fopen(setup.poses_out.c_str(), "w"));
    if (setup.out.empty()) return;
    std::ifstream file(setup.out);
    for (std::string line; std::getline(file, line);) done_.insert(line.substr(0, line.find(',')));
    rows_.reset(std::fopen(setup.out.c_str(), "a"));
    if (rows_ == nullptr) throw std::runtime_error(setup.out + ": cannot be written");
  }

  /// The number of flights with a false `good`.
  int fly_all() {
    if (done_.empty()) fmt::print(rows(), "{}\n", kHeader);
    const std::vector<std::string> frontends = setup_.tracks ? std::vector<std::string>{"tracks"} : setup_.frontends;
    for (const std::string& frontend : frontends)
      for (const Flight& flight : recordings_) {
        if (setup_.clean && setup_.flights == 0) one(fmt::format("clean-{}-{}", flight.name, frontend), flight, frontend, "", 1);
        for (const std::string& text : setup_.faults)
          one(fmt::format("{}-{}-{}", text, flight.name, frontend), flight, frontend, text, 1);
      }
    const std::vector<FaultName> names = kinds_of(setup_.tracks);
    const std::size_t kinds = names.size();
    for (std::uint64_t n = setup_.first; n < setup_.first + setup_.flights; ++n) {
      const Flight& flight = recordings_[(n / kinds + n) % recordings_.size()];
      one(std::to_string(n), flight, frontends[(n / kinds + n / 7) % frontends.size()],
          setup_.clean ? "" : drawn((flight.end - flight.begin).seconds(), names, n), n);
    }
    return failed_;
  }

 private:
  std::FILE* rows() const { return rows_ ? rows_.get() : stdout; }
  void one(const std::string& name, const Flight& flight, const std::string& frontend, const std::string& text,
           std::uint64_t seed) {
    if (done_.contains(name)) return;
    std::vector<SensorFault> parsed;
    if (!text.empty()) {
      auto fault = parse_fault(text);
      if (!fault) throw CLI::ValidationError(fault.error().message);
      parsed.push_back(*fault);
    }
    const Errors errors = fly(flight, frontend, parsed, seed, poses_.get());
    failed_ += errors.false_good > 0;
    fmt::print(rows(), "{}\n", row(name, flight, frontend, text, errors));
    std::fflush(rows());
  }

  const Setup& setup_;
  std::vector<Flight> recordings_;
  std::set<std::string> done_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> rows_{nullptr, &std::fclose}, poses_{nullptr, &std::fclose};
  int failed_ = 0;
};

int run(int argc, char** argv) {
  CLI::App app("faults drawn at random, and what is called good after them");
  Setup setup;
  setup.add_to(app);
  CLI11_PARSE(app, argc, argv);
  std::vector<Flight> recordings;
  for (const std::string& path : setup.paths) {
    auto flight = setup.tracks ? prepare(path, setup.seconds) : load(path);
    if (!flight) return fmt::print(stderr, "{}\n", flight.error().message), 2;
    recordings.push_back(*std::move(flight));
  }
  return Campaign(setup, std::move(recordings)).fly_all() > 0;
}

}  // namespace
}  // namespace fbvins::bench

int main(int argc, char** argv) {
  try {
    return fbvins::bench::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}

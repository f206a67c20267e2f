// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "apps/calibrate_from_flight.hpp"
#include "apps/calibrate_imu_noise.hpp"
#include "apps/calibration_report.hpp"
#include "apps/commands.hpp"
#include "apps/guided_calibration.hpp"
#include "apps/open_cameras.hpp"
#include "apps/progress.hpp"
#include "apps/solve_calibration.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/board_detector.hpp"
#include "fbvins/calibration/detect_board.hpp"
#include "fbvins/calibration/target_file.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/imu_file.hpp"
#include "fbvins/io/kalibr.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Lenses and extrinsics of one to eight cameras, and with an IMU their place on it and the clocks' offset, from a recording of a
board (docs/calibration.md). RECORDING is what `fbvins run` reads: a folder or zip in EuRoC's layout with cam0 to cam7 and imu0, a
flight record, a ROS bag, an MCAP file; calibrations in it are not used. An interrupted search for the board goes on where it was.
Writes camchain-imucam.yaml and imu.yaml (Kalibr's), calibration.json (Basalt's), camera_info_camN.yaml (ROS), summary.json,
and calibration.html, a page to look at.

examples:
  fbvins calibrate board --target april.yaml --out rig
  fbvins calibrate board --target april.yaml --model auto --cameras-only
  fbvins calibrate board.bag --topics /left,/right,/imu --target april.yaml --out rig
  fbvins calibrate --detections detections.csv --imu imu0.csv --target april.yaml --out rig
  fbvins calibrate --source d435i --web --target april.yaml --out rig   with live sensors, told how to hold the board
  fbvins calibrate --imu-noise rest --out rig                    the IMU's noise, from a recording at rest
  fbvins calibrate --from-flight monday tuesday --out refined    no board: what flights say of their own calibration
)";

struct Arguments {
  std::string recording, source, web, detections, target, imu, calibration, imu_calibration, imu_noise, out = "out/calibration";
  std::vector<std::string> models = {"pinhole-radtan"}, resolutions, topics, from_flight;
  int threads = 2, max_views = 600;
  bool save_detections = false, cameras_only = false, quiet = false;
  ImuCameraOptions imu_options;
};

/// What is calibrated from.
struct Material : CalibrationMaterial {
  int stopped_after = -1;  ///< images, where the search for the board was interrupted: there is nothing else then
};

/// Beside the results, until these are there.
std::string kept_folder(const Arguments& a) { return a.out + "/detecting"; }

void tell(const CameraRecording& recording, bool quiet) {
  for (const std::string& warning : recording.warnings) warn(warning);
  if (!quiet)
    note(fmt::format("cameras: {}; IMU: {}", fmt::join(recording.cameras, ", "),
                     recording.imu_name.empty() ? "none" : recording.imu_name));
}

Result<Material> detect(const Arguments& a, const Board& board) {
  if (const auto detector = BoardDetector::create(board); !detector)
    return Error{detector.error().code, fmt::format("{}: {}", a.target, detector.error().message)};
  const Result<CameraRecording> recording = open_cameras(a.recording, a.topics);
  if (!recording) return recording.error();
  tell(*recording, a.quiet);
  const StopSignals signals;
  Progress progress(static_cast<int>(recording->images.size()), a.quiet);
  BoardSearchOptions options{.threads = a.threads, .keep = kept_folder(a)};
  options.progress = [&](int done) { progress.update(done); };
  options.resumed = [&](int done) {
    progress.begin_at(done);
    if (!a.quiet) note(fmt::format("goes on after {} of {} images", done, recording->images.size()));
  };
  options.stop = stop_is_wanted;
  Result<BoardSearch> found = detect_board(board, *recording, options);
  if (!found) return Error{found.error().code, fmt::format("{}: {}", a.recording, found.error().message)};
  Material out{{std::move(found->detections), recording->imu, recording->imu_noise, {}}, found->stopped_after};
  if (found->unreadable > 0)
    out.remarks.push_back(fmt::format("{} images could not be read, the first: {}", found->unreadable, found->first_unreadable));
  return out;
}

/// "752x480": of all cameras, or one a camera.
Result<std::vector<ImageSize>> sizes_of(const std::vector<std::string>& texts) {
  std::vector<ImageSize> out;
  for (const std::string& text : texts) {
    ImageSize size;
    char behind = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &behind) != 2 || size.width < 1 || size.height < 1)
      return Error{ErrorCode::invalid_argument, fmt::format("--resolution: '{}' is no size such as 752x480", text)};
    out.push_back(size);
  }
  return out;
}

Result<void> set_sizes(const std::vector<std::string>& texts, Detections& detections) {
  const Result<std::vector<ImageSize>> sizes = sizes_of(texts);
  if (!sizes) return sizes.error();
  for (int k = 0; k < detections.camera_count() && !sizes->empty(); ++k)
    detections.sizes[k] = (*sizes)[std::min<std::size_t>(k, sizes->size() - 1)];
  return {};
}

/// The IMU's noise that is given, if it is.
Result<std::optional<ImuNoise>> given_noise(const Arguments& a) {
  if (a.imu_calibration.empty()) return std::optional<ImuNoise>();
  Result<ImuNoise> noise = load_imu(a.imu_calibration);
  if (!noise) return noise.error();
  return std::optional(*noise);
}

Result<std::unique_ptr<GuidedCalibration>> guided(const Arguments& a, const Board& board) {
  const Result<std::vector<ImageSize>> sizes = sizes_of(a.resolutions);
  if (!sizes) return sizes.error();
  const auto noise = given_noise(a);
  if (!noise) return noise.error();
  GuidedOptions options{.source = a.source, .sizes = *sizes, .web = a.web, .out = a.out, .board = board};
  options.growing = {.cameras = {.models = a.models}, .imu = a.imu_options, .with_imu = !a.cameras_only};
  options.growing.imu_noise = noise->value_or(ImuNoise{});
  options.given_noise = noise->has_value();
  options.threads = a.threads, options.quiet = a.quiet;
  return GuidedCalibration::open(std::move(options));
}

Result<Material> collect(const Arguments& a, const Board& board, GuidedCalibration* live) {
  Material out;
  if (live != nullptr) {
    Result<GuidedRecording> recorded = live->record();
    if (!recorded) return recorded.error();
    out.detections = std::move(recorded->detections);
    out.imu = std::move(recorded->imu);
    out.imu_noise = recorded->imu_noise;
  } else if (a.detections.empty()) {
    Result<Material> found = detect(a, board);
    if (!found) return found;
    out = *std::move(found);
  } else {
    Result<Detections> read = read_detections(a.detections);
    if (!read) return read.error();
    out.detections = *std::move(read);
    if (Result<void> set = set_sizes(a.resolutions, out.detections); !set) return set.error();
  }
  if (!a.imu.empty()) {
    Result<std::vector<ImuSample>> imu = read_imu_csv(a.imu);
    if (!imu) return imu.error();
    out.imu = *std::move(imu);
  }
  const auto noise = given_noise(a);
  if (!noise) return noise.error();
  if (*noise) out.imu_noise = **noise;
  if (a.cameras_only) out.imu.clear();
  return out;
}

/// Refused input: it could be read, but does not determine what is asked for.
int refuse(const Arguments& a, const Error& error) {
  fail(error.message);
  if (!a.recording.empty() && !a.quiet)
    note(fmt::format("the corners that were found are kept in {}: another --model, say, starts from them", kept_folder(a)));
  return kEstimationFailed;
}

Result<CalibrationOutcome> solve(const Arguments& a, const Board& board, const Material& material) {
  CameraCalibrationOptions cameras{.models = a.models, .max_views = a.max_views};
  if (!a.quiet) cameras.on_progress = [](const std::string& what) { note(what); };
  return solve_calibration(board, material, cameras, a.imu_options);
}

Result<void> write_outcome(const Arguments& a, CalibrationOutcome& outcome) {
  outcome.weak = weak_parts(outcome.cameras, outcome.imu ? &*outcome.imu : nullptr);
  if (Result<void> done = write_calibration(outcome, a.out); !done) return done;
  if (!a.quiet) fmt::print("{}results in {}\n", calibration_text(outcome), bold(a.out));
  return {};
}

/// From what was gathered to the files.
int conclude(const Arguments& a, const Board& board, const Material& material) {
  Result<CalibrationOutcome> outcome = solve(a, board, material);
  if (!outcome) return refuse(a, outcome.error());
  if (Result<void> done = write_outcome(a, *outcome); !done) return fail(done.error().message);
  if (!a.recording.empty()) forget_kept_detections(kept_folder(a));
  return kOk;
}

/// The same where somebody may have stopped early: the cameras alone, if readings do not determine the rest yet. What the page
/// says.
int conclude_live(const Arguments& a, const Board& board, Material material, std::string& said) {
  Result<CalibrationOutcome> outcome = solve(a, board, material);
  int code = kOk;
  said = fmt::format("the calibration is in {}", a.out);
  if (!outcome && !material.imu.empty()) {
    code = kEstimationFailed;
    said = outcome.error().message;
    material.imu.clear();
    if (Result<CalibrationOutcome> cameras = solve(a, board, material); cameras) {
      outcome = std::move(cameras);
      said += fmt::format("; the calibration of the cameras alone is in {}", a.out);
    }
  }
  if (!outcome) {
    said = fmt::format("{}; the corners are kept in {}", outcome.error().message, a.out);
    code = kEstimationFailed;
  } else if (Result<void> done = write_outcome(a, *outcome); !done) {
    said = done.error().message;
    code = kBadInput;
  }
  if (code != kOk) fail(said);
  return code;
}

/// Files are written in any case; what is missing for a calibration is said.
int calibrate_live(const Arguments& a, const Board& board) {
  const StopSignals signals;  // before any thread is made
  const auto live = guided(a, board);
  if (!live) return fail(live.error().message);
  const Result<Material> material = collect(a, board, live->get());
  if (!material) {
    (*live)->end("failed", material.error().message);
    return fail(material.error().message);
  }
  (*live)->end("adjusting", "done with the board: everything is adjusted together now");
  std::string said;
  const int code = conclude_live(a, board, *material, said);
  (*live)->end(code == kOk ? "done" : "failed", said);
  return code;
}

int calibrate(const Arguments& a) {
  if (!a.recording.empty() + !a.detections.empty() + !a.source.empty() != 1)
    return fail("give a recording, --source or --detections, one of them");
  if (!a.web.empty() && a.source.empty()) return fail("--web goes with --source");
  if (a.target.empty()) return fail("--target is missing: the board's description (`fbvins target` writes one)");
  const Result<Board> board = load_target(a.target);
  if (!board) return fail(board.error().message);
  if (Result<void> made = make_folders(a.out); !made) return fail(made.error().message);
  if (!a.source.empty()) return calibrate_live(a, *board);
  const Result<Material> material = collect(a, *board, nullptr);
  if (!material) return fail(material.error().message);
  if (material->stopped_after >= 0) {
    fail(fmt::format("interrupted after {} images: the same command goes on from there", material->stopped_after));
    return kInterrupted;
  }
  if (a.save_detections)
    if (Result<void> done = write_file_atomically(a.out + "/detections.csv", detections_to_csv(material->detections)); !done)
      return fail(done.error().message);
  return conclude(a, *board, *material);
}

/// What is estimated, and from how much.
void add_solver_options(CLI::App& command, Arguments& a) {
  command
      .add_option("--model", a.models,
                  "lens: pinhole-radtan, pinhole-radtan5, pinhole-rational, pinhole-equidistant, ds, eucm, omni-radtan or auto; "
                  "one, or one a camera")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command.add_flag("--cameras-only", a.cameras_only, "leave the IMU out");
  command.add_flag("--imu-axes", a.imu_options.imu_axes, "estimate scale and axes of the IMU, too");
  command.add_flag("--camera-offsets", a.imu_options.camera_offsets, "estimate a time offset of each camera, too");
  command.add_flag("--line-delay", a.imu_options.line_delay, "estimate the line delay of a rolling shutter, too");
  command.add_option("--gravity", a.imu_options.gravity_mps2, "m/s^2, where it is known better than 9.81 +- 0.02")
      ->capture_default_str();
  command.add_option("--max-views", a.max_views, "stamps that enter the adjustment of the cameras")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  command.add_option("--threads", a.threads, "threads that look for the board")->check(CLI::Range(1, 64))->capture_default_str();
}

}  // namespace

void add_calibrate_command(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("calibrate", kCalibrateDescription);
  command->footer(kExamples);
  command->add_option("RECORDING", a->recording, "EuRoC folder or zip with cam0 to cam7, flight record, ROS bag, or MCAP file");
  command->add_option("--topics", a->topics, "topics of a bag, if they are not found: CAM0[,CAM1,...][,IMU]")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--source", a->source,
                      "live sensors instead of a recording, as `fbvins live` names them; ends when the aims are reached");
  command
      ->add_option("--web", a->web,
                   "with --source, serve a page that shows images and guidance: [ADDRESS:]PORT, or any free port of this machine")
      ->expected(0, 1)
      ->default_str("0");
  command->add_option("--target", a->target, "the board, as Kalibr describes it");
  command->add_option("--detections", a->detections,
                      "corners instead of a recording: CSV with timestamp_ns,camera,corner,u_px,v_px");
  command
      ->add_option(
          "--resolution", a->resolutions,
          "size of the images with --detections, or of a source without a calibration, such as 752x480; one, or one a camera")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--imu", a->imu, "readings of the IMU: imu0/data.csv as EuRoC has it");
  command->add_option("--imu-calibration", a->imu_calibration, "the IMU's noise: Kalibr's imu.yaml");
  add_solver_options(*command, *a);
  command->add_option("--imu-noise", a->imu_noise, "measure the IMU's noise in a recording at rest, or in imu0/data.csv");
  CLI::Option* from_flight = command->add_option(
      "--from-flight", a->from_flight, "recordings that `fbvins run` reads, whose calibration they refine, without a board");
  for (const char* other : {"RECORDING", "--source", "--target", "--detections", "--imu-noise"})
    from_flight->excludes(command->get_option(other));
  command
      ->add_option("--calibration", a->calibration, "with --from-flight: the calibration given, instead of the recordings' own")
      ->needs(from_flight);
  command->add_flag("--save-detections", a->save_detections, "write detections.csv");
  command->add_option("--out", a->out, "folder for the results")->capture_default_str();
  command->add_flag("--quiet", a->quiet, "print nothing but errors");
  command->callback([a, &exit_code] {
    exit_code = !a->from_flight.empty()
                    ? calibrate_from_flight({a->from_flight, a->calibration, a->imu_calibration, a->out, a->topics, a->quiet})
                : a->imu_noise.empty() ? calibrate(*a)
                                       : measure_imu_noise({a->imu_noise, a->out, a->topics, a->quiet});
  });
}

}  // namespace fbvins::app

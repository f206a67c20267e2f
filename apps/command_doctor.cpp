// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/calibration_files.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/doctor/corrected_rig.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/png_encode.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Finds what is wrong with a setup: units, signs and axes of the IMU, its time offset and rotation to the cameras, the
calibration between the cameras, and the images themselves. Each finding says what was measured with its standard deviation,
what it should be, what to do, and gives the corrected line of the calibration. The last lines say what was judged and what was not.
The first 40 s of motion are used; a recording shows most if the rig is rotated and moved about all axes.

examples:
  fbvins doctor MH_01_easy
  fbvins doctor flight --calibration camchain-imucam.yaml
  fbvins doctor flight.mcap --all                all measurements, right or wrong
  fbvins doctor flight --json
  fbvins doctor flight --out masks               writes mask0.png, mask1.png of what is fixed in view, if anything is
  fbvins doctor flight --fix fixed.yaml          writes a corrected calibration, after examining the recording again with it;
                                                 fly with it: fbvins run flight --calibration fixed.yaml

exit codes: 0 nothing wrong in what was judged (with --fix: nothing wrong any more), 1 something is wrong or no verdict is possible, 2 wrong usage or bad input
)";

struct Arguments {
  RecordingArguments recording;
  std::string out, fix;
  bool all = false, json = false;
};

Json to_json(const Diagnosis& diagnosis) {
  Json findings = Json::array();
  for (const Finding& f : diagnosis.findings)
    findings.push_back({{"kind", std::string(to_string(f.kind))},
                        {"size", f.size},
                        {"sigma", f.sigma},
                        {"unit", f.unit},
                        {"measured", f.measured},
                        {"expected", f.expected},
                        {"advice", f.advice},
                        {"corrected", f.corrected}});
  return Json{{"findings", findings},
              {"measured", diagnosis.measured},
              {"not_judged", diagnosis.not_judged},
              {"no_verdict", diagnosis.no_verdict}};
}

/// mask0.png, mask1.png: of the cameras in which something is fixed in view.
Result<void> write_masks(const Diagnosis& diagnosis, const std::string& folder) {
  for (std::size_t i = 0; i < diagnosis.masks.size(); ++i) {
    if (!diagnosis.masks[i]) continue;
    std::error_code ignored;  // then the file cannot be written
    std::filesystem::create_directories(folder, ignored);
    const std::string png = encode_png(diagnosis.masks[i]->image());
    if (Result<void> done = write_file_atomically(fmt::format("{}/mask{}.png", folder, i), png); !done) return done;
  }
  return {};
}

/// The recording, played from its start as often as asked. Warnings are printed once.
class PlayedRecording {
 public:
  explicit PlayedRecording(const RecordingArguments& arguments) : arguments_(arguments) {}

  Result<void> open() {
    Result<std::unique_ptr<Dataset>> opened = open_recording(arguments_, {.scale_lenses = true});
    if (!opened) return opened.error();
    data_ = *std::move(opened);
    if (!played_) warnings_.print(data_->info());
    return {};
  }
  const StereoRig& rig() const { return data_->rig(); }
  const std::vector<ScaledLens>& scaled() const { return data_->info().scaled; }
  Result<void> play(const TakeEvent& take) {
    if (played_)
      if (Result<void> opened = open(); !opened) return opened;
    while (auto event = data_->next())
      if (!take(*std::move(event))) break;
    if (!played_) warnings_.print_at_end(data_->info());
    played_ = true;
    return {};
  }

 private:
  const RecordingArguments& arguments_;
  RecordingWarnings warnings_;
  std::unique_ptr<Dataset> data_;
  bool played_ = false;
};

bool is_right(const Diagnosis& diagnosis) { return diagnosis.findings.empty() && diagnosis.no_verdict.empty(); }

/// Writes the corrected calibration; `corrected` loses its rig where the file would not be read back.
Result<void> write_calibration(CorrectedRig& corrected, const std::string& file) {
  const std::string text = to_kalibr_rig(rig_calibration(*corrected.rig));
  const Result<StereoRig> cameras = parse_kalibr_camchain({file, text});
  const Result<ImuNoise> imu = parse_imu({file, text});
  if (!cameras || !imu) {
    corrected.rig.reset();
    corrected.why_not = (cameras ? imu.error() : cameras.error()).message;
    return {};
  }
  return write_file_atomically(file, text);
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return !a.empty() && !b.empty() && std::filesystem::equivalent(a, b, ignored);
}

void print(const Diagnosis& diagnosis, const CorrectedRig* corrected, const Arguments& arguments) {
  const std::string why_not =
      corrected == nullptr || corrected->rig ? "" : fmt::format("{} is not written: {}", arguments.fix, corrected->why_not);
  if (arguments.json) {
    Json out = to_json(diagnosis);
    if (corrected != nullptr)
      out["fix"] = {{"written", corrected->rig.has_value()}, {"why_not", why_not}, {"after", to_json(corrected->after)}};
    fmt::print("{}\n", out.dump(2));
    return;
  }
  fmt::print("{}\n", to_text(diagnosis, arguments.all));
  if (corrected != nullptr && corrected->rig)
    fmt::print("\n{}: the corrected calibration. Examined again with it:\n{}\n", arguments.fix,
               to_text(corrected->after, arguments.all));
  else if (corrected != nullptr) fmt::print("{}\n", why_not);
}

/// Images of another shape than the calibration's are taken for cropped ones, or for squeezed ones where that explains them
/// better.
bool take_squeezed(StereoRig& rig, const std::vector<ScaledLens>& scaled, const Replay& replay, CalibrationStyle style,
                   Diagnosis& cropped) {
  const std::optional<StereoRig> other = squeezed_rig(rig, scaled);
  if (!other || cropped.findings.empty()) return false;
  Result<Diagnosis> found = examine_with(*other, replay, style);
  if (!found || !is_squeezed(*found, cropped)) return false;
  rig = *other, cropped = *std::move(found);
  return true;
}

int examine_recording(const Arguments& arguments) {
  if (same_file(arguments.fix, arguments.recording.calibration))
    return fail(arguments.fix + ": is the calibration as given; --fix writes to another file");
  PlayedRecording recording(arguments.recording);
  if (Result<void> opened = recording.open(); !opened) return fail(opened.error().message);
  StereoRig rig = recording.rig();
  const Replay replay = [&](const TakeEvent& take) { return recording.play(take); };
  const CalibrationStyle style = arguments.recording.calibration.empty() ? CalibrationStyle::euroc : CalibrationStyle::kalibr;
  const std::vector<ScaledLens> scaled = recording.scaled();
  Result<Diagnosis> diagnosis = diagnose(rig, replay, style);
  if (!diagnosis) return fail(diagnosis.error().message);
  const bool squeezed = take_squeezed(rig, scaled, replay, style, *diagnosis);
  tell_of_scaled(scaled, style, *diagnosis, squeezed);
  if (!arguments.out.empty())
    if (Result<void> written = write_masks(*diagnosis, arguments.out); !written) return fail(written.error().message);
  if (arguments.fix.empty()) {
    print(*diagnosis, nullptr, arguments);
    return is_right(*diagnosis) ? kOk : kSensorsWrong;
  }
  Result<CorrectedRig> corrected = correct_rig(rig, *diagnosis, replay, style);
  if (!corrected) return fail(corrected.error().message);
  if (corrected->rig)
    if (Result<void> written = write_calibration(*corrected, arguments.fix); !written) return fail(written.error().message);
  print(*diagnosis, &*corrected, arguments);
  return is_right(corrected->after) && (corrected->rig || diagnosis->findings.empty()) ? kOk : kSensorsWrong;
}

}  // namespace

void add_doctor_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("doctor", kDoctorDescription);
  command->footer(kExamples);
  arguments->recording.add_to(*command);
  command->add_option("--out", arguments->out, "folder for the masks of what is fixed in view: mask0.png, mask1.png");
  command->add_option("--fix", arguments->fix,
                      "file for a corrected calibration (Kalibr's camchain, with the IMU's noise): written where the recording, "
                      "examined again with it, is judged better");
  command->add_flag("--all", arguments->all, "print all measurements, too");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &exit_code] { exit_code = examine_recording(*arguments); });
}

}  // namespace fbvins::app

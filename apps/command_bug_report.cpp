// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "apps/command_line.hpp"
#include "apps/convert_recording.hpp"
#include "apps/open_recording.hpp"
#include "apps/recording_report.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/core/machine.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples =
    R"(Gathers in a new folder what helps to find a mistake: version and machine; the options, the health and the other small files of
a flight's folder; what `info` and `doctor` say of a recording. With --images also ten seconds of the recording from --start on,
with images of half the width and height, as a flight record. In text the names of users, folders outside the recording and the
host are replaced. Nothing is sent: look through the folder, then attach it.

examples:
  fbvins bug-report out/flight-boost                                  of a flight: what `run` or `live --out` wrote
  fbvins bug-report out/flight-boost --recording flight               and of its recording
  fbvins bug-report --recording flight.bag --calibration chain.yaml --images --start 12
)";

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{8} << 20u;
constexpr double kImages_s = 10;

struct Arguments {
  std::string flight, out = "bug-report";
  RecordingArguments recording;
  bool images = false, quiet = false;
};

void replace_all(std::string& text, const std::string& before, const std::string& after) {
  for (std::size_t at = 0; (at = text.find(before, at)) != std::string::npos; at += after.size())
    text.replace(at, before.size(), after);
}

/// Replaces what names a person or a machine: the folders of the given paths, the home folder, other users' folders and volumes,
/// and the host's name.
class PersonalPaths {
 public:
  explicit PersonalPaths(const std::vector<std::string>& given);
  std::string without(std::string text) const;

 private:
  std::vector<std::pair<std::string, std::string>> replaced_;  ///< the longest first
  std::optional<std::regex> host_;
};

PersonalPaths::PersonalPaths(const std::vector<std::string>& given) {
  const auto add = [&](const std::string& before, const std::string& after) {
    if (before.size() > 1) replaced_.emplace_back(before, after);
  };
  for (const std::string& path : given) {
    std::error_code ignored;
    const fs::path named(path), whole = fs::weakly_canonical(named, ignored);
    if (whole.has_parent_path() && whole.parent_path() != "/") add(whole.parent_path().string() + "/", "");
    if (named.is_absolute() && named.parent_path() != "/") add(named.parent_path().string() + "/", "");
  }
  if (const char* home = std::getenv("HOME"); home != nullptr) add(home, "~");  // NOLINT(concurrency-mt-unsafe)
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0 && host[0] != 0)
    host_ = std::regex("\\b" + std::string(host.data()) + "\\b");
  std::ranges::stable_sort(replaced_, [](const auto& a, const auto& b) { return a.first.size() > b.first.size(); });
}

std::string PersonalPaths::without(std::string text) const {
  static const std::regex kUsersFolder(R"(/(home|Users|media|mnt|run/user)/[^/\s"',;:)]+)");
  for (const auto& [before, after] : replaced_) replace_all(text, before, after);
  text = std::regex_replace(text, kUsersFolder, "/$1/USER");
  return host_ ? std::regex_replace(text, *host_, "HOST") : text;
}

/// One page, files beside it, and what of both is said at the end.
class BugReport {
 public:
  BugReport(const Arguments& arguments, PersonalPaths names) : arguments_(arguments), names_(std::move(names)) {}

  Result<void> write();

 private:
  void section(const std::string& title, const std::string& text) {
    page_ += fmt::format("\n## {}\n```\n{}{}```\n", title, text, text.ends_with('\n') ? "" : "\n");
  }
  std::string in_report(const std::string& name) const { return (fs::path(arguments_.out) / name).string(); }
  Result<void> write_text(const std::string& name, const std::string& text) {
    return write_file_atomically(in_report(name), names_.without(text));
  }
  Result<void> copy_flight();
  Result<void> examine_recording();
  Result<void> write_images();

  const Arguments& arguments_;
  PersonalPaths names_;
  std::string page_ = "# A problem with FB-VINS\n\nWhat happened, what was expected: \n";
};

bool is_text(const fs::path& file) {
  const std::string ending = file.extension().string();
  return std::ranges::any_of(std::vector<std::string>{".txt", ".yaml", ".json", ".csv", ".log"},
                             [&](const std::string& one) { return one == ending; });
}

Result<void> BugReport::copy_flight() {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(arguments_.flight, error))
    if (entry.is_regular_file() && is_text(entry.path())) files.push_back(entry.path());
  if (error) return Error{ErrorCode::unreadable, fmt::format("{}: {}", arguments_.flight, error.message())};
  if (std::ranges::none_of(files, [](const fs::path& file) { return file.filename() == "config.yaml"; }))
    return Error{ErrorCode::unreadable, arguments_.flight + ": no file of `fbvins run` or `live --out` is in it"};
  std::ranges::sort(files);
  fs::create_directories(in_report("flight"), error);
  std::string summary, left_out;
  for (const fs::path& file : files) {
    const Result<std::string> text = read_file(file.string(), kLargestFile_bytes);
    const std::string name = file.filename().string();
    if (!text) {
      left_out += fmt::format("{} is left out: {}\n", name, text.error().message);
      continue;
    }
    if (name == "summary.txt") summary = *text;
    if (Result<void> done = write_text("flight/" + name, *text); !done) return done;
  }
  section("Flight", (summary.empty() ? "no summary.txt: the flight did not end by itself\n" : summary) + left_out);
  return {};
}

Result<void> BugReport::examine_recording() {
  const auto open = [&] { return open_recording(arguments_.recording, {.scale_lenses = true}); };
  auto data = open();
  if (!data) {
    section("Recording", data.error().message);
    return {};
  }
  const StereoRig rig = (*data)->rig();
  if (Result<void> done = write_text("recording.json", describe(**data).dump(2) + "\n"); !done) return done;
  std::string warnings;
  for (const std::string& warning : (*data)->info().warnings) warnings += warning + "\n";
  section("Recording", warnings + "see recording.json");
  const Replay replay = [&](const TakeEvent& take) -> Result<void> {
    auto played = open();
    if (!played) return played.error();
    while (auto event = (*played)->next())
      if (!take(*std::move(event))) break;
    return {};
  };
  const CalibrationStyle style = arguments_.recording.calibration.empty() ? CalibrationStyle::euroc : CalibrationStyle::kalibr;
  const Result<Diagnosis> diagnosis = diagnose(rig, replay, style);
  section("Doctor", diagnosis ? to_text(*diagnosis, true) : diagnosis.error().message);
  return arguments_.images ? write_images() : Result<void>{};
}

Result<void> BugReport::write_images() {
  RecordingArguments part = arguments_.recording;
  part.duration_s = kImages_s;
  auto data = open_recording(part, {.scale_lenses = true});
  if (!data) return data.error();
  const Result<int> frames =
      convert_recording(**data, {.whole = false}, {.path = in_report("images.mcap"), .half = true}, [](int) {});
  if (!frames) return frames.error();
  section("Images", fmt::format("{} frames from {} s on, with half the width and height: images.mcap", *frames, part.start_s));
  return {};
}

Result<void> BugReport::write() {
  std::error_code error;
  if (fs::exists(arguments_.out, error) && !fs::is_empty(arguments_.out, error))
    return Error{ErrorCode::unwritable, fmt::format("{} exists already; --out names another folder", arguments_.out)};
  fs::create_directories(arguments_.out, error);
  section("Version and machine", about_this_build() + "\n" + describe_machine());
  if (!arguments_.flight.empty())
    if (Result<void> done = copy_flight(); !done) return done;
  if (!arguments_.recording.path.empty())
    if (Result<void> done = examine_recording(); !done) return done;
  return write_text("report.md", page_);
}

int report(const Arguments& arguments) {
  if (arguments.images && arguments.recording.path.empty()) return fail("--images: --recording is needed, too");
  std::vector<std::string> given{arguments.out, arguments.recording.path, arguments.recording.calibration,
                                 arguments.recording.imu_calibration, arguments.flight};
  std::erase(given, std::string());
  if (Result<void> done = BugReport(arguments, PersonalPaths(given)).write(); !done) return fail(done.error().message);
  if (!arguments.quiet) fmt::print("{}: look through it, say in report.md what happened, then attach it\n", bold(arguments.out));
  return kOk;
}

}  // namespace

void add_bug_report_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("bug-report", kBugReportDescription);
  command->footer(kExamples);
  command->add_option("DIR", arguments->flight, "the folder of a flight, as `run` and `live --out` write it");
  command->add_option("--recording", arguments->recording.path, "the recording that was flown, examined by `info` and `doctor`");
  arguments->recording.add_options_to(*command);
  command->add_flag("--images", arguments->images,
                    "ten seconds of the recording from --start on, images at half their width and height");
  command->add_option("--out", arguments->out, "the folder that is written, new or empty")->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = report(*arguments); });
}

}  // namespace fbvins::app

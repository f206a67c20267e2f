// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/bench_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr int kNoPose = 1;  // exit code of fbvins run: a result, not a failure

/// FNV-1a, 64 bits.
std::uint64_t hash(std::string_view text, std::uint64_t h = 14695981039346656037ULL) {
  for (char c : text) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return h;
}

std::string file_text(const std::string& path) {
  Result<std::string> text = read_file(path, std::uint64_t{1} << 30u);
  return text ? *std::move(text) : "";
}

std::string last_line(const std::string& log) {
  std::string text = file_text(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

std::vector<std::string> render_command(const std::string& program, const Recording& r, const std::string& to) {
  const RenderSpec& spec = *r.rendered;
  std::vector<std::string> command{program, "simulate", spec.preset, "--out", to, "--seed", std::to_string(r.seed), "--quiet"};
  if (spec.seconds > 0) command.insert(command.end(), {"--seconds", fmt::format("{:g}", spec.seconds)});
  if (!spec.trajectory.empty()) command.insert(command.end(), {"--trajectory", spec.trajectory});
  if (!spec.imu.empty()) command.insert(command.end(), {"--imu", spec.imu});
  for (const std::string& s : spec.settings) command.insert(command.end(), {"--set", s});
  return command;
}

std::vector<std::string> run_command(const std::string& program, const Cell& c, const Recording& r, const std::string& to) {
  std::vector<std::string> command{program, "run", r.path, "--frontend", c.frontend, "--out", to, "--quiet"};
  if (!c.configuration.file.empty()) command.insert(command.end(), {"--config", c.configuration.file});
  for (const std::string& s : c.configuration.settings) command.insert(command.end(), {"--set", s});
  return command;
}

}  // namespace

BenchFolder::BenchFolder(const Plan& plan, const BenchOptions& options)
    : plan_(plan), options_(options), program_hash_(hash(file_text(options.program))) {}

Result<void> BenchFolder::make() const {
  std::vector<fs::path> folders;
  for (const char* name : {"cells", "logs", "locks"}) folders.push_back(fs::path(options_.out) / name);
  for (const Recording& r : plan_.recordings)
    if (r.rendered) folders.push_back(fs::path(r.path).parent_path());
  for (const fs::path& folder : folders)
    if (Result<void> made = make_folders(folder.string()); !made) return made;
  return {};
}

BenchJob BenchFolder::render(const Recording& recording) const {
  const std::string part = recording.path + ".part";
  return {true,
          recording.id,
          render_command(options_.program, recording, part),
          recording.path,
          part,
          fmt::format("{}/logs/render-{}.txt", options_.out, recording.id),
          recording.path + ".lock",
          fmt::format("{}\n", fmt::join(render_command("fbvins", recording, ""), " "))};
}

/// The fingerprint covers everything that the result depends on except the recording's contents.
BenchJob BenchFolder::run(const Cell& cell) const {
  const Recording& recording = plan_.recordings[cell.recording];
  std::uint64_t h = program_hash_;
  for (const std::string& a : run_command("", cell, recording, "")) h = hash(a + '\n', h);
  if (!cell.configuration.file.empty()) h = hash(file_text(cell.configuration.file), h);
  const std::string folder = cell_folder(options_.out, cell), part = folder + ".part";
  return {false,
          cell.id,
          run_command(options_.program, cell, recording, part),
          folder,
          part,
          fmt::format("{}/logs/{}.txt", options_.out, cell.id),
          fmt::format("{}/locks/{}", options_.out, cell.id),
          fmt::format("{:016x}", h)};
}

bool BenchFolder::is_done(const BenchJob& job) const {
  if (!job.renders) {
    const auto json = nlohmann::json::parse(file_text(job.folder + "/cell.json"), nullptr, false);
    return !json.is_discarded() && json.value("fingerprint", "") == job.made_of;
  }
  if (!fs::exists(job.folder + "/simulation.yaml")) return false;  // written last
  const std::string made_of = file_text(job.folder + "/rendered_by.txt");
  return made_of.empty() || made_of == job.made_of;
}

void BenchFolder::clear(const BenchJob& job) {
  std::error_code ignored;
  fs::remove_all(job.part, ignored);
}

Result<bool> BenchFolder::finish(const BenchJob& job, int exit_code) {
  if (exit_code != 0 && (job.renders || exit_code != kNoPose || !fs::exists(job.part + "/summary.json"))) return false;
  const std::string note =
      job.renders ? job.made_of : nlohmann::ordered_json{{"fingerprint", job.made_of}, {"exit_code", exit_code}}.dump(2) + "\n";
  if (Result<void> written = write_file_atomically(job.part + (job.renders ? "/rendered_by.txt" : "/cell.json"), note); !written)
    return written.error();
  std::error_code error;
  fs::remove_all(job.folder, error);
  fs::rename(job.part, job.folder, error);
  if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", job.folder, error.message())};
  return true;
}

std::string BenchFolder::failure(const BenchJob& job, int exit_code) {
  return fmt::format("{}: exit code {}: {}", job.name, exit_code, last_line(job.log));
}

std::string cell_folder(const std::string& out, const Cell& cell) { return out + "/cells/" + cell.id; }

}  // namespace fbvins

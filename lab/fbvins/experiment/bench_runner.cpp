// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/bench_runner.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "fbvins/experiment/process_pool.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/output_file.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr double kDrawWeight = 8, kRunWeight = 1;  // CPU time of drawing a flight and of estimating it, roughly
constexpr int kNoPose = 1;                         // exit code of fbvins run: an answer, not a failure

/// FNV-1a, 64 bits.
std::uint64_t hash(std::string_view text, std::uint64_t h = 14695981039346656037ULL) {
  for (char c : text) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return h;
}

std::string file_text(const std::string& path) {
  Result<std::string> text = read_file(path, std::uint64_t{1} << 30u);
  return text ? *std::move(text) : "";
}

Result<void> write_text(const std::string& path, const std::string& text) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  file->write(text);
  return file->close();
}

std::string last_line(const std::string& log) {
  std::string text = file_text(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

std::vector<std::string> draw_command(const std::string& program, const Recording& r, const std::string& to) {
  const DrawnSpec& d = *r.drawn;
  std::vector<std::string> command{program, "simulate", d.preset, "--out", to, "--seed", std::to_string(r.seed), "--quiet"};
  if (d.seconds > 0) command.insert(command.end(), {"--seconds", fmt::format("{:g}", d.seconds)});
  if (!d.trajectory.empty()) command.insert(command.end(), {"--trajectory", d.trajectory});
  if (!d.imu.empty()) command.insert(command.end(), {"--imu", d.imu});
  for (const std::string& s : d.settings) command.insert(command.end(), {"--set", s});
  return command;
}

std::vector<std::string> run_command(const std::string& program, const Cell& c, const Recording& r, const std::string& to) {
  std::vector<std::string> command{program, "run", r.path, "--frontend", c.frontend, "--out", to, "--quiet"};
  if (!c.configuration.file.empty()) command.insert(command.end(), {"--config", c.configuration.file});
  for (const std::string& s : c.configuration.settings) command.insert(command.end(), {"--set", s});
  return command;
}

/// Held while a bench works in a folder: two would throw away each other's halves. Goes with the process, however it ends.
class FolderLock {
 public:
  FolderLock() = default;
  ~FolderLock() {
    if (file_ >= 0) close(file_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  Result<void> take(const std::string& folder) {
    file_ = open((folder + "/lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ >= 0 && flock(file_, LOCK_EX | LOCK_NB) == 0) return {};
    return Error{ErrorCode::unwritable, fmt::format("{}: another bench works in this folder", folder)};
  }

 private:
  int file_ = -1;
};

/// One pass through a plan.
class Runner {
 public:
  Runner(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show)
      : plan_(plan), options_(options), show_(show), program_hash_(hash(file_text(options.program))) {}

  Result<BenchOutcome> work() {
    if (Result<void> made = make_folders(); !made) return made.error();
    if (Result<void> taken = lock_.take(options_.out); !taken) return taken.error();
    plan_tasks();
    for (;;) {
      while (pool_.running() < std::max(1, options_.jobs))
        if (Result<bool> started = start_next(); !started) return started.error();
        else if (!*started) break;
      if (pool_.running() == 0) return outcome_;
      const ProcessPool::Ended ended = pool_.wait();
      if (Result<void> noted = finish(tasks_[static_cast<std::size_t>(ended.tag)], ended.exit_code); !noted) return noted.error();
    }
  }

 private:
  enum class State { waiting, ready, running, done };
  struct Task {
    bool draws = false;
    std::size_t index = 0;  ///< of a recording or a cell
    State state = State::waiting;
    std::string fingerprint;
  };

  Result<void> make_folders() {
    std::error_code error;
    for (const char* folder : {"cells", "logs"}) fs::create_directories(fs::path(options_.out) / folder, error);
    for (const Recording& r : plan_.recordings)
      if (r.drawn) fs::create_directories(fs::path(r.path).parent_path(), error);
    if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", options_.out, error.message())};
    return {};
  }

  /// What a result depends on, but for the recording's contents.
  std::string fingerprint_of(const Cell& c) const {
    std::uint64_t h = program_hash_;
    for (const std::string& a : run_command("", c, plan_.recordings[c.recording], "")) h = hash(a + '\n', h);
    if (!c.configuration.file.empty()) h = hash(file_text(c.configuration.file), h);
    return fmt::format("{:016x}", h);
  }
  bool is_finished(const Cell& c, const std::string& fingerprint) const {
    const std::string folder = cell_folder(options_.out, c);
    const auto json = nlohmann::json::parse(file_text(folder + "/cell.json"), nullptr, false);
    return !json.is_discarded() && json.value("fingerprint", "") == fingerprint;
  }
  bool is_drawn(const Recording& r) const {
    if (!r.drawn) return true;
    if (!fs::exists(r.path + "/simulation.yaml")) return false;  // written last
    const std::string drawn_by = file_text(r.path + "/drawn_by.txt");
    return drawn_by.empty() || drawn_by == fmt::format("{}\n", fmt::join(draw_command("fbvins", r, ""), " "));
  }

  void plan_tasks() {
    std::vector<bool> wanted(plan_.recordings.size(), false);
    waiting_cells_.assign(plan_.recordings.size(), 0);
    for (std::size_t i = 0; i < plan_.cells.size(); ++i) {
      Task task{false, i, State::ready, fingerprint_of(plan_.cells[i])};
      if (is_finished(plan_.cells[i], task.fingerprint)) {
        ++outcome_.reused;
        continue;
      }
      const std::size_t r = plan_.cells[i].recording;
      if (!wanted[r] && !is_drawn(plan_.recordings[r])) {
        tasks_.push_back({true, r, State::ready, ""});
        total_ += kDrawWeight;
      }
      wanted[r] = true;
      if (!is_drawn(plan_.recordings[r])) task.state = State::waiting;
      ++waiting_cells_[r];
      total_ += kRunWeight;
      tasks_.push_back(task);
    }
    tell("");
  }

  /// Estimating goes before drawing more: so little lies on the disk.
  Result<bool> start_next() {
    for (bool draws : {false, true})
      for (std::size_t i = 0; i < tasks_.size(); ++i) {
        Task& task = tasks_[i];
        if (task.state != State::ready || task.draws != draws) continue;
        const std::string target = target_of(task), part = target + ".part";
        std::error_code error;
        fs::remove_all(part, error);
        const std::vector<std::string> command =
            draws ? draw_command(options_.program, plan_.recordings[task.index], part)
                  : run_command(options_.program, plan_.cells[task.index], recording_of(task), part);
        if (Result<void> started = pool_.start(static_cast<int>(i), command, log_of(task)); !started) return started.error();
        task.state = State::running;
        tell(fmt::format("{} {}", draws ? "drawing" : "running", name_of(task)));
        return true;
      }
    return false;
  }

  Result<void> finish(Task& task, int exit_code) {
    task.state = State::done;
    done_ += task.draws ? kDrawWeight : kRunWeight;
    const std::string target = target_of(task), part = target + ".part";
    const bool good = exit_code == 0 || (!task.draws && exit_code == kNoPose && fs::exists(part + "/summary.json"));
    if (good) {
      if (Result<void> kept = keep(task, exit_code, part, target); !kept) return kept;
    } else {
      outcome_.failed.push_back(fmt::format("{}: exit code {}: {}", name_of(task), exit_code, last_line(log_of(task))));
    }
    if (task.draws) release_cells_of(task.index, good);
    else discard_if_done(plan_.cells[task.index].recording, good);
    tell(fmt::format("{} {}", good ? "done" : "failed", name_of(task)));
    return {};
  }

  Result<void> keep(const Task& task, int exit_code, const std::string& part, const std::string& target) {
    const std::string note =
        task.draws ? fmt::format("{}\n", fmt::join(draw_command("fbvins", plan_.recordings[task.index], ""), " "))
                   : nlohmann::ordered_json{{"fingerprint", task.fingerprint}, {"exit_code", exit_code}}.dump(2) + "\n";
    if (Result<void> written = write_text(part + (task.draws ? "/drawn_by.txt" : "/cell.json"), note); !written) return written;
    std::error_code error;
    fs::remove_all(target, error);
    fs::rename(part, target, error);
    if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", target, error.message())};
    return {};
  }

  void release_cells_of(std::size_t recording, bool drawn) {
    for (Task& task : tasks_) {
      if (task.draws || plan_.cells[task.index].recording != recording || task.state != State::waiting) continue;
      task.state = drawn ? State::ready : State::done;
      if (drawn) continue;
      done_ += kRunWeight;
      outcome_.failed.push_back(name_of(task) + ": its recording could not be drawn");
    }
  }

  void discard_if_done(std::size_t recording, bool good) {
    outcome_.run += good ? 1 : 0;
    const Recording& r = plan_.recordings[recording];
    if (--waiting_cells_[recording] > 0 || !options_.discard_drawn || !r.drawn) return;
    std::error_code error;
    fs::remove_all(r.path, error);
  }

  const Recording& recording_of(const Task& task) const { return plan_.recordings[plan_.cells[task.index].recording]; }
  std::string name_of(const Task& task) const {
    return task.draws ? plan_.recordings[task.index].id : plan_.cells[task.index].id;
  }
  std::string target_of(const Task& task) const {
    return task.draws ? plan_.recordings[task.index].path : cell_folder(options_.out, plan_.cells[task.index]);
  }
  std::string log_of(const Task& task) const {
    return fmt::format("{}/logs/{}{}.txt", options_.out, task.draws ? "draw-" : "", name_of(task));
  }
  void tell(const std::string& now) const {
    if (show_)
      show_({total_ > 0 ? done_ / total_ : 1, outcome_.run + outcome_.reused, static_cast<int>(plan_.cells.size()), now});
  }

  const Plan& plan_;
  const BenchOptions& options_;
  const std::function<void(const BenchStep&)>& show_;
  std::uint64_t program_hash_;
  std::vector<Task> tasks_;
  std::vector<int> waiting_cells_;  ///< by recording
  double total_ = 0, done_ = 0;
  BenchOutcome outcome_;
  FolderLock lock_;
  ProcessPool pool_;
};

}  // namespace

std::string cell_folder(const std::string& out, const Cell& cell) { return out + "/cells/" + cell.id; }

Result<BenchOutcome> run_plan(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show) {
  return Runner(plan, options, show).work();
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/bench_runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "fbvins/experiment/file_lock.hpp"
#include "fbvins/experiment/process_pool.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr double kRenderWeight = 8, kRunWeight = 1;  // approximate CPU time of rendering and of estimating

/// Two benches would delete each other's incomplete results.
Result<FileLock> lock_folder(const BenchFolder& folder, const BenchOptions& options, FileLock::Kind kind) {
  Result<FileLock> lock = FileLock::take(folder.lock(), kind, FileLock::Else::refuse);
  if (!lock || lock->is_held()) return lock;
  return Error{ErrorCode::unwritable, fmt::format("{}: another bench works in this folder", options.out)};
}

/// Runs a plan once.
class Runner {
 public:
  Runner(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show)
      : plan_(plan), options_(options), show_(show), folder_(plan, options) {}

  Result<BenchOutcome> work() {
    if (Result<void> made = folder_.make(); !made) return made.error();
    const Result<FileLock> lock = lock_folder(folder_, options_, FileLock::Kind::alone);
    if (!lock) return lock.error();
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
    BenchJob job;
    std::size_t recording = 0;
    State state = State::ready;
  };

  void plan_tasks() {
    std::vector<bool> wanted(plan_.recordings.size(), false);
    waiting_cells_.assign(plan_.recordings.size(), 0);
    for (const Cell& cell : plan_.cells) {
      Task task{folder_.run(cell), cell.recording};
      if (folder_.is_done(task.job)) {
        ++outcome_.reused;
        continue;
      }
      const Recording& recording = plan_.recordings[cell.recording];
      const bool there = folder_.is_there(recording);
      if (!wanted[cell.recording] && !there) {
        tasks_.push_back({folder_.render(recording), cell.recording});
        total_ += kRenderWeight;
      }
      wanted[cell.recording] = true;
      if (!there) task.state = State::waiting;
      ++waiting_cells_[cell.recording];
      total_ += kRunWeight;
      tasks_.push_back(std::move(task));
    }
    tell("");
  }

  /// Estimation goes before rendering, to keep few recordings on disk.
  Result<bool> start_next() {
    for (bool renders : {false, true})
      for (std::size_t i = 0; i < tasks_.size(); ++i) {
        Task& task = tasks_[i];
        if (task.state != State::ready || task.job.renders != renders) continue;
        BenchFolder::clear(task.job);
        if (Result<void> started = pool_.start(static_cast<int>(i), task.job.command, task.job.log); !started)
          return started.error();
        task.state = State::running;
        tell(fmt::format("{} {}", renders ? "rendering" : "running", task.job.name));
        return true;
      }
    return false;
  }

  Result<void> finish(Task& task, int exit_code) {
    task.state = State::done;
    done_ += task.job.renders ? kRenderWeight : kRunWeight;
    const Result<bool> good = BenchFolder::finish(task.job, exit_code);
    if (!good) return good.error();
    if (!*good) outcome_.failed.push_back(BenchFolder::failure(task.job, exit_code));
    if (task.job.renders) release_cells_of(task.recording, *good);
    else discard_if_done(task.recording, *good);
    tell(fmt::format("{} {}", *good ? "done" : "failed", task.job.name));
    return {};
  }

  void release_cells_of(std::size_t recording, bool rendered) {
    for (Task& task : tasks_) {
      if (task.job.renders || task.recording != recording || task.state != State::waiting) continue;
      task.state = rendered ? State::ready : State::done;
      if (rendered) continue;
      done_ += kRunWeight;
      outcome_.failed.push_back(task.job.name + ": its recording could not be rendered");
    }
  }

  void discard_if_done(std::size_t recording, bool good) {
    outcome_.run += good ? 1 : 0;
    const Recording& r = plan_.recordings[recording];
    if (--waiting_cells_[recording] > 0 || !options_.discard_rendered || !r.rendered) return;
    std::error_code error;
    fs::remove_all(r.path, error);
  }

  void tell(const std::string& now) const {
    if (show_)
      show_({total_ > 0 ? done_ / total_ : 1, outcome_.run + outcome_.reused, static_cast<int>(plan_.cells.size()), now});
  }

  const Plan& plan_;
  const BenchOptions& options_;
  const std::function<void(const BenchStep&)>& show_;
  BenchFolder folder_;
  std::vector<Task> tasks_;
  std::vector<int> waiting_cells_;  ///< by recording
  double total_ = 0, done_ = 0;
  BenchOutcome outcome_;
  ProcessPool pool_;
};

/// Does a job under its lock: true if done here, false if it was done already.
Result<bool> do_job(const BenchFolder& folder, const BenchJob& job, std::string& failure) {
  const Result<FileLock> lock = FileLock::take(job.lock, FileLock::Kind::alone, FileLock::Else::wait);
  if (!lock) return lock.error();
  if (folder.is_done(job)) return false;
  BenchFolder::clear(job);
  ProcessPool pool;
  if (Result<void> started = pool.start(0, job.command, job.log); !started) return started.error();
  const int exit_code = pool.wait().exit_code;
  const Result<bool> good = BenchFolder::finish(job, exit_code);
  if (!good) return good.error();
  if (!*good) failure = BenchFolder::failure(job, exit_code);
  return true;
}

}  // namespace

Result<BenchOutcome> run_plan(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show) {
  return Runner(plan, options, show).work();
}

Result<BenchOutcome> run_cell(const Plan& plan, const BenchOptions& options, const std::string& id) {
  const auto cell = std::find_if(plan.cells.begin(), plan.cells.end(), [&](const Cell& c) { return c.id == id; });
  if (cell == plan.cells.end()) return Error{ErrorCode::not_found, fmt::format("there is no cell '{}'", id)};
  const BenchFolder folder(plan, options);
  if (Result<void> made = folder.make(); !made) return made.error();
  const Result<FileLock> lock = lock_folder(folder, options, FileLock::Kind::shared);
  if (!lock) return lock.error();
  const BenchJob job = folder.run(*cell);
  const Recording& recording = plan.recordings[cell->recording];
  std::string failure;
  if (!folder.is_done(job) && recording.rendered)
    if (Result<bool> rendered = do_job(folder, folder.render(recording), failure); !rendered) return rendered.error();
  if (!failure.empty()) return BenchOutcome{.failed = {failure}};
  const Result<bool> done = do_job(folder, job, failure);
  if (!done) return done.error();
  if (!failure.empty()) return BenchOutcome{.failed = {failure}};
  return BenchOutcome{.run = *done ? 1 : 0, .reused = *done ? 0 : 1};
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "apps/guided_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "apps/open_source.hpp"
#include "apps/ros_graph.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/imu_file.hpp"

namespace fbvins::app {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kFitPeriod = 1s;  // and at least as long as the last one took, for the search needs the processor, too
constexpr auto kLookPeriod = 200ms;
constexpr auto kLinePeriod = 500ms;  // of the line on a terminal

/// "lens of cam0 0.8/0.3 px": all that is judged, in few words.
std::string figures(const CalibrationProgress& progress) {
  std::string out;
  for (const WeakPart& part : progress.parts)
    out += fmt::format("{}{:.2g}/{:.2g} {}", out.empty() ? "" : ", ", part.sigma, part.aim, part.unit);
  return out.empty() ? "nothing is known yet" : out;
}

/// For sources that have no calibration: cameras of usual lenses beside one another.
std::optional<StereoRig> uncalibrated_rig(const std::vector<ImageSize>& sizes) {
  if (sizes.empty()) return std::nullopt;
  std::vector<MountedCamera> cameras;
  for (std::size_t k = 0; k < std::max<std::size_t>(2, sizes.size()); ++k) {
    const ImageSize& size = sizes[std::min(k, sizes.size() - 1)];
    const double focal_px = 0.6 * size.width;
    MountedCamera camera;
    camera.camera = Camera(PinholeRadtan{focal_px, focal_px, 0.5 * size.width, 0.5 * size.height}, size.width, size.height);
    camera.T_BC.p = Vec3(0.1 * static_cast<double>(k), 0, 0);
    cameras.push_back(camera);
  }
  return with_cameras({}, cameras);
}

Result<std::unique_ptr<Source>> open_live(const GuidedOptions& options) {
  SourceOptions source;
  source.say = note, source.give_up = stop_is_wanted;
  source.uncalibrated = uncalibrated_rig(options.sizes);
  const auto graph = RosGraph::join("", options.source, Ros2Options{});
  if (!graph) return graph.error();
  auto opened = graph->has_source() ? graph->open_source(source) : open_source(options.source, source);
  if (!opened && options.sizes.empty() && opened.error().message.find("need --calibration") != std::string::npos)
    return Error{opened.error().code, fmt::format("{}: give the size of its images, --resolution 752x480", options.source)};
  return opened;
}

}  // namespace

class GuidedCalibration::Session {
 public:
  Session(GuidedOptions options, std::unique_ptr<Source> source, std::unique_ptr<BoardWatch> watch,
          std::unique_ptr<GuidedPage> page)
      : options_(std::move(options)), source_(std::move(source)), watch_(std::move(watch)), page_(std::move(page)) {}

  Result<GuidedRecording> record() {
    Result<void> ended;
    {
      std::thread judge([this] { judge_while_recording(); });
      std::thread display([this] { display_while_recording(); });
      {
        const StopSignal stop([this] { source_->stop(); });
        ended = source_->run(*watch_);
      }
      watch_->finish();
      {
        const std::lock_guard lock(mutex_);
        over_ = true;
      }
      changed_.notify_all();
      judge.join();
      display.join();
    }
    if (terminal_) tell("\n");
    const BoardWatch::Recorded recorded = watch_->recorded();
    if (!ended && recorded.detections.views.empty()) return ended.error();
    if (!ended) warn(ended.error().message);
    return keep(recorded);
  }

  void end(const std::string& stage, const std::string& sentence) {
    if (!page_) return;
    GuidedState state = state_;
    state.stage = stage, state.action = sentence, state.reason.clear();
    page_->show(state);
    page_->finish();
  }

 private:
  void judge_while_recording() {
    GrowingCalibration growing(options_.board, options_.growing);
    std::unique_lock lock(mutex_);
    while (!over_) {
      const auto begun = Clock::now();
      lock.unlock();
      const BoardWatch::Recorded recorded = watch_->recorded();
      CalibrationProgress progress = growing.judge({recorded.detections, recorded.imu, recorded.now});
      lock.lock();
      state_.readings = static_cast<int>(recorded.imu.size());
      state_.progress = std::move(progress);
      if (state_.progress.reached) {
        source_->stop();
        return;
      }
      const auto now = Clock::now();
      changed_.wait_until(lock, std::max(begun + kFitPeriod, now + (now - begun)), [&] { return over_; });
    }
  }

  void display_while_recording() {
    std::unique_lock lock(mutex_);
    while (true) {
      const bool last = over_;
      const BoardWatch::Look look = watch_->look();
      state_.images = look.images, state_.left_out = look.left_out, state_.duration_s = look.duration_s;
      const bool urgent = !look.advice.empty() && !state_.progress.reached;
      state_.action = urgent ? look.advice : state_.progress.action;
      state_.reason = urgent ? "" : state_.progress.reason;
      if (state_.progress.reached) state_.action = "all aims are reached";
      const GuidedState state = state_;
      lock.unlock();
      show(state, look);
      if (last) return;
      lock.lock();
      changed_.wait_for(lock, kLookPeriod, [&] { return over_; });
    }
  }

  void show(const GuidedState& state, const BoardWatch::Look& look) {
    if (page_) {
      page_->show(state);
      page_->show(look);
    }
    if (options_.quiet || state.action.empty()) return;
    const std::string line = fmt::format("{:5.1f} s  {}  [{}]", state.duration_s, state.action, figures(state.progress));
    if (!terminal_) {
      if (state.action != said_) note(line + (state.reason.empty() ? "" : ": " + state.reason));
      said_ = state.action;
    } else if (Clock::now() >= line_due_) {
      line_due_ = Clock::now() + kLinePeriod;
      tell("\r\033[K" + line);
    }
  }

  /// Into the files, and back from them.
  Result<GuidedRecording> keep(const BoardWatch::Recorded& recorded) {
    if (recorded.detections.views.empty())
      return Error{ErrorCode::invalid_argument, fmt::format("{}: no image showed the board", options_.source)};
    const std::string corners = options_.out + "/detections.csv", readings = options_.out + "/imu0.csv";
    const std::string text = detections_to_csv(recorded.detections);
    if (Result<void> done = write_file_atomically(corners, text); !done) return done.error();
    GuidedRecording out;
    Result<Detections> detections = parse_detections(text, corners);
    if (!detections) return detections.error();
    out.detections = *std::move(detections);
    if (options_.sizes.empty()) out.imu_noise = source_->rig().imu_noise;
    if (recorded.imu.empty()) return out;
    if (Result<void> done = write_file_atomically(readings, imu_to_csv(recorded.imu)); !done) return done.error();
    Result<std::vector<ImuSample>> imu = read_imu_csv(readings);
    if (!imu) return imu.error();
    out.imu = *std::move(imu);
    if (!options_.quiet)
      note(fmt::format("kept: {} views of the board, {} readings ({} and {})", out.detections.views.size(), out.imu.size(),
                       corners, readings));
    return out;
  }

  GuidedOptions options_;
  std::unique_ptr<Source> source_;
  std::unique_ptr<BoardWatch> watch_;
  std::unique_ptr<GuidedPage> page_;
  const bool terminal_ = !options_.quiet && stderr_is_terminal();
  std::string said_;              ///< by the display
  Clock::time_point line_due_{};  ///< by the display
  std::mutex mutex_;              ///< guards what follows
  std::condition_variable changed_;
  bool over_ = false;
  GuidedState state_;
};

Result<std::unique_ptr<GuidedCalibration>> GuidedCalibration::open(GuidedOptions options) {
  auto watch = BoardWatch::create(options.board, options.threads);
  if (!watch) return watch.error();
  auto source = open_live(options);
  if (!source) return source.error();
  if (!options.given_noise && options.sizes.empty()) options.growing.imu_noise = (*source)->rig().imu_noise;
  std::unique_ptr<GuidedPage> page;
  if (!options.web.empty()) {
    auto opened = GuidedPage::open(options.web, options.source);
    if (!opened) return opened.error();
    page = *std::move(opened);
  }
  auto session = std::make_unique<Session>(std::move(options), *std::move(source), *std::move(watch), std::move(page));
  return std::unique_ptr<GuidedCalibration>(new GuidedCalibration(std::move(session)));
}

GuidedCalibration::GuidedCalibration(std::unique_ptr<Session> session) : session_(std::move(session)) {}
GuidedCalibration::~GuidedCalibration() = default;
Result<GuidedRecording> GuidedCalibration::record() { return session_->record(); }
void GuidedCalibration::end(const std::string& stage, const std::string& sentence) { session_->end(stage, sentence); }

}  // namespace fbvins::app

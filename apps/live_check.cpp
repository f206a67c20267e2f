// SPDX-License-Identifier: Apache-2.0
#include "apps/live_check.hpp"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "apps/commands.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/live/sensor_check.hpp"
#include "fbvins/types/owned_images.hpp"

namespace fbvins::app {
namespace {

/// Stereo images kept for the doctor: fifteen seconds at twenty a second, 200 MB of VGA.
constexpr int kMostImages = 300;

/// Checks how sensor data arrive, and keeps them for the doctor, which runs when all have come, so that nothing waits for it.
class CheckedInput final : public SensorInput {
 public:
  explicit CheckedInput(SensorCheck& check) : check_(check) {}
  void push(const ImuSample& sample) override {
    check_.push(sample);
    const std::lock_guard lock(mutex_);
    events_.emplace_back(sample);
  }
  void push(StereoFrame frame) override {
    check_.push(frame);
    const std::lock_guard lock(mutex_);
    if (images_++ >= kMostImages) return;
    events_.emplace_back(owned(std::move(frame)));
  }
  /// After the source has ended.
  Diagnosis diagnosis(const StereoRig& rig) const {
    const Replay replay = [&](const TakeEvent& take) -> Result<void> {
      for (const SensorEvent& event : events_)
        if (!take(event)) break;
      return {};
    };
    return *diagnose(rig, replay, CalibrationStyle::kalibr);  // a replay from memory does not fail
  }

 private:
  SensorCheck& check_;
  std::mutex mutex_;
  std::vector<SensorEvent> events_;
  int images_ = 0;
};

}  // namespace

int check_sensors(Source& source, double seconds) {
  SensorCheck check(source.rig(), source.clock_rate());
  CheckedInput input(check);
  std::condition_variable ended;
  std::mutex mutex;
  bool over = false;
  std::jthread timer([&] {
    std::unique_lock lock(mutex);
    ended.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return over; });
    source.stop();
  });
  const Result<void> done = [&] {
    const StopSignal stop([&] { source.stop(); });
    return source.run(input);
  }();
  {
    const std::lock_guard lock(mutex);
    over = true;
    ended.notify_all();
  }
  if (!done) return fail(done.error().message);
  bool fine = true;
  std::vector<SensorFinding> findings = source.device_findings();
  for (SensorFinding& finding : check.findings()) findings.push_back(std::move(finding));
  for (const SensorFinding& finding : findings) {
    fmt::print("{}  {}\n", !finding.fine ? "WRONG" : finding.advice ? "note " : "ok   ", finding.text);
    fine = fine && finding.fine;
  }
  const Diagnosis diagnosis = input.diagnosis(source.rig());
  for (const Finding& finding : diagnosis.findings) fmt::print("WRONG  {}\n", to_text(finding));
  for (const std::string& sentence : diagnosis.not_judged) fmt::print("-      not judged: {}\n", sentence);
  fine = fine && diagnosis.findings.empty() && diagnosis.no_verdict.empty();
  return fine ? kOk : kSensorsWrong;
}

}  // namespace fbvins::app

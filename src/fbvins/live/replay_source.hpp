// SPDX-License-Identifier: Apache-2.0
// A recording played as live sensors: each event is pushed when its stamp is due on this machine's clock, whether or not the
// receiver keeps up. Images are decoded ahead.
//
//   Result<std::unique_ptr<ReplaySource>> source = ReplaySource::open("MH_01_easy@2", {});   // twice as fast
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/io/dataset.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

class ReplaySource final : public Source {
 public:
  struct Options {
    DatasetOptions dataset;
    int laps = 1;          ///< how often it is played; stamps continue from lap to lap, the scene jumps back
    bool preload = false;  ///< everything is decoded before the clock starts, as a camera costs no decoding
    /// Recordings of more formats than open_dataset() knows.
    std::function<Result<std::unique_ptr<Dataset>>(const std::string&, const DatasetOptions&)> open_file = open_dataset;
  };

  /// `where`: DATASET or DATASET@SPEED.
  static Result<std::unique_ptr<ReplaySource>> open(const std::string& where, Options options);

  const StereoRig& rig() const override { return data_->rig(); }
  double clock_rate() const override { return speed_; }
  Result<void> run(SensorInput& input) override;
  void stop() override;

  const Dataset& dataset() const { return *data_; }

 private:
  ReplaySource(std::string path, Options options, std::unique_ptr<Dataset> data, double speed);
  /// Pushes all that `next` gives; `later` is added to stamps. False when stopped before the end.
  bool play(SensorInput& input, Duration later, const std::function<std::optional<SensorEvent>()>& next);
  /// False when stopped before.
  bool wait_until(std::int64_t host_ns);

  std::string path_;
  Options options_;
  std::unique_ptr<Dataset> data_;
  std::vector<SensorEvent> loaded_;  ///< all events, with Options::preload
  double speed_;
  std::optional<Time> first_, newest_;  ///< stamps pushed
  std::int64_t start_ns_ = 0;           ///< when the first was due, on this machine's clock
  std::mutex mutex_;
  std::condition_variable stopped_changed_;
  bool stopped_ = false;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// Queue from the sensors' threads to one consumer. Corrects stamps after clock jumps, marks the first image after a clock was set
// back (StereoFrame::after_clock_step), with which the estimate begins anew, puts IMU readings in order, refuses those
// that the sensor cannot have made, removes frozen images, and keeps one image waiting at most: when the next comes, the older
// one is dropped and counted. No good reading ever is.
//
//   ingest.push(sample); ingest.push(std::move(frame));                         // the sensors' threads
//   while (std::optional<SensorEvent> event = ingest.pop()) system.push(*event);   // the consumer's
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "fbvins/core/sample_period.hpp"
#include "fbvins/imu/reading_judge.hpp"
#include "fbvins/live/clock_guard.hpp"
#include "fbvins/live/imu_order.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/pipeline/repeated_images.hpp"

namespace fbvins {

class Ingest final : public SensorInput {
 public:
  using Clock = std::function<Time()>;
  using OnReading = std::function<void(const ImuSample& sample, Time host_t)>;

  /// `now` is this machine's clock. `on_reading` gets each reading in order, at once, on the thread that brought it,
  /// with its time on this machine's clock; it must not call back. time_offset: t_imu = t_image + offset. `cameras`: of the rig.
  Ingest(double clock_rate, Clock now, OnReading on_reading, const ImuNoise& imu = {}, Duration time_offset = {},
         int cameras = 2);

  void push(const ImuSample& sample) override;
  void push(StereoFrame frame) override;
  /// Its stamp is corrected as those of the images are.
  void push_anchor(Anchor anchor) override;
  void push_aiding(const AidingSample& reading) override;
  /// One whose stamp is on the images' clock as corrected (host_of).
  void push_corrected(AidingSample reading);
  /// Releases readings that have waited long enough (ImuOrder); to be called every few milliseconds.
  void tick();

  /// Waits for the next event; nothing once closed and empty.
  std::optional<SensorEvent> pop();
  /// The next event if there is one: for callers of a single thread.
  std::optional<SensorEvent> pop_waiting();
  /// Anchors that have come since the last call.
  std::vector<Anchor> take_anchors();
  void close();

  struct Camera {
    std::optional<Time> image;       ///< its newest one, on this machine's clock
    std::optional<Duration> period;  ///< of the stamps of its images
  };
  struct Arrival {
    std::optional<Time> imu, image;        ///< newest of each, on this machine's clock; `image`: of any camera
    std::vector<Camera> cameras;           ///< of the rig, by number
    Time newest;                           ///< stamp, on the images' clock
    std::optional<Duration> image_period;  ///< of the frames' stamps
    std::optional<Time> set_back_at = {};  ///< when a clock was found to be set back, the last time, on this machine's clock
    Duration set_back = {};                ///< by how much
  };
  Arrival arrivals() const;
  /// A stamp of the images' clock on this machine's clock (ClockGuard::host_of).
  Time host_of(Time t) const;
  /// The counts that are kept here; the others are zero.
  LiveCounts counts() const;

 private:
  void note_clock(const ClockGuard::Event& event, Time host);
  void put_in_order(ImuSample sample, Time t, Time host);
  void release(const ImuSample& sample);
  void take(StereoFrame frame, Time t, Time host);
  void remove_frozen(StereoFrame& frame);
  void note_arrival(const StereoFrame& frame, Time host);
  void drop_waiting_image();
  std::optional<SensorEvent> take_first();

  Clock now_;
  OnReading on_reading_;
  mutable std::mutex order_mutex_;  ///< keeps readings in order up to the end of on_reading; taken before mutex_
  Duration time_offset_;
  ClockGuard clock_;                       ///< on the images' clock
  std::deque<ImuSample> misfits_;          ///< readings whose stamps do not fit, until the next ones say whether they are good
  std::optional<StereoFrame> held_image_;  ///< the same of the image before the first one that counts
  ImuOrder order_;
  ReadingJudge judge_;
  SamplePeriod image_period_;
  std::optional<Time> newest_image_;
  struct Watched {
    ImageHistory seen;
    SamplePeriod period;
    std::optional<Time> newest;  ///< stamp
  };
  std::vector<Watched> cameras_;
  Arrival arrivals_;
  LiveCounts counts_;

  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<SensorEvent> queue_;
  std::vector<Anchor> anchors_;
  bool image_waits_ = false, closed_ = false;
  bool after_clock_step_ = false;  ///< the next image handed on is the first one since; under order_mutex_
  std::int64_t images_dropped_ = 0;
};

}  // namespace fbvins

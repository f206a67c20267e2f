// SPDX-License-Identifier: Apache-2.0
// What a live source delivers while a board is shown to its cameras: corners and readings are kept, images are not. The board is
// looked for on threads of its own, each time in the newest image; images that none of them could take in time are left out.
//
//   auto watch = BoardWatch::create(board, 1);
//   source.run(**watch);                       // meanwhile, from any thread: look(), recorded()
//   (*watch)->finish();
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/calibration/recent_board_views.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins::app {

class BoardWatch final : public SensorInput {
 public:
  static Result<std::unique_ptr<BoardWatch>> create(const Board& board, int threads);
  ~BoardWatch() override;

  void push(const ImuSample& sample) override;
  void push(StereoFrame frame) override;
  /// Ends the threads; what comes afterwards is left out.
  void finish();

  struct Recorded {
    Detections detections;
    std::vector<ImuSample> imu;  ///< in order of time, none twice
    std::vector<BoardView> now;  ///< of the cameras that see the board at this moment
  };
  Recorded recorded() const;

  /// An image with what was found in it.
  struct Picture {
    Time t;
    std::shared_ptr<const Image> image;
    std::vector<BoardCorner> corners;
  };
  struct Look {
    std::vector<Picture> cameras;  ///< the newest image of each that was looked at
    int images = 0;                ///< that were looked at, of all cameras
    int left_out = 0;              ///< frames that came and were not looked at
    double duration_s = 0;         ///< from the first frame to the newest
    std::string advice;            ///< RecentBoardViews::advice()
  };
  Look look() const;

 private:
  explicit BoardWatch(std::vector<BoardDetector> detectors);
  void work(BoardDetector& detector);
  void look_at(const StereoFrame& frame, BoardDetector& detector);

  std::vector<BoardDetector> detectors_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<StereoFrame> waiting_;
  bool finished_ = false;
  Recorded recorded_;
  Look look_;
  RecentBoardViews recent_views_;
  int mirror_tries_ = 0;
  std::optional<Time> first_;
  std::vector<std::thread> threads_;  ///< last: they use the members above
};

}  // namespace fbvins::app

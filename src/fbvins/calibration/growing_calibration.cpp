// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/growing_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "fbvins/calibration/view_choice.hpp"

namespace fbvins {
namespace {

constexpr int kFewestStamps = 40, kMostStamps = 400;
constexpr int kFewestAtEnd = 40;       // stamps, below which the residuals do not tell the noise well
constexpr double kImuPeriod_s = 0.09;  // between images in the fit with the IMU
constexpr double kImuGrowth = 1.25;    // of the views until it is fitted again
constexpr int kPatience = 4;           // judgements for which a sentence stays, unless it is followed earlier
constexpr double kLittleGain = 1.05;   // below it no way of holding the board is better than another

/// Views that differ most, of each camera, and all others of their stamps.
Detections spread(const Detections& all, const Board& board, int stamps) {
  Detections out{{}, all.sizes};
  std::set<std::int64_t> chosen;
  for (int k = 0; k < all.camera_count(); ++k) {
    std::vector<BoardView> own;
    for (const BoardView& view : all.views)
      if (view.camera == k) own.push_back(view);
    const auto size = all.sizes.find(k);
    for (const BoardView& view : spread_views(own, board, size == all.sizes.end() ? 1000 : size->second.width, stamps))
      chosen.insert(view.t.ns);
  }
  for (const BoardView& view : all.views)
    if (chosen.contains(view.t.ns)) out.views.push_back(view);
  return out;
}

/// At most about ten stamps a second: neighbours stay close enough to tell the turns between them.
std::vector<BoardView> thinned_in_time(const std::vector<BoardView>& views) {
  std::vector<BoardView> out;
  for (const BoardView& view : views) {
    const bool same = !out.empty() && view.t == out.back().t;
    if (out.empty() || same || (view.t - out.back().t).seconds() >= kImuPeriod_s) out.push_back(view);
  }
  return out;
}

std::vector<ImageCoverage> coverage_of(const Detections& detections) {
  std::vector<ImageCoverage> out(static_cast<std::size_t>(detections.camera_count()));
  for (const auto& [camera, size] : detections.sizes) {
    ImageCoverage& one = out[static_cast<std::size_t>(camera)];
    one.size = size;
    one.grid = ImageCells::of(size.width, size.height);
    one.corners.assign(static_cast<std::size_t>(one.grid.count()), 0);
  }
  for (const BoardView& view : detections.views) {
    ImageCoverage& one = out[static_cast<std::size_t>(view.camera)];
    ++one.views;
    if (one.corners.empty()) continue;
    for (const BoardCorner& corner : view.corners) ++one.corners[static_cast<std::size_t>(one.grid.cell_of(corner.pixel))];
  }
  return out;
}

/// The part that is farthest from its aim; null where all have reached it.
const WeakPart* weakest(const std::vector<WeakPart>& parts) {
  const auto far = [](const WeakPart& part) { return part.sigma / part.aim; };
  const auto worst = std::ranges::max_element(parts, {}, far);
  return worst == parts.end() || worst->sigma <= worst->aim ? nullptr : &*worst;
}

std::string why(const WeakPart& part) {
  return fmt::format("{} is known to {:.2g} {}, {:.2g} {} are wanted", part.what, part.sigma, part.unit, part.aim, part.unit);
}

}  // namespace

CalibrationProgress GrowingCalibration::judge(const GrowingInput& input) {
  CalibrationProgress progress;
  progress.cameras = coverage_of(input.detections);
  if (input.detections.views.empty()) {
    progress.action = "show the board to the cameras";
    progress.reason = "no camera has seen it yet";
    return progress;
  }
  const auto start = std::chrono::steady_clock::now();
  const Detections some = spread(input.detections, board_, most_stamps_);
  CameraCalibrationOptions options = options_.cameras;
  options.max_views = most_stamps_;
  options.models = models_for(some.views.size());
  const bool with_imu = options_.with_imu && !input.imu.empty();
  const bool apart = with_imu && (options_.imu.camera_offsets || !cameras_connected(some, board_, options.pair_tolerance_s));
  const auto cameras = apart ? calibrate_cameras_apart(some, board_, options) : calibrate_cameras(some, board_, options);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (took_s > options_.patience_s) most_stamps_ = std::max(kFewestStamps, most_stamps_ * 3 / 4);
  else if (took_s < 0.6 * options_.patience_s) most_stamps_ = std::min(kMostStamps, most_stamps_ * 5 / 4);
  if (!cameras) {
    progress.reason = cameras.error().message;
    guide(input, rough_knowledge(some, board_, options.models, options.pair_tolerance_s), progress);
    return progress;
  }
  for (std::size_t k = 0; k < cameras->cameras.size() && models_.size() < cameras->cameras.size(); ++k)
    models_.push_back(cameras->cameras[k].camera.model_name());
  progress.noise_px = cameras->noise_px;
  progress.parts = judged_parts(*cameras, nullptr, options_.aims);
  const bool known = weakest(progress.parts) == nullptr;
  progress.cameras_reached = known && cameras->stamps >= kFewestAtEnd;
  progress.reached = progress.cameras_reached && !with_imu;
  if (progress.cameras_reached && with_imu) judge_imu(input, *cameras, progress);
  if (!progress.cameras_reached) {
    progress.reason =
        known ? fmt::format("{} of {} views at least", cameras->stamps, kFewestAtEnd) : why(*weakest(progress.parts));
    guide(input, knowledge_of(*cameras), progress);
  }
  return progress;
}

/// A model that is chosen by evidence is chosen again when there are twice as many views.
std::vector<std::string> GrowingCalibration::models_for(std::size_t views) {
  if (std::ranges::find(options_.cameras.models, kAutoModel) == options_.cameras.models.end()) return options_.cameras.models;
  if (views >= 2 * chosen_from_) {
    chosen_from_ = views;
    models_.clear();
  }
  return models_.empty() ? options_.cameras.models : models_;
}

void GrowingCalibration::judge_imu(const GrowingInput& input, const CameraCalibration& cameras, CalibrationProgress& progress) {
  if (static_cast<double>(input.detections.views.size()) >= kImuGrowth * static_cast<double>(imu_views_)) {
    imu_views_ = input.detections.views.size();
    ImuCameraInput fit{
        board_, {}, {}, thinned_in_time(input.detections.views), input.imu, options_.imu_noise, rig_variations(cameras)};
    const bool joined = !options_.imu.camera_offsets && knowledge_of(cameras).joined.back();
    for (const CalibratedCamera& camera : cameras.cameras) {
      fit.cameras.push_back(camera.camera);
      if (joined) fit.T_CnC0.push_back(camera.T_CnC0);
    }
    const auto found = calibrate_imu_camera(fit, options_.imu);
    imu_lacks_ = found ? "" : found.error().message;
    imu_parts_.clear();
    if (found)
      for (const WeakPart& part : judged_parts({}, &*found, options_.aims)) imu_parts_.push_back(part);
  }
  progress.parts.insert(progress.parts.end(), imu_parts_.begin(), imu_parts_.end());
  if (!imu_lacks_.empty()) {
    progress.action = "turn the rig about all three axes and move it, faster";
    progress.reason = imu_lacks_;
  } else if (const WeakPart* weak = weakest(imu_parts_)) {
    progress.action = weak->advice;
    progress.reason = why(*weak);
  } else {
    progress.reached = true;
  }
}

void GrowingCalibration::guide(const GrowingInput& input, const RigKnowledge& known, CalibrationProgress& progress) {
  std::vector<BoardHold> now;
  for (const BoardView& view : input.now)
    if (const auto hold = hold_of(known.cameras[static_cast<std::size_t>(view.camera)], board_, view)) now.push_back(*hold);
  // A hand needs time to follow.
  if (asked_.sentence.empty() || ++asked_for_ >= kPatience || followed(asked_, now)) {
    asked_ = next_view(known, board_, now, options_.aims);
    asked_for_ = 0;
  }
  progress.action = asked_.gain < kLittleGain ? "move the board slowly, near and far, through all images" : asked_.sentence;
}

}  // namespace fbvins

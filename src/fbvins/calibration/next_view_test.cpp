// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/next_view.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace next_view_test {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
constexpr double kNoise_px = 0.3;

SimulatedRig one_camera() { return {{example_cameras()[0]}, {{}}}; }

void add(const SimulatedRig& rig, const Pose<C0, T>& T_C0T, Rng& rng, Detections& to) {
  const Time t{1'000'000'000 + static_cast<std::int64_t>(to.views.size()) * 50'000'000ll};
  for (int k = 0; k < static_cast<int>(rig.cameras.size()); ++k) {
    const BoardView view = simulated_view(rig, k, kBoard, T_C0T, t, kNoise_px, rng);
    if (!view.corners.empty()) to.views.push_back(view);
    to.sizes[k] = {rig.cameras[static_cast<std::size_t>(k)].width(), rig.cameras[static_cast<std::size_t>(k)].height()};
  }
}

Pose<C0, T> held(const SimulatedRig& rig, const BoardHold& hold) {
  const auto k = static_cast<std::size_t>(hold.camera);
  return rig.T_CnC0[k].inverse() * *pose_of(rig.cameras[k], kBoard, hold);
}

RigKnowledge rough(const Detections& detections) { return rough_knowledge(detections, kBoard, {"pinhole-radtan"}, 1e-3); }

std::vector<BoardHold> newest_hold(const RigKnowledge& known, const Detections& detections) {
  std::vector<BoardHold> out;
  const Time t = detections.views.back().t;
  for (const BoardView& view : detections.views)
    if (view.t == t)
      if (const auto hold = hold_of(known.cameras[static_cast<std::size_t>(view.camera)], kBoard, view)) out.push_back(*hold);
  return out;
}

/// Largest error over the aim, of a lens and all else.
double farthest(const Detections& detections) {
  const auto found = calibrate_cameras(detections, kBoard, {});
  if (!found) return 1e9;
  double most = 0;
  for (const WeakPart& part : judged_parts(*found, nullptr)) most = std::max(most, part.sigma / part.aim);
  return most;
}

TEST(NextView, AHoldIsSeenAsItWasMade) {
  const SimulatedRig rig = one_camera();
  Rng rng(1);
  for (int place = 0; place < 9; ++place)
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {-0.5, 0.0}, {0.0, 0.5}, {0.0, -0.5}}) {
      const BoardHold hold{0, place, 0.4, x, y};
      const BoardView view = simulated_view(rig, 0, kBoard, held(rig, hold), Time{1}, 0.1, rng);
      const auto seen = hold_of(rig.cameras[0], kBoard, view);
      ASSERT_TRUE(seen);
      EXPECT_EQ(seen->place, place);
      EXPECT_NEAR(seen->fill, hold.fill, 0.1);
      EXPECT_NEAR(seen->tilt_x_rad, x, 0.02);
      EXPECT_NEAR(seen->tilt_y_rad, y, 0.02);
    }
}

TEST(NextView, ABoardThatNeverTiltsIsToTilt) {
  const SimulatedRig rig = one_camera();
  Rng rng(2);
  Detections seen;
  for (int i = 0; i < 30; ++i) add(rig, held(rig, {0, i % 9, i % 2 == 0 ? 0.4 : 0.7, 0, 0}), rng, seen);
  ASSERT_FALSE(calibrate_cameras(seen, kBoard, {}));  // refused: not determined
  const RigKnowledge known = rough(seen);
  const NextView next = next_view(known, kBoard, newest_hold(known, seen), {});
  EXPECT_TRUE(next.sentence.starts_with("tilt the board about its ")) << next.sentence;
  EXPECT_GT(next.gain, 2);
}

TEST(NextView, ABoardThatIsNeverInOneHalfOfTheImageIsToComeThere) {
  const SimulatedRig rig = one_camera();
  SimulatedViews views = simulated_views(rig, kBoard, 60, kNoise_px, 3);
  for (BoardView& view : views.detections.views)
    std::erase_if(view.corners, [](const BoardCorner& c) { return c.pixel.x() > 330; });
  std::erase_if(views.detections.views, [](const BoardView& view) { return view.corners.size() < 12; });
  const auto found = calibrate_cameras(views.detections, kBoard, {});
  ASSERT_TRUE(found) << found.error().message;
  const NextView next = next_view(knowledge_of(*found), kBoard, {{0, 3, 0.7, 0, 0}}, {});
  EXPECT_NE(next.sentence.find("right"), std::string::npos) << next.sentence;
  EXPECT_EQ(next.hold.place % 3, 2) << next.sentence;
}

TEST(NextView, ACameraThatSawNothingIsToSeeTheBoard) {
  const SimulatedRig rig = simulated_stereo(example_cameras()[0]);
  SimulatedViews views = simulated_views(rig, kBoard, 30, kNoise_px, 4);
  std::erase_if(views.detections.views, [](const BoardView& view) { return view.camera == 1; });
  const RigKnowledge known = rough(views.detections);
  const NextView next = next_view(known, kBoard, newest_hold(known, views.detections), {});
  EXPECT_EQ(next.hold.camera, 1) << next.sentence;
  EXPECT_NE(next.sentence.find("cam1"), std::string::npos) << next.sentence;
}

TEST(NextView, WhoDoesWhatItSaysIsDoneSooner) {
  const SimulatedRig rig = one_camera();
  Rng rng(5);
  Detections guided, anyhow;
  for (int i = 0; i < 6; ++i) add(rig, held(rig, {0, 4, 0.5, 0.1 * (i % 3 - 1), 0.1 * (i / 3)}), rng, guided);
  anyhow = guided;
  for (int i = 0; i < 12; ++i) {
    const RigKnowledge known = rough(guided);
    const NextView next = next_view(known, kBoard, newest_hold(known, guided), {});
    EXPECT_FALSE(followed(next, newest_hold(known, guided)));
    EXPECT_TRUE(followed(next, {next.hold}));
    for (int image = 0; image < 2; ++image) {
      add(rig, held(rig, next.hold), rng, guided);
      add(rig, random_board_pose(rig, 0, kBoard, rng, 0.3), rng, anyhow);
    }
  }
  EXPECT_LT(farthest(guided), farthest(anyhow));
}

}  // namespace next_view_test
}  // namespace fbvins

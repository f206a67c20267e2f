// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/sim/euroc_writer.hpp"

namespace fbvins {
namespace simulation_test {

SimulationOptions short_flight(const std::string& preset) {
  SimulationOptions options = *simulation_preset(preset);
  options.flight.duration_s = 4;
  options.image_rate_hz = 2;
  options.camera.time_samples = 2;
  return options;
}

double mean(const Image& image) {
  double sum = 0;
  for (int i = 0; i < image.width() * image.height(); ++i) sum += image.row(0)[i];
  return sum / (image.width() * image.height());
}

TEST(Simulation, EveryPresetIsValidAndHasItsOwnName) {
  std::set<std::string> names;
  for (const std::string& name : simulation_presets()) {
    const auto options = simulation_preset(name);
    ASSERT_TRUE(options) << name;
    EXPECT_TRUE(validate(*options)) << name;
    names.insert(name);
  }
  EXPECT_EQ(names.size(), simulation_presets().size());
  for (const char* name :
       {"normal", "dim", "flicker", "switching", "moving-light", "weak-texture", "moving-objects", "glare", "fast"})
    EXPECT_TRUE(names.count(name)) << name;
  EXPECT_FALSE(simulation_preset("sunny"));
}

TEST(Simulation, SameSeedSameBitsOtherSeedOtherWorld) {
  const auto first_image = [](int seed) {
    SimulationOptions options = short_flight("moving-objects");
    options.seed = seed;
    auto simulation = prepare_simulation(options);
    EXPECT_TRUE(simulation);
    return *render_frame(*simulation, 0).frame.left();
  };
  const Image a = first_image(1), b = first_image(1), c = first_image(2);
  EXPECT_TRUE(std::equal(a.row(0), a.row(480), b.row(0)));
  int same = 0;
  for (int i = 0; i < 752 * 480; ++i) same += a.row(0)[i] == c.row(0)[i] ? 1 : 0;
  EXPECT_LT(same, 752 * 480 / 4);
}

TEST(Simulation, ADatasetDeliversItInOrderWithTruth) {
  auto contents = simulate(short_flight("normal"));
  ASSERT_TRUE(contents) << contents.error().message;
  Dataset data(*std::move(contents), {});
  EXPECT_EQ(data.frames().size(), 8u);
  Time last{0};
  int frames = 0, samples = 0;
  while (auto event = data.next()) {
    if (const auto* s = std::get_if<ImuSample>(&*event)) {
      EXPECT_GT(s->t, last);
      last = s->t;
      ++samples;
    } else {
      const auto& frame = std::get<StereoFrame>(*event);
      EXPECT_LE(frame.t, last);
      EXPECT_NEAR(mean(*frame.left()), 130, 25);
      EXPECT_NEAR(mean(*frame.right()), 130, 25);
      ++frames;
    }
  }
  EXPECT_EQ(frames, 8);
  EXPECT_EQ(static_cast<std::size_t>(samples), data.ground_truth().size());
  ASSERT_TRUE(data.ground_truth()[3].bias && data.ground_truth()[3].v_WB);
}

TEST(Simulation, ScenariosHaveTheirEffects) {
  // Dim: darker and noisier though exposed and amplified to the limits.
  auto dim = prepare_simulation(short_flight("dim"));
  ASSERT_TRUE(dim);
  const RenderedFrame rendered = render_frame(*dim, 0);
  EXPECT_LT(mean(*rendered.frame.left()), 75);
  // Switching: brightness jumps within the flight although exposure follows.
  SimulationOptions options = short_flight("switching");
  options.flight.duration_s = 9;
  auto lamps = prepare_simulation(options);
  ASSERT_TRUE(lamps);
  double low = 255, high = 0;
  for (std::size_t i = 0; i < lamps->frames.size(); ++i) {
    const double m = mean(*render_frame(*lamps, i).frame.left());
    low = std::min(low, m);
    high = std::max(high, m);
  }
  EXPECT_GT(high - low, 25);
  // Dropped frames are missing; the others keep their stamps.
  options = short_flight("normal");
  options.image_rate_hz = 20;
  options.camera.drop_share = 0.3;
  auto dropped = prepare_simulation(options);
  ASSERT_TRUE(dropped);
  EXPECT_LT(dropped->frames.size(), 70u);
  EXPECT_GT(dropped->frames.size(), 40u);
}

TEST(Simulation, CamerasMayTakeTheirImagesLaterThanTheirStampsSay) {
  const auto frame = [](double later_ms) {
    SimulationOptions options = short_flight("normal");
    options.camera.later_ms = later_ms;
    auto simulation = prepare_simulation(options);
    EXPECT_TRUE(simulation);
    EXPECT_NEAR(simulation->rig.times(1).time_offset_s, 1e-3 * later_ms, 1e-12);
    return render_frame(*simulation, 4).frame;
  };
  const StereoFrame on_time = frame(0), later = frame(8);
  EXPECT_EQ(later.t, on_time.t);
  EXPECT_TRUE(later.offsets.all_zero()) << "offsets are of stamps";
  EXPECT_TRUE(std::equal(later.left()->row(0), later.left()->row(480), on_time.left()->row(0)));
  EXPECT_FALSE(std::equal(later.right()->row(0), later.right()->row(480), on_time.right()->row(0)));
}

TEST(Simulation, OneCameraSeesWhatTheLeftOneOfAPairSees) {
  const auto frame = [](const char* rig) {
    SimulationOptions options = short_flight("normal");
    options.rig = rig;
    auto simulation = prepare_simulation(options);
    EXPECT_TRUE(simulation);
    return render_frame(*simulation, 4).frame;
  };
  const StereoFrame one = frame("mono"), pair = frame("stereo");
  EXPECT_EQ(one.right(), nullptr);
  EXPECT_TRUE(std::equal(one.left()->row(0), one.left()->row(480), pair.left()->row(0)));
}

TEST(Simulation, ADepthSensorThatLiesElsewhereMeasuresTheSameRoom) {
  SimulationOptions options = short_flight("rgbd");
  options.depth.apart_m = 0.06;
  options.depth.noise_at_1m_m = 1e-4, options.depth.hole_share = 0, options.depth.edge_px = 0, options.depth.baseline_m = 0;
  auto simulation = prepare_simulation(options);
  ASSERT_TRUE(simulation);
  const RenderedFrame rendered = render_frame(*simulation, 4, true);
  const DepthReader reader(simulation->rig);
  ASSERT_TRUE(reader.is_usable(rendered.frame.depth.get()));
  int measured = 0, right = 0;
  for (int y = 10; y < 480; y += 20)
    for (int x = 10; x < 752; x += 20) {
      const auto depth = reader.at(*rendered.frame.depth, Vec2(x, y));
      if (!depth) continue;
      const double truth_m = rendered.depth_left_m[static_cast<std::size_t>(y * 752 + x)];
      ++measured, right += std::abs(1 / depth->value - truth_m) < 0.01 * truth_m;
    }
  EXPECT_GT(measured, 300) << "of 912";
  EXPECT_GT(right, 0.97 * measured);
}

TEST(Simulation, WrongOptionsAreRefusedWithASentence) {
  SimulationOptions options = short_flight("normal");
  options.world.kind = "corridors";
  EXPECT_FALSE(prepare_simulation(options));
  options = short_flight("normal");
  options.recorded.trajectory = "does-not-exist.csv";
  EXPECT_EQ(prepare_simulation(options).error().code, ErrorCode::not_found);
  options = short_flight("normal");
  options.camera.vignetting = 7;
  EXPECT_FALSE(prepare_simulation(options));
}

TEST(Simulation, TheEurocFolderReadsBackToTheSameBits) {
  const std::string folder = ::testing::TempDir() + "/fbvins_simulated_flight";
  std::filesystem::remove_all(folder);
  SimulationOptions options = short_flight("takeoff");
  auto simulation = prepare_simulation(options);
  ASSERT_TRUE(simulation);
  const auto written = write_euroc(*simulation, folder, {true, true, 3}, {});
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_FALSE(write_euroc(*simulation, folder, {}, {}));  // never overwrites

  auto data = open_dataset(folder);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_NEAR((*data)->rig().left().focal_px(), simulation->rig.left().focal_px(), 1e-9);
  EXPECT_LT(((*data)->rig().T_BC1().p - simulation->rig.T_BC1().p).norm(), 1e-12);
  auto again = prepare_simulation(options);
  std::size_t samples = 0, frames = 0;
  while (auto event = (*data)->next()) {
    if (const auto* s = std::get_if<ImuSample>(&*event)) {
      EXPECT_EQ(s->accel_mps2, simulation->imu.samples[samples].accel_mps2);
      ++samples;
    } else {
      const auto& frame = std::get<StereoFrame>(*event);
      const RenderedFrame rendered = render_frame(*again, frames++);
      ASSERT_TRUE(frame.left() && frame.right());
      EXPECT_TRUE(std::equal(frame.left()->row(0), frame.left()->row(480), rendered.frame.left()->row(0)));
      EXPECT_TRUE(std::equal(frame.right()->row(0), frame.right()->row(480), rendered.frame.right()->row(0)));
    }
  }
  EXPECT_EQ(frames, 3u);
  EXPECT_EQ(samples, simulation->imu.samples.size());
  ASSERT_EQ((*data)->ground_truth().size(), simulation->imu.truth.size());
  EXPECT_LT(((*data)->ground_truth()[50].T_WB.p - simulation->imu.truth[50].T_WB.p).norm(), 1e-6);
  EXPECT_TRUE(std::filesystem::exists(folder + "/mav0/landmarks.csv"));
  std::filesystem::remove_all(folder);
}

}  // namespace simulation_test
}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/replay_source.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "fbvins/io/flight_record.hpp"

namespace fbvins {
namespace replay_source_test {

namespace fs = std::filesystem;

constexpr int kImages = 4, kReadingsPerImage = 10;

Time at(int ms) { return {1'600'000'000'000'000'000 + ms * 1'000'000LL}; }

struct Notes final : SensorInput {
  std::vector<std::pair<Time, std::int64_t>> events;  ///< stamp, and when it came on this machine's clock
  int images = 0;
  std::function<void()> on_image = [] {};

  std::int64_t before_ns = now_ns();  ///< the source was not yet started

  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }
  void note(Time t) { events.emplace_back(t, now_ns()); }
  void push(const ImuSample& sample) override { note(sample.t); }
  void push(StereoFrame frame) override {
    note(frame.t);
    ++images;
    on_image();
  }
};

/// A recording of 200 ms: images every 50 ms, readings every 5 ms.
class ReplaySourceTest : public ::testing::Test {
 protected:
  ReplaySourceTest() {
    StereoRig rig;
    rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11}, 32, 24), {}});
    rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
    auto record = FlightRecord::create(path_, rig);
    EXPECT_TRUE(record);
    for (int k = 0; k < kImages * kReadingsPerImage; ++k) {
      EXPECT_TRUE(record->add(ImuSample{at(5 * k), Vec3::Zero(), Vec3(0, 0, 9.81)}));
      if (k % kReadingsPerImage != 0) continue;
      const auto image = std::make_shared<Image>(32, 24, static_cast<std::uint8_t>(k));
      EXPECT_TRUE(record->add(StereoFrame{at(5 * k), {image, image}}));
    }
    EXPECT_TRUE(record->finish());
  }
  ~ReplaySourceTest() override { fs::remove(path_); }

  Notes play(const std::string& speed, int laps, bool preload) const {
    auto source = ReplaySource::open(path_ + speed, {{}, laps, preload});
    EXPECT_TRUE(source);
    Notes notes;
    EXPECT_TRUE((*source)->run(notes));
    return notes;
  }

  std::string path_ = (fs::temp_directory_path() / ("fbvins_replay_" + std::to_string(getpid()) + ".mcap")).string();
};

TEST_F(ReplaySourceTest, NothingComesBeforeItIsDue) {
  for (const bool preload : {false, true}) {
    const Notes notes = play("@2", 1, preload);
    ASSERT_EQ(notes.events.size(), static_cast<std::size_t>(kImages * (kReadingsPerImage + 1)));
    const Time first = notes.events.front().first;
    // Half of the stamps' time; what is late on a busy machine is no fault, what is early is.
    for (const auto& [t, host_ns] : notes.events) EXPECT_GE(host_ns - notes.before_ns, (t - first).ns / 2);
  }
}

TEST_F(ReplaySourceTest, StampsGoOnFromLapToLap) {
  for (const bool preload : {false, true}) {
    const Notes notes = play("@20", 3, preload);
    EXPECT_EQ(notes.images, 3 * kImages);
    for (std::size_t k = 1; k < notes.events.size(); ++k) EXPECT_GE(notes.events[k].first, notes.events[k - 1].first);
    // Each lap 195 ms from the first stamp to the last, and the time of an image between two.
    EXPECT_EQ((notes.events.back().first - notes.events.front().first).ns, (3 * 195 + 2 * 50) * 1'000'000LL);
  }
}

TEST_F(ReplaySourceTest, NothingRecordedEndsAtOnceHoweverOften) {
  struct NoImages final : FrameLoader {
    LoadedFrame load(const FrameEntry&) override { return {}; }
  };
  ReplaySource::Options options;
  options.laps = 3;
  options.open_file = [](const std::string&, const DatasetOptions& dataset) -> Result<std::unique_ptr<Dataset>> {
    DatasetContents contents;
    contents.loader = std::make_unique<NoImages>();
    return std::make_unique<Dataset>(std::move(contents), dataset);
  };
  auto source = ReplaySource::open("empty", options);
  ASSERT_TRUE(source);
  Notes notes;
  EXPECT_TRUE((*source)->run(notes));
  EXPECT_TRUE(notes.events.empty());
}

TEST_F(ReplaySourceTest, StopEndsItSoon) {
  auto source = ReplaySource::open(path_ + "@0.01", {});  // 20 s
  ASSERT_TRUE(source);
  Notes notes;
  std::jthread stopper;
  notes.on_image = [&] { stopper = std::jthread([&] { (*source)->stop(); }); };
  EXPECT_TRUE((*source)->run(notes));
  EXPECT_EQ(notes.images, 1);
}

TEST_F(ReplaySourceTest, NonsenseIsRefused) {
  for (const char* speed : {"@", "@fast", "@0", "@-1", "@1e9"}) {
    const auto source = ReplaySource::open(path_ + speed, {});
    ASSERT_FALSE(source) << speed;
    EXPECT_NE(source.error().message.find("speed"), std::string::npos);
  }
  EXPECT_FALSE(ReplaySource::open("/there/is/nothing", {}));
}

}  // namespace replay_source_test
}  // namespace fbvins

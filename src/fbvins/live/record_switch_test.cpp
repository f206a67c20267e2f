// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_switch.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>

#include "fbvins/io/dataset.hpp"

namespace fbvins {
namespace record_switch_test {

namespace fs = std::filesystem;

class RecordSwitchTest : public ::testing::Test {
 protected:
  RecordSwitchTest() {
    fs::create_directories(folder);
    rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11}, 32, 24), {}});
    rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  }
  ~RecordSwitchTest() override { fs::remove_all(folder); }

  static int readings_in(const std::string& file) {
    auto data = open_dataset(file);
    EXPECT_TRUE(data) << data.error().message;
    int count = 0;
    while (const auto event = (*data)->next()) count += std::holds_alternative<ImuSample>(*event);
    return count;
  }
  void take(int readings) {
    for (int i = 0; i < readings; ++i) {
      ASSERT_TRUE(record.take(ImuSample{t}));
      t = t + Duration{5'000'000};
    }
    const auto image = std::make_shared<const Image>(32, 24, std::uint8_t{9});
    ASSERT_TRUE(record.take(StereoFrame{t, {image, image}}));
  }

  const std::string folder = ::testing::TempDir() + "/fbvins_record_switch_" + std::to_string(getpid());
  std::string path = folder + "/flight.mcap";
  StereoRig rig;
  Time t{1'600'000'000'000'000'000};
  RecordSwitch record{[this] { return RecordSink::create_next(path, rig, {}, {.keep_free_bytes = 0}); }};
};

TEST_F(RecordSwitchTest, EachStretchIsARecordOfItsOwn) {
  take(2);
  EXPECT_FALSE(record.wants_views());
  ASSERT_EQ(record.figures().size(), 1u);
  EXPECT_EQ(std::get<bool>(record.figures()[0].value), false);
  EXPECT_FALSE(record.stop()) << "nothing has begun";
  EXPECT_EQ(*record.start(), path);
  EXPECT_TRUE(record.wants_views());
  take(3);
  const std::vector<OutputFigure> figures = record.figures();
  ASSERT_EQ(figures.size(), 4u);
  EXPECT_EQ(std::get<bool>(figures[0].value), true);
  EXPECT_EQ(std::get<std::string>(figures[1].value), path);
  EXPECT_GT(std::get<double>(figures[3].value), 0) << figures[3].name;
  const Result<std::string> twice = record.start();
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().message.find(path), std::string::npos);
  take(4);
  EXPECT_EQ(*record.stop(), path);
  EXPECT_FALSE(record.wants_views());
  take(5);
  EXPECT_EQ(*record.start(), folder + "/flight-2.mcap");
  take(6);
  EXPECT_TRUE(record.finish());
  EXPECT_EQ(readings_in(path), 7);
  EXPECT_EQ(readings_in(folder + "/flight-2.mcap"), 6);
}

TEST_F(RecordSwitchTest, AFolderThatIsNotThereIsAProblemUntilItIs) {
  path = folder + "/unplugged/flight.mcap";
  EXPECT_FALSE(record.start());
  EXPECT_NE(record.problem().find(path), std::string::npos);
  take(1);
  fs::create_directories(folder + "/unplugged");
  EXPECT_TRUE(record.start());
  EXPECT_EQ(record.problem(), "");
}

/// The estimator's thread asks for them.
TEST_F(RecordSwitchTest, FiguresDoNotWaitForASlowDisk) {
  std::atomic<bool> slow = false;
  std::promise<void> asked, disk;
  const std::shared_future<void> answer = disk.get_future().share();
  const auto free_bytes = [&](const std::string&) {
    if (slow.exchange(false)) {
      asked.set_value();
      answer.wait();
    }
    return std::uint64_t{1} << 40U;
  };
  RecordSwitch busy([&] { return RecordSink::create_next(path, rig, {}, {.keep_free_bytes = 0, .free_bytes = free_bytes}); });
  ASSERT_TRUE(busy.start());
  slow = true;  // from the next flush on, which has the record to itself
  asked.get_future().wait();
  auto taken = std::async(std::launch::async, [&] { return static_cast<bool>(busy.take(ImuSample{t})); });
  EXPECT_EQ(taken.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  auto figures = std::async(std::launch::async, [&] { return busy.problem().size() + busy.figures().size(); });
  EXPECT_EQ(figures.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  disk.set_value();
  EXPECT_TRUE(taken.get());
  EXPECT_EQ(figures.get(), 4u);
  EXPECT_TRUE(busy.finish());
}

}  // namespace record_switch_test
}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/finished_flight.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "fbvins/io/trajectory.hpp"
#include "fbvins/live/record_sink.hpp"
#include "fbvins/web/flight_player.hpp"
#include "tests/support/web_test_client.hpp"

namespace fbvins {
namespace finished_flight_test {

constexpr std::int64_t kStart_ns = 1'400'000'000'000'000'000;

Time at(int image) { return {kStart_ns + 50'000'000LL * image}; }

Odometry odometry(int image) {
  Odometry o;
  o.id = FrameId{image};
  o.t = at(image);
  o.T_WB = {Quat(Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized())), Vec3(0.1 * image, 1, 2)};
  o.v_WB = Vec3(2, 0.5, 0);
  o.pose_covariance = (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 4, 5, 6).finished().asDiagonal();
  o.pose_covariance(0, 4) = o.pose_covariance(4, 0) = 0.25;
  o.health = image < 2 ? Health{} : Health{HealthState::good, HealthReason::none};
  o.reset_counter = 1;
  o.stats.landmarks = 40 + image;
  o.tilt_sigma_rad = 0.01;
  return o;
}

class Record : public testing::Test {
 protected:
  void SetUp() override {
    auto sink = RecordSink::create(path, rig(), {});
    ASSERT_TRUE(sink) << sink.error().message;
    for (int i = 0; i < 20; ++i) {
      LiveView view;
      view.t = at(i);
      view.features = {{TrackId{7}, Vec2(10.5, 20), 3, 4.5}, {TrackId{8}, Vec2(11, 21), 0, 0}};
      view.landmarks = {{TrackId{7}, Vec3(1, 2, 3)}, {TrackId{9}, Vec3(4, 5, 6)}};
      for (const LiveEvent& event : {LiveEvent(StereoFrame{at(i), {std::make_shared<const Image>(64, 48, std::uint8_t(i))}}),
                                     LiveEvent(view), LiveEvent(odometry(i))})
        ASSERT_TRUE((*sink)->take(event));
    }
    LiveStatus status;
    status.t = at(19);
    status.counts.images_dropped = 3;
    status.shutter_to_pose = {12.5, 30.5, 41, 19};
    ASSERT_TRUE((*sink)->take(status));
    ASSERT_TRUE((*sink)->take(LiveMark{at(10), "a window"}));
    ASSERT_TRUE((*sink)->finish());
  }
  void TearDown() override { std::filesystem::remove(path); }

  static StereoRig rig() {
    PinholeRadtan model;
    model.fx = model.fy = 40, model.cx = 32, model.cy = 24;
    StereoRig rig;
    rig.cameras.assign(2, {Camera(model, 64, 48), {}});
    return rig;
  }
  template <class Event>
  std::vector<Event> all(const FinishedFlight& flight) const {
    std::vector<Event> out;
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const LiveEvent event = flight.event(i);
      if (const auto* one = std::get_if<Event>(&event)) out.push_back(*one);
    }
    return out;
  }

  std::string path = testing::TempDir() + "finished_flight_test_" + std::to_string(getpid()) + ".mcap";
};

TEST_F(Record, GivesTheEventsOfTheFlight) {
  const auto flight = open_finished_flight(path);
  ASSERT_TRUE(flight) << flight.error().message;
  const auto poses = all<Odometry>(**flight);
  ASSERT_EQ(poses.size(), 20u);
  for (int i = 0; i < 20; ++i) {
    const Odometry &back = poses[static_cast<std::size_t>(i)], was = odometry(i);
    EXPECT_EQ(back.t, was.t);
    EXPECT_EQ(back.id, was.id);
    EXPECT_EQ(back.health, was.health);
    if (!was.health.has_pose()) continue;
    EXPECT_EQ(back.T_WB.p, was.T_WB.p);
    EXPECT_NEAR((back.v_WB - was.v_WB).norm(), 0, 1e-12);
    EXPECT_NEAR((back.pose_covariance - was.pose_covariance).norm(), 0, 1e-12);
    EXPECT_EQ(back.reset_counter, 1u);
    EXPECT_EQ(back.stats.landmarks, 40 + i);
    EXPECT_NEAR(back.tilt_sigma_rad, 0.01, 1e-9);
  }
  EXPECT_EQ((*flight)->path.size(), 18u);
  const auto views = all<LiveView>(**flight);
  ASSERT_EQ(views.size(), 20u);
  ASSERT_EQ(views[5].features.size(), 2u);
  EXPECT_EQ(views[5].features[0].pixel, Vec2(10.5, 20));
  EXPECT_EQ(views[5].features[0].depth_m, 4.5);
  ASSERT_EQ(views[5].landmarks.size(), 2u);
  EXPECT_EQ(views[5].landmarks[1].track, TrackId{9});
  EXPECT_EQ(views[5].landmarks[1].p_W, Vec3(4, 5, 6));
  const auto images = all<StereoFrame>(**flight);
  ASSERT_EQ(images.size(), 20u);
  EXPECT_EQ(images[4].left()->row(0)[0], 4);
  const auto statuses = all<LiveStatus>(**flight);
  ASSERT_EQ(statuses.size(), 1u);
  EXPECT_EQ(statuses[0].counts.images_dropped, 3);
  EXPECT_EQ(statuses[0].shutter_to_pose.p99_ms, 30.5);
  const auto marks = all<LiveMark>(**flight);
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks[0].text, "a window");
  EXPECT_EQ(marks[0].t, at(10));
}

TEST_F(Record, IsReadAsFarAsItGoes) {
  std::ifstream file(path, std::ios::binary);
  const std::string whole(std::istreambuf_iterator<char>(file), {});
  for (int part = 0; part < 60; ++part) {
    const std::string name = path + ".cut";
    std::ofstream(name, std::ios::binary) << whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 60);
    if (const auto flight = open_finished_flight(name))
      for (std::size_t i = 0; i < (*flight)->size(); ++i) (void)(*flight)->event(i);
    std::filesystem::remove(name);
  }
}

TEST_F(Record, IsPlayedWhenSomebodyLooksAndSeeksBack) {
  const auto flight = open_finished_flight(path);
  ASSERT_TRUE(flight);
  FlightPlayer player(**flight);
  auto sink = WebSink::create({}, {}, player.description(), {.replay = [&](const WebCommand& c) { player.command(c); }});
  ASSERT_TRUE(sink);
  std::thread playing([&] { player.play(**sink); });
  TestPeer peer((*sink)->port());
  peer.watch();
  const auto last_pose = [&](const std::string& until) {
    std::string pose;
    while (const auto message = peer.message()) {
      if (message->find("\"type\":\"state\"") != std::string::npos) pose = *message;
      if (message->find(until) != std::string::npos) break;
    }
    return pose;
  };
  EXPECT_NE(last_pose("\"playing\":false").find("\"image\":19,"), std::string::npos) << "it is played to its end";
  peer.say(R"({"do":"seek","t_s":0.501})");
  EXPECT_NE(last_pose("\"playing\":false").find("\"image\":10,"), std::string::npos) << "and sought back";
  player.stop();
  playing.join();
}

TEST(RunFolder, IsAFlightToo) {
  const std::string folder = testing::TempDir() + "run_flight_test_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  {
    auto csv = OdometryCsvWriter::create(folder + "/trajectory.csv");
    ASSERT_TRUE(csv);
    for (int i = 0; i < 5; ++i) csv->write(odometry(i));
    ASSERT_TRUE(csv->close());
  }
  std::ofstream(folder + "/statistics.csv") << "#timestamp [ns],frame,tracked,detected,landmarks\n"
                                            << at(3).ns << ",3,100,20,55\n";
  const auto flight = open_finished_flight(folder);
  ASSERT_TRUE(flight) << flight.error().message;
  const LiveEvent event = (*flight)->event(4 * 3 + 2);
  const auto& o = std::get<Odometry>(event);
  EXPECT_EQ(o.t, at(3));
  EXPECT_NEAR((o.T_WB.p - odometry(3).T_WB.p).norm(), 0, 1e-9);
  EXPECT_NEAR(o.pose_covariance(0, 4), 0.25, 1e-9);
  EXPECT_EQ(o.stats.landmarks, 55);
  EXPECT_EQ(std::get<LiveView>((*flight)->event(4 * 3 + 1)).features.size(), 120u);
  EXPECT_EQ((*flight)->path.size(), 3u);
  std::filesystem::remove_all(folder);
  const auto none = open_finished_flight(folder);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("trajectory.csv: cannot be read"), std::string::npos);
}

}  // namespace finished_flight_test
}  // namespace fbvins

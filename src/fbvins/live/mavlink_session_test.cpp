// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace mavlink_session_test {

constexpr std::int64_t kMs = 1'000'000;
constexpr MavlinkAddress kAutopilot{1, 1};
constexpr Health kGood{HealthState::good, HealthReason::none}, kLost{HealthState::lost, HealthReason::no_tracks};

std::vector<MavlinkMessage> messages(const MavlinkSession::Frames& frames) {
  MavlinkDecoder decoder;
  std::vector<MavlinkMessage> all;
  for (const auto& frame : frames)
    for (const auto& read : decoder.push(frame)) all.push_back(read.message);
  return all;
}

template <class T>
std::vector<T> only(const MavlinkSession::Frames& frames) {
  std::vector<T> chosen;
  for (const auto& message : messages(frames))
    if (const auto* one = std::get_if<T>(&message)) chosen.push_back(*one);
  return chosen;
}

LivePose pose_at(std::int64_t host_ms, Health health = kGood) {
  LivePose pose;
  pose.t = Time{5'000 * kMs + host_ms * kMs}, pose.host_t = Time{host_ms * kMs};
  pose.health = health;
  return pose;
}

/// A session whose poses go to nobody in particular.
MavlinkOptions own_clock() {
  MavlinkOptions options;
  options.clock = MavlinkClock::own;
  return options;
}

LiveStatus status(Health health) {
  LiveStatus s;
  s.health = health;
  return s;
}

/// A flight controller whose clock is ahead by 100 s; requests and answers take 1 ms.
struct FlightController {
  explicit FlightController(MavlinkSession& with) : session(with) {}

  MavlinkSession& session;
  std::int64_t now_ms = 1000;
  Duration ahead{100'000 * kMs};
  MavlinkSession::Frames said;

  void hear(const MavlinkMessage& message, MavlinkAddress from = kAutopilot) {
    for (auto& frame : session.receive(encode_mavlink(message, from, 0), Time{now_ms * kMs})) said.push_back(frame);
  }
  void beat() {
    HeartbeatMessage beat;
    beat.autopilot = 12;
    hear(beat);
  }
  /// Ten milliseconds in which every request is answered.
  void step(bool answers = true) {
    now_ms += 8;
    const auto frames = session.tick(Time{now_ms * kMs});
    said.insert(said.end(), frames.begin(), frames.end());
    for (const auto& sync : only<TimesyncMessage>(frames)) {
      if (!answers || sync.tc1 != 0) continue;
      now_ms += 2;
      hear(TimesyncMessage{(now_ms - 1) * kMs + ahead.ns, sync.ts1});
    }
  }
};

TEST(MavlinkSession, BeatsOnceASecondWhoeverListens) {
  MavlinkSession session({});
  int beats = 0;
  for (int ms = 0; ms < 10'000; ms += 20) beats += static_cast<int>(only<HeartbeatMessage>(session.tick(Time{ms * kMs})).size());
  EXPECT_EQ(beats, 10);
}

TEST(MavlinkSession, TellsTheOriginUntilTheFlightControllerKnowsOne) {
  MavlinkOptions options = own_clock();
  options.origin = "-35.3632621,149.1652374,584.19";
  MavlinkSession session(options);
  FlightController ardupilot(session);
  const auto told = [&](int seconds) {
    ardupilot.said.clear();
    for (int second = 0; second < seconds; ++second) {
      ardupilot.beat();
      for (int i = 0; i < 125; ++i) ardupilot.step();
    }
    return only<GlobalOriginMessage>(ardupilot.said);
  };
  EXPECT_TRUE(told(6).empty()) << "there is no pose yet";
  session.take(status(kGood), Time{ardupilot.now_ms * kMs});
  const auto origins = told(12);
  ASSERT_GE(origins.size(), 2u) << "it is told again";
  EXPECT_LE(origins.size(), 3u);
  EXPECT_EQ(origins[0].latitude, -353632621);
  EXPECT_EQ(origins[0].longitude, 1491652374);
  EXPECT_EQ(origins[0].altitude, 584190);
  EXPECT_EQ(origins[0].target_system, 1);
  ardupilot.hear(KnownOriginMessage{}, {9, 1});
  EXPECT_FALSE(told(6).empty()) << "another vehicle's";
  ardupilot.hear(KnownOriginMessage{});
  EXPECT_TRUE(told(12).empty());
  ardupilot.now_ms += 60'000;  // it starts anew
  session.tick(Time{ardupilot.now_ms * kMs});
  EXPECT_FALSE(told(6).empty());
  MavlinkSession silent(own_clock());
  silent.take(status(kGood), Time{1000 * kMs});
  FlightController px4(silent);
  px4.beat();
  for (int i = 0; i < 1000; ++i) px4.step();
  EXPECT_TRUE(only<GlobalOriginMessage>(px4.said).empty()) << "it is not asked to";
}

TEST(MavlinkSession, AnOriginThatIsNone) {
  for (const char* text :
       {"47", "47,8", "91,8,400", "47,181,400", "47,8,20000", "47,8,400,1", "47;8;400", "a,b,c", "nan,8,400"}) {
    const auto origin = parse_mavlink_origin(text);
    ASSERT_FALSE(origin) << text;
    EXPECT_EQ(origin.error().message,
              std::string("live.mavlink.origin: '") + text + "' is not LATITUDE,LONGITUDE,ALTITUDE in degrees and metres");
  }
  EXPECT_FALSE(*parse_mavlink_origin(""));
  EXPECT_EQ((*parse_mavlink_origin("47.5, 8.25, 400"))->longitude, 82500000);
}

TEST(MavlinkSession, FiftyPosesASecondOfTwoHundredOrSoReadings) {
  for (const double imu_hz : {100.0, 200.0, 400.0, 1000.0}) {
    MavlinkSession session(own_clock());
    int poses = 0;
    for (int i = 0; i < 10 * imu_hz; ++i) {
      LivePose pose = pose_at(0);
      pose.host_t = Time{static_cast<std::int64_t>(i * 1e9 / imu_hz) + (i % 3 - 1) * 300'000};  // jitter
      poses += static_cast<int>(only<OdometryMessage>(session.take(pose)).size());
    }
    EXPECT_NEAR(poses, 500, 2) << imu_hz;
  }
}

TEST(MavlinkSession, NoPoseIsSentBeforeTheFlightControllersClockIsKnown) {
  MavlinkSession session({});
  FlightController px4(session);
  EXPECT_TRUE(session.take(pose_at(900)).empty());
  px4.beat();
  int before = 0;
  for (; !session.clock().known() && before < 100; ++before) {
    EXPECT_TRUE(session.take(pose_at(px4.now_ms)).empty());
    px4.step();
  }
  EXPECT_LT(before, 30) << "it is asked more often until it is known";
  EXPECT_GT(session.poses_withheld(), 1);
  px4.now_ms += 20;
  EXPECT_NEAR(static_cast<double>(only<OdometryMessage>(session.take(pose_at(px4.now_ms)))[0].time_usec),
              1e3 * static_cast<double>(px4.now_ms) + 100e6, 1.0);
  EXPECT_EQ(session.poses(), 1);
}

TEST(MavlinkSession, AFlightControllerThatRestartsGetsNoPoseOnItsOldClock) {
  MavlinkSession session({});
  FlightController px4(session);
  const auto fly = [&](int steps, bool answers) {
    std::vector<double> ahead_s;
    for (int i = 0; i < steps; ++i) {
      if (answers && i % 50 == 0) px4.beat();
      for (const auto& sent : only<OdometryMessage>(session.take(pose_at(px4.now_ms))))
        ahead_s.push_back(1e-6 * static_cast<double>(sent.time_usec) - 1e-3 * static_cast<double>(px4.now_ms));
      px4.step(answers);
    }
    return ahead_s;
  };
  EXPECT_GT(fly(300, true).size(), 80u);
  // A board is silent while it starts. One that is back at once gets what is sent until its next answer, a tenth of a second
  // later.
  for (const auto& [silent_steps, most_old] : {std::pair{400, 0}, {0, 6}}) {
    const double old_s = px4.ahead.seconds();
    fly(silent_steps, false);
    px4.ahead = px4.ahead - Duration{40'000 * kMs};
    const auto after_s = fly(300, true);
    EXPECT_GT(after_s.size(), 80u);
    EXPECT_LE(std::count_if(after_s.begin(), after_s.end(), [&](double s) { return std::abs(s - old_s) < 1; }), most_old);
    EXPECT_NEAR(after_s.back(), px4.ahead.seconds(), 1e-3);
  }
}

TEST(MavlinkSession, PosesStopBeforeASilentFlightControllerCanHaveRestarted) {
  MavlinkSession session({});
  FlightController px4(session);
  px4.beat();
  for (int i = 0; i < 100; ++i) px4.step();
  const std::int64_t last_ms = px4.now_ms;
  EXPECT_FALSE(session.take(pose_at(last_ms + 1500)).empty());
  EXPECT_TRUE(session.take(pose_at(last_ms + 2100)).empty());
}

TEST(MavlinkSession, ItIsSaidWhyNoPosesAreSent) {
  MavlinkSession session({});
  FlightController px4(session);
  const auto after_s = [&](double seconds, bool answers) {
    for (const std::int64_t end = px4.now_ms + static_cast<std::int64_t>(1e3 * seconds); px4.now_ms < end;) px4.step(answers);
    return session.problem(Time{px4.now_ms * kMs});
  };
  EXPECT_EQ(after_s(2, false), "");
  EXPECT_NE(after_s(2, false).find("no flight controller is heard"), std::string::npos);
  px4.beat();
  EXPECT_NE(after_s(2, false).find("does not answer TIMESYNC"), std::string::npos);
  px4.beat();
  EXPECT_EQ(after_s(1, true), "");
  px4.beat();
  EXPECT_EQ(after_s(2.5, false), "");
  px4.beat();
  EXPECT_EQ(after_s(2, false), "");
  px4.beat();
  EXPECT_NE(after_s(2.5, false).find("not confirmed"), std::string::npos);
}

TEST(MavlinkSession, WithItsOwnClockItAsksNobody) {
  MavlinkSession session(own_clock());
  FlightController logger(session);
  EXPECT_EQ(only<OdometryMessage>(session.take(pose_at(900)))[0].time_usec, 900'000u);
  logger.beat();
  for (int i = 0; i < 500; ++i) logger.step(false);
  EXPECT_TRUE(only<TimesyncMessage>(logger.said).empty());
  EXPECT_EQ(session.problem(Time{logger.now_ms * kMs}), "");
  logger.hear(TimesyncMessage{0, 78});
  EXPECT_EQ(only<TimesyncMessage>(logger.said).at(0).tc1, logger.now_ms * kMs);
}

TEST(MavlinkSession, ARestartOfTheProgramIsToldAsAReset) {
  std::vector<int> counters;
  for (const std::uint32_t first : {255u, 256u, 257u}) {  // a process's first reset_counter, one further at each start
    MavlinkSession session(own_clock());
    for (const std::int64_t ms : {100, 200}) {
      LivePose pose = pose_at(ms);
      pose.reset_counter = first;
      counters.push_back(only<OdometryMessage>(session.take(pose)).at(0).reset_counter);
    }
  }
  EXPECT_EQ(counters, (std::vector<int>{255, 255, 0, 0, 1, 1}));
}

TEST(MavlinkSession, TheFrameIsTheOneOfTheOptions) {
  MavlinkOptions options = own_clock();
  EXPECT_EQ(only<OdometryMessage>(MavlinkSession(options).take(pose_at(100)))[0].frame_id, 20);
  options.frame = MavlinkFrameId::local_ned;
  MavlinkSession ned(options);
  EXPECT_EQ(only<OdometryMessage>(ned.take(pose_at(100)))[0].frame_id, 1);
  EXPECT_EQ(only<OdometryMessage>(ned.take(pose_at(200, kLost)))[0].frame_id, 1);
  EXPECT_EQ(only<OdometryMessage>(ned.take(pose_at(300)))[0].child_frame_id, 12);
}

TEST(MavlinkSession, TheHeartbeatTellsPx4WhetherTheOdometryWorks) {
  constexpr Health kStarting{HealthState::initialising, HealthReason::waiting_for_motion_or_rest},
      kDegraded{HealthState::degraded, HealthReason::few_tracks};
  MavlinkSession session({});
  std::vector<int> states;
  std::int64_t ms = 0;
  for (const Health health : {kStarting, kGood, kDegraded, kGood, kLost, kStarting, kGood})
    for (const auto& beat : only<HeartbeatMessage>(session.take(status(health), Time{(ms += 1000) * kMs})))
      states.push_back(beat.system_status);
  // MAV_STATE: calibrating, active, critical, active, flight termination until there is a pose again
  EXPECT_EQ(states, (std::vector<int>{2, 4, 5, 4, 8, 8, 4}));
}

TEST(MavlinkSession, AQuestionForTheTimeIsAnsweredOnThatClockAndNotBefore) {
  MavlinkSession session({});
  FlightController px4(session);
  px4.beat();
  px4.hear(TimesyncMessage{0, 77});
  EXPECT_TRUE(only<TimesyncMessage>(px4.said).empty());
  for (int i = 0; i < 200; ++i) px4.step();
  px4.said.clear();
  px4.hear(TimesyncMessage{0, 78});
  const auto answers = only<TimesyncMessage>(px4.said);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].ts1, 78);
  EXPECT_NEAR(static_cast<double>(answers[0].tc1), static_cast<double>(px4.now_ms * kMs + px4.ahead.ns), 1e3);
}

TEST(MavlinkSession, OnlyTheFlightControllersOwnAnswersToOurQuestionsCount) {
  MavlinkSession session({});
  FlightController px4(session);
  px4.beat();
  for (int i = 0; i < 300; ++i) {
    px4.step(false);
    px4.hear(TimesyncMessage{5 * kMs, 12'345});  // never asked
    for (const auto& sync : only<TimesyncMessage>(px4.said)) px4.hear(TimesyncMessage{5 * kMs, sync.ts1}, {255, 190});
    px4.said.clear();
    px4.beat();
  }
  EXPECT_FALSE(session.clock().known());
}

TEST(MavlinkSession, AGroundStationOrAnotherVehicleIsNotTheFlightController) {
  MavlinkSession session({});
  FlightController px4(session);
  px4.hear(HeartbeatMessage{}, {1, 190});
  HeartbeatMessage other;
  other.autopilot = 12;
  px4.hear(other, {2, 1});
  EXPECT_FALSE(session.flight_controller_heard(Time{px4.now_ms * kMs}));
  px4.beat();
  EXPECT_TRUE(session.flight_controller_heard(Time{px4.now_ms * kMs}));
  EXPECT_FALSE(session.flight_controller_heard(Time{(px4.now_ms + 3000) * kMs}));
}

TEST(MavlinkSession, HealthIsToldWhenItChangesAndToWhoeverComesBack) {
  MavlinkSession session({});
  FlightController px4(session);
  const auto told = [&] {
    std::vector<std::string> texts;
    for (int i = 0; i < 100; ++i) px4.step();
    for (const auto& text : only<StatusTextMessage>(px4.said)) texts.emplace_back(text.text.data());
    px4.said.clear();
    return texts;
  };
  session.take(status(kGood), Time{px4.now_ms * kMs});
  EXPECT_TRUE(told().empty());  // nobody there
  px4.beat();
  EXPECT_EQ(told(), std::vector<std::string>{"VIO good"});
  px4.beat();
  EXPECT_TRUE(told().empty());
  px4.said = session.take(status(kLost), Time{px4.now_ms * kMs});
  EXPECT_EQ(told(), std::vector<std::string>{"VIO lost: no_tracks"});
  for (int i = 0; i < 5; ++i) told();  // silent for more than three seconds
  px4.beat();
  EXPECT_EQ(told(), std::vector<std::string>{"VIO lost: no_tracks"});
}

TEST(MavlinkSession, WithoutAPoseOdometrySaysSoAndVisionIsSilent) {
  MavlinkSession px4(own_clock());
  const auto none = only<OdometryMessage>(px4.take(pose_at(100, kLost)));
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(none[0].quality, -1);
  EXPECT_NE(none[0].x, none[0].x);
  MavlinkOptions options = own_clock();
  options.dialect = MavlinkDialect::vision_estimate;
  MavlinkSession logger(options);
  EXPECT_TRUE(logger.take(pose_at(100, kLost)).empty());
  const auto both = messages(logger.take(pose_at(200)));
  ASSERT_EQ(both.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<VisionPositionMessage>(both[0]));
  EXPECT_TRUE(std::holds_alternative<VisionSpeedMessage>(both[1]));
}

TEST(MavlinkSession, ArduPilotGetsNothingBeforeTheFirstPoseAndNeverNaN) {
  MavlinkOptions options = own_clock();
  options.dialect = MavlinkDialect::ardupilot;
  options.frame = MavlinkFrameId::local_ned;  // ArduPilot would ignore it
  MavlinkSession ardupilot(options);
  EXPECT_TRUE(ardupilot.take(pose_at(100, Health{HealthState::initialising, HealthReason::none})).empty());
  EXPECT_TRUE(ardupilot.take(pose_at(200, kLost)).empty());
  EXPECT_EQ(ardupilot.poses(), 0);
  const auto pose = only<OdometryMessage>(ardupilot.take(pose_at(300)));
  ASSERT_EQ(pose.size(), 1u);
  EXPECT_EQ(pose[0].frame_id, kMavFrameLocalFrd);
  EXPECT_GE(pose[0].quality, 1);
  for (const Health& without : {kLost, Health{HealthState::initialising, HealthReason::none}}) {
    const std::int64_t now_ms = without == kLost ? 400 : 500;
    const auto none = only<OdometryMessage>(ardupilot.take(pose_at(now_ms, without)));
    ASSERT_EQ(none.size(), 1u);
    EXPECT_EQ(none[0].quality, -1);
    EXPECT_EQ(none[0].x, pose[0].x);
    EXPECT_EQ(none[0].q, pose[0].q);
    EXPECT_GT(none[0].time_usec, pose[0].time_usec);
    EXPECT_EQ(none[0].reset_counter, pose[0].reset_counter);
  }
}

}  // namespace mavlink_session_test
}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// What the readers of missions, motion-capture files and flight logs return for damaged files: an error of one sentence that
// names the file, or everything that is intact.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "fbvins/flight/mission.hpp"
#include "fbvins/io/little_endian.hpp"
#include "fbvins/mocap/motion_capture.hpp"
#include "fbvins/tuning/loop_log.hpp"
#include "fbvins/tuning/ulog.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"
#include "tests/support/marker_test_files.hpp"

namespace fbvins::test {
namespace broken_flight_files_test {

using Read = std::string (*)(const std::string& text);

/// What a reader says, or "read".
template <class T>
std::string verdict(const Result<T>& result) {
  return result ? "read" : result.error().message;
}

std::string read_as_mission(const std::string& text) {
  const Result<Mission> mission = parse_mission(text, "file");
  if (!mission) return mission.error().message;
  return verdict(site_of(*mission, {}, 0.2));
}
std::string read_as_markers(const std::string& text) {
  Result<MotionCapture> read = parse_motion_capture(text, "file");
  return read ? verdict(choose_body(*std::move(read), "", "file")) : read.error().message;
}
std::string read_as_ulog(const std::string& bytes) { return verdict(Ulog::parse(bytes, "file")); }

// ---------------------------------------------------------------- whole files

std::string whole_mission() {
  return "limits: {speed: 0.8, accel: 1.5, jerk: 6, yaw_rate: 60}\n"
         "geofence: {x: [-1, 3], y: [-1, 2], z: [-0.5, 2]}\n"
         "place: {kind: room, size: [8, 6, 3], start: [-2, 0], heading: 90}\n"
         "steps:\n"
         "  - takeoff: 0.6\n"
         "  - goto: {via: [[1, 0, 1], [1, 1, 1]], to: [0.5, 1, 0.8], speed: 0.3, nose: forward}\n"
         "  - hold: 2.5\n"
         "  - land\n"
         "faults:\n"
         "  - {stop: odometry, at: 5, for: 1}\n";
}

WrittenFile body_that_tumbles() {
  WrittenFile file;
  file.bodies = {{"quad", {}}};
  for (int i = 0; i < 30; ++i) {
    const double x = 0.1 * i;
    file.bodies[0].poses.emplace_back(Pose<V, K>(so3_exp(Vec3(x, 0.2, -0.5 * x)), Vec3(1 + x, 2, 3 - x)));
  }
  return file;
}
std::string whole_motive() { return motive_csv(body_that_tumbles()); }
std::string whole_vicon() { return vicon_csv(body_that_tumbles(), true); }
std::string whole_qualisys() { return qualisys_tsv(body_that_tumbles()); }
std::string whole_tum() { return "1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0 1\n1.7 1 2 3 0 0 0 1\n"; }

std::string ulog_message(char type, const std::string& body) {
  std::string out;
  append_le(out, static_cast<std::uint16_t>(body.size()));
  return out + type + body;
}

/// Twelve seconds of the four topics that a tuner reads, `micro` stamping them.
std::string whole_ulog(std::uint64_t (*micro)(std::uint64_t i) = [](std::uint64_t i) { return 1'000'000 + 5'000 * i; }) {
  const std::vector<std::pair<std::string, std::string>> topics = {{"vehicle_angular_velocity", "float[3] xyz"},
                                                                   {"vehicle_torque_setpoint", "float[3] xyz"},
                                                                   {"vehicle_local_position", "float vx;float vy;float vz"},
                                                                   {"vehicle_local_position_setpoint", "float[3] acceleration"}};
  std::string out("ULog\x01\x12\x35\x01", 8);
  append_le(out, std::uint64_t{0});
  std::uint16_t number = 0;
  for (const auto& [topic, fields] : topics) {
    out += ulog_message('F', fmt::format("{}:uint64_t timestamp;{};", topic, fields));
    std::string body(1, '\0');
    append_le(body, number++);
    out += ulog_message('A', body + topic);
  }
  for (std::uint64_t i = 0; i < 2400; ++i)
    for (std::uint16_t topic = 0; topic < number; ++topic) {
      std::string body;
      append_le(body, topic), append_le(body, micro(i));
      for (int axis = 0; axis < 3; ++axis) append_le(body, static_cast<float>(0.01 * static_cast<double>(i % 7)));
      out += ulog_message('D', body);
    }
  return out;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  replace(text, from, to);
  return text;
}

// ---------------------------------------------------------------- refused

struct Broken {
  const char* name;
  Read read;
  std::string text;
  const char* sentence;  ///< after "file:"
};

void PrintTo(const Broken& c, std::ostream* out) { *out << c.name; }

std::string mission_with(const std::string& from, const std::string& to) { return replaced(whole_mission(), from, to); }

std::vector<Broken> broken_files() {
  const std::string far_away = fmt::format("via: [{}]", "[1, 0, 1], [1e9, 1, 1]");
  std::string long_way = "steps:\n  - takeoff: 1\n";
  for (int i = 0; i < 120; ++i) long_way += fmt::format("  - goto: [{}, 0, 1]\n", i % 2 == 0 ? 999 : -999);
  std::string many_points = "[1, 0, 1]";
  for (int i = 0; i < 30; ++i) many_points += ", [1, 0, 1]";
  return {
      {"MissionEmpty", read_as_mission, "", " holds no fields"},
      {"MissionOfImages", read_as_mission, make_png(1, {}), ""},
      {"MissionIsAList", read_as_mission, "- takeoff: 1\n", ""},
      {"MissionStepsAreAMap", read_as_mission, "steps: {takeoff: 1}\n", "1: steps: must be a list"},
      {"MissionUnclosed", read_as_mission, mission_with("to: [0.5, 1, 0.8], speed", "to: [0.5, 1, 0.8, speed"), "6"},
      {"MissionNoNumber", read_as_mission, mission_with("takeoff: 0.6", "takeoff: high"),
       "5: 'takeoff' must be a number from 0.2 to 100"},
      {"MissionNaN", read_as_mission, mission_with("takeoff: 0.6", "takeoff: .nan"),
       "5: 'takeoff' must be a number from 0.2 to 100"},
      {"MissionForEver", read_as_mission, mission_with("hold: 2.5", "hold: inf"), "7: 'hold' must be a number from 0 to 3600"},
      {"MissionPointNaN", read_as_mission, mission_with("to: [0.5, 1, 0.8]", "to: [nan, 1, 0.8]"),
       "6: to: holds something that is not a number"},
      {"MissionOffTheMap", read_as_mission, mission_with("via: [[1, 0, 1], [1, 1, 1]]", far_away),
       "6: via: is further away than 1000 m"},
      {"MissionTooManyPoints", read_as_mission, mission_with("[[1, 0, 1], [1, 1, 1]]", "[" + many_points + "]"),
       "6: via: wants points of three numbers, 21 at most"},
      {"MissionRoundTheWorld", read_as_mission, long_way, "53: the path is longer than 100 km"},
      {"MissionVastRoom", read_as_mission, mission_with("[8, 6, 3]", "[900, 900, 3]"), "3: size: is larger than 200 m"},
      {"MissionTwoStepsInOne", read_as_mission, mission_with("- hold: 2.5", "- {hold: 2, land: 1}"),
       "7: a step is one of takeoff, goto, hold, yaw, identify, land"},
      {"MissionFaultOfNothing", read_as_mission, mission_with("{stop: odometry, at: 5, for: 1}", "[]"),
       "10: names and values are wanted here"},
      {"MissionLimitsAreANumber", read_as_mission, mission_with("{speed: 0.8, accel: 1.5, jerk: 6, yaw_rate: 60}", "3"),
       "1: names and values are wanted here"},

      {"MarkersEmpty", read_as_markers, "", ""},
      {"MarkersOfImages", read_as_markers, make_png(1, {}), ""},
      {"MotiveHeaderAlone", read_as_markers, whole_motive().substr(0, 300), ""},
      {"MotiveWithoutRows", read_as_markers, whole_motive().substr(0, whole_motive().find("\r\n0,")), ""},
      {"MotiveWithoutUnits", read_as_markers, replaced(whole_motive(), "Length Units,Meters", "Length Units,"),
       "1: lengths in '': export metres or millimetres"},
      {"MotiveInEuler", read_as_markers, replaced(whole_motive(), "Rotation Type,Quaternion", "Rotation Type,XYZ"),
       "1: rotations of type 'XYZ': export quaternions"},
      {"ViconNoRate", read_as_markers, replaced(whole_vicon(), "Objects\n120\n", "Objects\nfast\n"),
       "2: this is not a frame rate in Hz"},
      {"ViconInInches", read_as_markers, replaced(whole_vicon(), ",,,,,mm,mm,mm\n", ",,,,,in,in,in\n"),
       "5: lengths are neither in mm nor in m"},
      {"ViconTrajectories", read_as_markers, replaced(whole_vicon(), "Objects", "Model Outputs"),
       "1: Vicon's table of Model Outputs has no poses: export objects or segments"},
      {"QualisysIn3D", read_as_markers, replaced(whole_qualisys(), "DATA_INCLUDED\t6D", "DATA_INCLUDED\t3D"),
       "9: 3D data: export 6D"},
      {"QualisysNoBody", read_as_markers, replaced(whole_qualisys(), "BODY_NAMES\tquad", "BODY_NAMES"),
       "1: there is no body in it (BODY_NAMES): export 6D"},
      {"TumOfWords", read_as_markers, "there was a flight and it was good\n", ""},

      {"UlogEmpty", read_as_ulog, "", " this is not a PX4 log (.ulg)"},
      {"UlogIsACsv", read_as_ulog, "timestamp,x,y,z\n", " this is not a PX4 log (.ulg)"},
      {"UlogHeadAlone", read_as_ulog, whole_ulog().substr(0, 16), " a log without topics"},
      {"UlogFormatWithoutName", read_as_ulog, whole_ulog().substr(0, 16) + ulog_message('F', "float x;"),
       " a format without a name at byte 16"},
      {"UlogFieldWithoutName", read_as_ulog, whole_ulog().substr(0, 16) + ulog_message('F', "a:float;"),
       " a field without a name at byte 16"},
      {"UlogNoArray", read_as_ulog, whole_ulog().substr(0, 16) + ulog_message('F', "a:float[x] y;"),
       " 'float[x]' is no array at byte 16"},
      {"UlogVastArrays", read_as_ulog, whole_ulog().substr(0, 16) + ulog_message('F', "a:float[60000] y;"),
       " 'y' is larger than a message can be at byte 16"},
  };
}

class BrokenFlightFile : public testing::TestWithParam<Broken> {};

TEST_P(BrokenFlightFile, IsNamedInOneSentence) {
  const std::string said = GetParam().read(GetParam().text);
  EXPECT_EQ(said.find('\n'), std::string::npos);
  const std::string expected = GetParam().sentence;
  EXPECT_TRUE(said.starts_with("file:" + expected)) << said;
}
INSTANTIATE_TEST_SUITE_P(Table, BrokenFlightFile, testing::ValuesIn(broken_files()),
                         [](const auto& row) { return std::string(row.param.name); });

// ---------------------------------------------------------------- anything else: read, or one sentence

struct Whole {
  const char* name;
  Read read;
  std::string text;
};

void PrintTo(const Whole& c, std::ostream* out) { *out << c.name; }

std::vector<Whole> whole_files() {
  return {{"Mission", read_as_mission, whole_mission()}, {"Motive", read_as_markers, whole_motive()},
          {"Vicon", read_as_markers, whole_vicon()},     {"Qualisys", read_as_markers, whole_qualisys()},
          {"Tum", read_as_markers, whole_tum()},         {"Ulog", read_as_ulog, whole_ulog().substr(0, 4000)}};
}

class DamagedFlightFile : public testing::TestWithParam<Whole> {
 protected:
  void expect_an_answer(const std::string& text) {
    const std::string said = GetParam().read(text);
    EXPECT_TRUE(said == "read" || (said.starts_with("file:") && said.find('\n') == std::string::npos)) << said;
  }
};

TEST_P(DamagedFlightFile, IsReadWhole) { EXPECT_EQ(GetParam().read(GetParam().text), "read"); }

TEST_P(DamagedFlightFile, CutAnywhere) {
  const std::string& text = GetParam().text;
  for (std::size_t size = 0; size < text.size(); size += 1 + text.size() / 300) expect_an_answer(text.substr(0, size));
}

TEST_P(DamagedFlightFile, WithAByteChanged) {
  const std::string& text = GetParam().text;
  for (std::size_t at = 0; at < text.size(); at += 1 + text.size() / 300)
    for (const char c : {'\0', '\xff', '-', ',', '9'}) {
      std::string changed = text;
      changed[at] = c;
      expect_an_answer(changed);
    }
}

TEST_P(DamagedFlightFile, WithALineLeftOutOrTwice) {
  const std::string& text = GetParam().text;
  const auto lines = std::count(text.begin(), text.end(), '\n');
  for (std::ptrdiff_t i = 0; i < std::min<std::ptrdiff_t>(lines, 40); ++i) {
    std::string without = text, twice = text;
    edit_lines(without, [i](std::vector<std::string>& all) { all.erase(all.begin() + i); });
    edit_lines(twice, [i](std::vector<std::string>& all) {
      all.insert(all.begin() + i, std::string(all[static_cast<std::size_t>(i)]));
    });
    expect_an_answer(without);
    expect_an_answer(twice);
  }
}
INSTANTIATE_TEST_SUITE_P(Table, DamagedFlightFile, testing::ValuesIn(whole_files()),
                         [](const auto& row) { return std::string(row.param.name); });

// ---------------------------------------------------------------- input of the tuner

class BrokenLog : public testing::Test {
 protected:
  std::string ulog(const std::string& bytes) {
    const std::string path = folder_.path() + "/flight.ulg";
    std::ofstream(path, std::ios::binary) << bytes;
    return said(path);
  }
  /// A folder of `fbvins fly` with twelve seconds in flight; `change` is given its header and a row.
  std::string csv(const std::function<void(std::string& header, std::string& row)>& change, const std::string& control = "",
                  std::int64_t period_ns = 5'000'000) {
    const std::string path = folder_.path() + "/fly";
    std::string header = "#t [ns]", row;
    for (const char* name : {"rate", "torque", "acceleration_setpoint", "estimate_v"})
      for (const char axis : {'x', 'y', 'z'}) header += fmt::format(",{}_{}", name, axis), row += ",0.25";
    header += ",mode", row += ",mission";
    change(header, row);
    std::string text = header + "\n";
    for (std::int64_t i = 0; i < 2400; ++i) text += fmt::format("{}{}\n", 1'000'000'000 + period_ns * i, row);
    write_folder({{"flight.csv", text}, {"control.yaml", control}}, path);
    return said(path);
  }

 private:
  std::string said(const std::string& path) {
    std::string text = verdict(read_loop_log(path));
    EXPECT_EQ(text.find('\n'), std::string::npos);
    if (const std::size_t at = text.find(folder_.path() + "/"); at != std::string::npos)
      text.erase(at, folder_.path().size() + 1);
    return text;
  }
  TemporaryFolder folder_;
};

TEST_F(BrokenLog, WhatIsWholeIsRead) {
  EXPECT_EQ(ulog(whole_ulog()), "read");
  EXPECT_EQ(csv([](std::string&, std::string&) {}, "rate: {MC_ROLLRATE_P: 0.12}\n"), "read");
}

TEST_F(BrokenLog, OfPx4) {
  EXPECT_EQ(ulog("not a log"), "flight.ulg: this is not a PX4 log (.ulg)");
  EXPECT_EQ(ulog(whole_ulog().substr(0, 20'000)), "flight.ulg: only 1.0 s in flight; at least 10 s are needed");
  EXPECT_EQ(ulog(replaced(whole_ulog(), "vehicle_torque_setpoint:", "vehicle_torque_setpoinT:")),
            "flight.ulg: 'vehicle_torque_setpoint' was not logged (SDLOG_PROFILE: default and high rate)");
  EXPECT_EQ(ulog(whole_ulog([](std::uint64_t i) { return i + 1 < 2400 ? 5'000 * i : std::uint64_t{900'000'000'000'000'000}; })),
            "flight.ulg: its stamps span 250000000 h")
      << "one damaged stamp must not become an endless log";
}

TEST_F(BrokenLog, OfOurOwn) {
  const auto mission = [](const std::string& from, const std::string& to) {
    return [=](std::string& header, std::string& row) {
      (header.find(from) != std::string::npos ? header : row) =
          replaced(header.find(from) != std::string::npos ? header : row, from, to);
    };
  };
  EXPECT_EQ(csv(mission(",mode", ",moods"), "rate: {}\n"),
            "fly/flight.csv: there is no column 'mode': this is no flight.csv of `fbvins fly`");
  EXPECT_EQ(csv(mission("torque_y", "talk_y"), "rate: {}\n"),
            "fly/flight.csv: there is no column 'torque_y': this is no flight.csv of `fbvins fly`");
  EXPECT_EQ(csv([](std::string&, std::string& row) { row.replace(1, 4, "nan"); }, "rate: {}\n"),
            "fly/flight.csv: row 1 holds something that is not a number");
  EXPECT_EQ(csv(mission(",mission", ",waiting"), "rate: {}\n"), "fly/flight.csv: only 0.0 s in flight; at least 10 s are needed");
  EXPECT_EQ(csv([](std::string& header, std::string&) { header.erase(0, 1); }, "rate: {}\n"),
            "fly/flight.csv:1: a header line is missing");
  for (const std::int64_t period_ns : {100'000'000, 670'000'000, 2'000'000'000})
    EXPECT_EQ(csv([](std::string&, std::string&) {}, "rate: {}\n", period_ns),
              fmt::format("fly/flight.csv: its rows are {:.3f} s apart; at least 20 a second are needed", 1e-9 * period_ns));
  EXPECT_EQ(csv([](std::string&, std::string&) {}, "rate: {MC_ROLLRATE_P: much}\n").substr(0, 19), "fly/control.yaml:1:");
}

}  // namespace broken_flight_files_test
}  // namespace fbvins::test

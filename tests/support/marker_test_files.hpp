// SPDX-License-Identifier: Apache-2.0
// For tests: files as motion-capture systems export them, written by their documented layouts and not by our reader's code.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "fbvins/io/numbers.hpp"
#include "fbvins/types/motion_capture.hpp"

namespace fbvins::test {

/// One body at the stamps of a recording; nullopt: not seen.
struct WrittenBody {
  std::string name;
  std::vector<std::optional<Pose<V, K>>> poses;
};

struct WrittenFile {
  double rate_hz = 120;
  std::vector<WrittenBody> bodies;
};

/// Motive 2 and 3: y up, quaternions x y z w; a column of mean marker error after each body, and a body's first marker.
inline std::string motive_csv(const WrittenFile& file, bool millimetres = false) {
  std::string out = fmt::format(
      "Format Version,1.23,Take Name,Take 1,Take Notes,,Capture Frame Rate,{0:.6f},Export Frame Rate,{0:.6f},Capture Start Time,"
      "2024-03-01 02.03.04.567 PM,Total Frames in Take,{1},Total Exported Frames,{1},Rotation Type,Quaternion,Length Units,{2},"
      "Coordinate Space,Global\r\n\r\n",
      file.rate_hz, file.bodies.front().poses.size(), millimetres ? "Millimeters" : "Meters");
  std::string types = ",", names = ",", ids = ",", groups = ",", columns = "Frame,Time (Seconds)";
  for (const WrittenBody& body : file.bodies) {
    for (int i = 0; i < 8; ++i) {
      types += ",Rigid Body", names += ",\"" + body.name + "\"", ids += ",\"41D5E4DE\"";
      groups += i < 4 ? ",Rotation" : i < 7 ? ",Position" : ",Mean Marker Error";
    }
    for (int i = 0; i < 3; ++i)
      types += ",Rigid Body Marker", names += "," + body.name + ":Marker1", ids += ",\"77\"", groups += ",Position";
    columns += ",X,Y,Z,W,X,Y,Z,,X,Y,Z";
  }
  for (const std::string& line : {types, names, ids, groups, columns}) out += line + "\r\n";
  const Quat lying(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);  // z up to y up
  for (std::size_t i = 0; i < file.bodies.front().poses.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{},{:.6f}", i, static_cast<double>(i) / file.rate_hz);
    for (const WrittenBody& body : file.bodies) {
      if (!body.poses[i]) {
        out += ",,,,,,,,,,,";
        continue;
      }
      const Quat q = lying * body.poses[i]->q;
      const Vec3 p = (millimetres ? 1000 : 1) * (lying * body.poses[i]->p);
      fmt::format_to(std::back_inserter(out), ",{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},0.000150,1,2,3", q.x(), q.y(),
                     q.z(), q.w(), p.x(), p.y(), p.z());
    }
    out += "\r\n";
  }
  return out;
}

/// Tracker and Nexus: "Objects" or "Segments", rate, names, columns, units; then Nexus's next table.
inline std::string vicon_csv(const WrittenFile& file, bool quaternions, const std::string& title = "Objects") {
  std::string names = ",", columns = "Frame,Sub Frame", units = ",";
  for (const WrittenBody& body : file.bodies) {
    names += fmt::format(",{}:{}", body.name, body.name) + (quaternions ? ",,,,,," : ",,,,,");
    columns += quaternions ? ",RX,RY,RZ,RW,TX,TY,TZ" : ",RX,RY,RZ,TX,TY,TZ";
    units += quaternions ? ",,,,,mm,mm,mm" : ",deg,deg,deg,mm,mm,mm";
  }
  std::string out = fmt::format("{}\n{:g}\n{}\n{}\n{}\n", title, file.rate_hz, names, columns, units);
  for (std::size_t i = 0; i < file.bodies.front().poses.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{},0", i + 1);
    for (const WrittenBody& body : file.bodies) {
      if (!body.poses[i]) {
        out += quaternions ? ",,,,,,," : ",,,,,,";
        continue;
      }
      const Quat& q = body.poses[i]->q;
      const Vec3 p = 1000 * body.poses[i]->p, v = so3_log(q) * (180 / std::numbers::pi);
      if (quaternions) fmt::format_to(std::back_inserter(out), ",{:.9f},{:.9f},{:.9f},{:.9f}", q.x(), q.y(), q.z(), q.w());
      else fmt::format_to(std::back_inserter(out), ",{:.7f},{:.7f},{:.7f}", v.x(), v.y(), v.z());
      fmt::format_to(std::back_inserter(out), ",{:.6f},{:.6f},{:.6f}", p.x(), p.y(), p.z());
    }
    out += "\n";
  }
  return out + "\nTrajectories\n" + fmt::format("{:g}\n,,a,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,4,5,6\n", file.rate_hz);
}

/// QTM: keys, then a row of names, then millimetres, degrees and the rotation column after column.
inline std::string qualisys_tsv(const WrittenFile& file, bool with_time = true) {
  const std::size_t frames = file.bodies.front().poses.size();
  std::string out = fmt::format(
      "NO_OF_FRAMES\t{}\nNO_OF_CAMERAS\t4\nNO_OF_BODIES\t{}\nFREQUENCY\t{:g}\nNO_OF_ANALOG\t0\nANALOG_FREQUENCY\t0\n"
      "DESCRIPTION\t--\nTIME_STAMP\t2020-01-22, 17:47:17\t22107.99179716\nDATA_INCLUDED\t6D\nBODY_NAMES",
      frames, file.bodies.size(), file.rate_hz);
  for (const WrittenBody& body : file.bodies) out += "\t" + body.name;
  out += with_time ? "\nFrame\tTime" : "\nFrame";
  for (const WrittenBody& body : file.bodies) {
    out += "\t" + body.name + " X\tY\tZ\tRoll\tPitch\tYaw\tResidual";
    for (int i = 0; i < 9; ++i) fmt::format_to(std::back_inserter(out), "\tRot[{}]", i);
  }
  out += "\n";
  for (std::size_t i = 0; i < frames; ++i) {
    fmt::format_to(std::back_inserter(out), "{}", i + 1);
    if (with_time) fmt::format_to(std::back_inserter(out), "\t{:.5f}", static_cast<double>(i) / file.rate_hz);
    for (const WrittenBody& body : file.bodies) {
      const bool seen = body.poses[i].has_value();
      const Vec3 p = seen ? Vec3(1000 * body.poses[i]->p) : Vec3::Zero();
      const Mat3 R = seen ? body.poses[i]->R() : Mat3::Zero();
      fmt::format_to(std::back_inserter(out), "\t{:.5f}\t{:.5f}\t{:.5f}\t0.00000\t0.00000\t0.00000\t{:.5f}", p.x(), p.y(), p.z(),
                     seen ? 0.2 : -1.0);
      for (int k = 0; k < 9; ++k) fmt::format_to(std::back_inserter(out), "\t{:.9f}", R(k % 3, k / 3));
    }
    out += "\n";
  }
  return out;
}

}  // namespace fbvins::test

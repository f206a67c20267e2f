// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "fbvins/flight/flight_summary.hpp"
#include "fbvins/io/output_file.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {
namespace {

/// Writes names and values of a row together, so that header and cells always agree.
class RowWriter {
 public:
  void number(const char* name, double x) { cell(name, fmt::format("{:.6g}", x)); }
  void text(const char* name, std::string_view x) { cell(name, std::string(x)); }
  void vector(const std::string& name, const Vec3& v) {
    for (int i = 0; i < 3; ++i) cell(fmt::format("{}_{}", name, "xyz"[i]), fmt::format("{:.6g}", v[i]));
  }
  void rotation(const std::string& name, const Quat& q) {
    cell(name + "_w", fmt::format("{:.7f}", q.w()));
    vector(name, q.vec());
  }
  void rotors(const std::string& name, const PerRotor& x) {
    for (std::size_t i = 0; i < kRotors; ++i) cell(fmt::format("{}_{}", name, i + 1), fmt::format("{:.5g}", x[i]));
  }
  const std::string& names() const { return names_; }
  const std::string& cells() const { return cells_; }

 private:
  void cell(const std::string& name, const std::string& text) {
    names_ += "," + name;
    cells_ += "," + text;
  }
  std::string names_, cells_;
};

void write(RowWriter& out, const FlightRow& row) {
  const AutopilotOutput& a = row.autopilot;
  out.number("t", row.t_s);
  out.vector("true_p", row.truth.p);
  out.rotation("true_q", row.truth.q);
  out.vector("true_v", row.true_velocity);
  out.vector("estimate_p", a.estimate.T_LV.p);
  out.rotation("estimate_q", a.estimate.T_LV.q);
  out.vector("estimate_v", a.estimate.v_LV);
  out.vector("setpoint_p", a.setpoint.p);
  out.vector("setpoint_v", a.setpoint.v);
  out.number("setpoint_yaw", a.setpoint.yaw_rad);
  out.vector("velocity_setpoint", a.control.v_setpoint);
  out.vector("acceleration_setpoint", a.control.a_setpoint);
  out.rotation("attitude_setpoint", a.control.q_setpoint);
  out.vector("rate_setpoint", a.control.rate_setpoint);
  out.vector("rate", a.control.rate);
  out.vector("torque", a.control.torque);
  out.number("thrust", a.control.thrust);
  out.rotors("command", a.control.commands);
  out.rotors("rotor_radps", row.rotor_radps);
  out.number("battery", row.battery_V);
  out.number("estimate_age", a.estimate_age_s);
  out.number("step", static_cast<double>(a.step));
  out.text("mode", to_string(a.mode));
  out.text("mode_reason", to_string(a.reason));
  out.text("health", to_string(a.health.state));
  out.text("health_reason", to_string(a.health.reason));
}

/// T_LV in the type that TumWriter takes.
Pose<W, B> as_body(const Quat& q, const Vec3& p) { return {q, p}; }

}  // namespace

Result<void> write_flight(const FlightLog& log, const std::string& folder) {
  Result<OutputFile> csv = OutputFile::create(folder + "/flight.csv");
  if (!csv) return csv.error();
  Result<TumWriter> truth = TumWriter::create(folder + "/truth_tum.txt"),
                    estimate = TumWriter::create(folder + "/estimate_tum.txt"),
                    setpoint = TumWriter::create(folder + "/setpoint_tum.txt");
  for (const Result<TumWriter>* file : {&truth, &estimate, &setpoint})
    if (!*file) return file->error();
  bool first = true;
  for (const FlightRow& row : log.rows) {
    RowWriter out;
    write(out, row);
    if (first) csv->write("#timestamp [ns]" + out.names() + "\n");
    first = false;
    const AutopilotOutput& a = row.autopilot;
    csv->write(fmt::format("{}{}\n", a.t.ns, out.cells()));
    truth->write(a.t, as_body(row.truth.q, row.truth.p));
    if (!a.health.has_pose()) continue;
    estimate->write(a.t, as_body(a.estimate.T_LV.q, a.estimate.T_LV.p));
    if (a.mode != FlightMode::waiting && a.mode != FlightMode::landed)
      setpoint->write(a.t, as_body(so3_exp(Vec3(0, 0, a.setpoint.yaw_rad)), a.setpoint.p));
  }
  Result<void> first_trouble = csv->close();
  for (Result<TumWriter>* file : {&truth, &estimate, &setpoint}) {
    Result<void> done = (*file)->close();
    if (first_trouble && !done) first_trouble = done;
  }
  return first_trouble;
}

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/loop_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/report/csv_table.hpp"
#include "fbvins/tuning/ulog.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr double kShortest_s = 10, kLongest_s = 24 * 3600;
/// Below, there is nothing to see of the loops.
constexpr double kSlowest_hz = 20;
/// Signals of a PX4 log have different rates; they are resampled to this one.
constexpr double kUlog_hz = 200;

Error wrong(const std::string& source, const std::string& what) {
  return {ErrorCode::invalid_argument, fmt::format("{}: {}", source, what)};
}

Result<std::array<std::vector<double>, 3>> axes(const CsvTable& table, const std::string& name, const std::string& source) {
  std::array<std::vector<double>, 3> all;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string column = fmt::format("{}_{}", name, "xyz"[i]);
    all[i] = table.numbers(column);
    if (all[i].empty())
      return wrong(source, fmt::format("there is no column '{}': this is no flight.csv of `fbvins fly`", column));
  }
  return all;
}

Result<LoopLog> read_csv(const std::string& folder, VelocitySource velocity) {
  LoopLog log;
  log.source = folder + "/flight.csv";
  const Result<CsvTable> table = CsvTable::read(log.source);
  if (!table) return table.error();
  if (Result<void> read = read_yaml_file(folder + "/control.yaml", fields_of(log.control)); !read) return read.error();
  const std::vector<std::string> mode = table->texts("mode");
  const auto rate = axes(*table, "rate", log.source), torque = axes(*table, "torque", log.source),
             asked = axes(*table, "acceleration_setpoint", log.source),
             v = axes(*table, velocity == VelocitySource::truth ? "true_v" : "estimate_v", log.source);
  for (const auto* one : {&rate, &torque, &asked, &v})
    if (!*one) return one->error();
  if (mode.empty()) return wrong(log.source, "there is no column 'mode': this is no flight.csv of `fbvins fly`");
  const std::vector<Time>& t = table->stamps();
  if (t.size() > 1 && t[1] <= t[0]) return wrong(log.source, "its stamps do not ascend");
  for (std::size_t i = 0; i < table->rows(); ++i) {
    if (mode[i] != "mission") continue;
    const auto at = [i](const auto& all) { return Vec3((*all)[0][i], (*all)[1][i], (*all)[2][i]); };
    log.rate.push_back(at(rate)), log.torque.push_back(at(torque));
    log.acceleration_asked.push_back(at(asked)), log.velocity.push_back(at(v));
    for (const auto* all : {&log.rate, &log.torque, &log.acceleration_asked, &log.velocity})
      if (!all->back().allFinite()) return wrong(log.source, fmt::format("row {} holds something that is not a number", i + 1));
  }
  if (t.size() > 1) log.rate_hz = std::round(1 / (t[1] - t[0]).seconds());
  if (log.rate_hz < kSlowest_hz)
    return wrong(log.source, fmt::format("its rows are {:.3f} s apart; at least {:.0f} a second are needed",
                                         (t[1] - t[0]).seconds(), kSlowest_hz));
  return log;
}

/// Three fields of a topic, converted from FRD or NED to FLU or z up, with interpolation in time.
class UlogSignal {
 public:
  UlogSignal(const Ulog& log, const std::string& topic, const std::array<std::string, 3>& fields) : t_(log.seconds(topic)) {
    for (std::size_t i = 0; i < 3; ++i) x_[i] = log.numbers(topic, fields[i]);
  }
  bool empty() const {
    return t_.size() < 2 || std::any_of(x_.begin(), x_.end(), [this](const auto& x) { return x.size() != t_.size(); });
  }
  double from_s() const { return t_.front(); }
  double to_s() const { return t_.back(); }
  /// Linear interpolation. NaN, by which PX4 marks an open loop, counts as zero.
  Vec3 at(double t) const {
    const auto after = std::upper_bound(t_.begin(), t_.end(), t);
    const auto b = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - t_.begin(), 1, std::ssize(t_) - 1)), a = b - 1;
    const double share = std::clamp((t - t_[a]) / std::max(1e-9, t_[b] - t_[a]), 0.0, 1.0);
    const auto clean = [](double x) { return std::isfinite(x) ? x : 0.0; };
    const auto value = [&](std::size_t i) { return (1 - share) * clean(x_[i][a]) + share * clean(x_[i][b]); };
    return {value(0), -value(1), -value(2)};
  }

 private:
  std::vector<double> t_;
  std::array<std::vector<double>, 3> x_;
};

/// Keeps the longest stretch in flight: on the ground PX4's acceleration setpoint is 100 m/s^2 downwards.
void keep_flight(LoopLog& log) {
  constexpr double kFlown_mps2 = 15;
  std::size_t begin = 0, best_begin = 0, best = 0;
  for (std::size_t i = 0; i <= log.acceleration_asked.size(); ++i) {
    const bool flown = i < log.acceleration_asked.size() && log.acceleration_asked[i].norm() < kFlown_mps2;
    if (flown) continue;
    if (i - begin > best) best = i - begin, best_begin = begin;
    begin = i + 1;
  }
  for (std::vector<Vec3>* all : {&log.rate, &log.torque, &log.velocity, &log.acceleration_asked}) {
    const auto from = all->begin() + static_cast<std::ptrdiff_t>(best_begin);
    *all = std::vector<Vec3>(from, from + static_cast<std::ptrdiff_t>(best));
  }
}

Result<LoopLog> read_ulog(const std::string& path) {
  const Result<Ulog> ulog = Ulog::read(path);
  if (!ulog) return ulog.error();
  LoopLog log;
  log.source = path;
  log.rate_hz = kUlog_hz;
  for (const OptionField& field : fields_of(log.control))
    if (const auto value = ulog->parameter(std::string(field.name()));
        value && std::isfinite(*value) && std::holds_alternative<double*>(field.value))
      *std::get<double*>(field.value) = *value;
  const std::array<std::string, 3> xyz{"xyz[0]", "xyz[1]", "xyz[2]"};
  const UlogSignal rate(*ulog, "vehicle_angular_velocity", xyz), torque(*ulog, "vehicle_torque_setpoint", xyz),
      velocity(*ulog, "vehicle_local_position", {"vx", "vy", "vz"}),
      asked(*ulog, "vehicle_local_position_setpoint", {"acceleration[0]", "acceleration[1]", "acceleration[2]"});
  double from_s = 0, to_s = 1e12;
  for (const auto& [signal, name] : {std::pair{&rate, "vehicle_angular_velocity"},
                                     {&torque, "vehicle_torque_setpoint"},
                                     {&velocity, "vehicle_local_position"},
                                     {&asked, "vehicle_local_position_setpoint"}}) {
    if (signal->empty()) return wrong(path, fmt::format("'{}' was not logged (SDLOG_PROFILE: default and high rate)", name));
    from_s = std::max(from_s, signal->from_s()), to_s = std::min(to_s, signal->to_s());
  }
  if (to_s - from_s > kLongest_s) return wrong(path, fmt::format("its stamps span {:.0f} h", (to_s - from_s) / 3600));
  for (int i = 0; from_s + i / kUlog_hz < to_s; ++i) {
    const double t = from_s + i / kUlog_hz;
    log.rate.push_back(rate.at(t)), log.torque.push_back(torque.at(t));
    log.velocity.push_back(velocity.at(t)), log.acceleration_asked.push_back(asked.at(t));
  }
  keep_flight(log);
  return log;
}

}  // namespace

Result<LoopLog> read_loop_log(const std::string& path, VelocitySource velocity) {
  Result<LoopLog> log = fs::path(path).extension() == ".ulg" ? read_ulog(path)
                        : fs::is_directory(path)             ? read_csv(path, velocity)
                                                             : read_csv(fs::path(path).parent_path().string(), velocity);
  if (!log) return log;
  if (static_cast<double>(log->rate.size()) < kShortest_s * log->rate_hz)
    return wrong(log->source, fmt::format("only {:.1f} s in flight; at least {:.0f} s are needed",
                                          static_cast<double>(log->rate.size()) / log->rate_hz, kShortest_s));
  return log;
}

}  // namespace fbvins

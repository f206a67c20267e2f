// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/bench_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace fbvins {
namespace {

using Json = nlohmann::ordered_json;

struct Statistic {
  const char* name;
  double ErrorStatistics::*member;
};
constexpr Statistic kStatistics[] = {{"Max", &ErrorStatistics::max},
                                     {"Mean", &ErrorStatistics::mean},
                                     {"Median", &ErrorStatistics::median},
                                     {"RMSE", &ErrorStatistics::rmse},
                                     {"Std", &ErrorStatistics::std}};

struct Quantity {
  const char* key;
  const char* name;
  double StateNees::*member;
};
constexpr Quantity kQuantities[] = {{"position", "position", &StateNees::position},
                                    {"orientation", "orientation", &StateNees::orientation},
                                    {"velocity", "velocity", &StateNees::velocity},
                                    {"gyro_bias", "gyro bias", &StateNees::gyro_bias},
                                    {"accel_bias", "accelerometer bias", &StateNees::accel_bias}};

/// Cells that differ only in seed and repetition.
struct Group {
  std::string dataset, variant;
  std::vector<const CellResult*> cells;

  /// One cell a flight: repetitions should have the same result.
  std::vector<const CellResult*> flights() const {
    std::vector<const CellResult*> out;
    for (const CellResult* c : cells)
      if (c->cell.repetition == 1) out.push_back(c);
    return out;
  }
  std::vector<const CellResult*> evaluated() const {
    std::vector<const CellResult*> out = flights();
    std::erase_if(out, [](const CellResult* c) { return !c->evaluation; });
    return out;
  }
};

std::vector<Group> groups_of(const std::vector<CellResult>& results) {
  std::set<std::string> configurations;
  for (const CellResult& r : results) configurations.insert(r.cell.configuration.name);
  std::vector<Group> groups;
  for (const CellResult& r : results) {
    const std::string variant =
        configurations.size() > 1 ? fmt::format("{}, {}", r.cell.frontend, r.cell.configuration.name) : r.cell.frontend;
    auto at = std::find_if(groups.begin(), groups.end(),
                           [&](const Group& g) { return g.dataset == r.recording.dataset && g.variant == variant; });
    if (at == groups.end()) at = groups.insert(groups.end(), Group{r.recording.dataset, variant, {}});
    at->cells.push_back(&r);
  }
  return groups;
}

double mean_of(const std::vector<double>& values) {
  return values.empty() ? NAN : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

template <class F>
std::vector<double> collect(const std::vector<const CellResult*>& cells, F value) {
  std::vector<double> out;
  for (const CellResult* c : cells)
    if (const double x = value(*c); std::isfinite(x)) out.push_back(x);
  return out;
}

std::string metres(double x) { return std::isfinite(x) ? fmt::format("{:.4f}", x) : "-"; }
std::string number(double x, int decimals) { return std::isfinite(x) ? fmt::format("{:.{}f}", x, decimals) : "-"; }

std::string source_note(const std::vector<CellResult>& results) {
  int real = 0, along = 0, rendered = 0;
  std::set<std::string> seen;
  for (const CellResult& r : results) {
    if (!seen.insert(r.recording.id).second) continue;
    if (!r.recording.rendered) ++real;
    else if (!r.recording.rendered->imu.empty()) ++along;
    else ++rendered;
  }
  std::string note;
  const auto add = [&](int count, const char* what) {
    if (count > 0) note += fmt::format("{}{} {}", note.empty() ? "" : ", ", count, what);
  };
  add(real, real == 1 ? "real recording" : "real recordings");
  add(along, "with real IMU and trajectory, images rendered by fbvins simulate");
  add(rendered, "synthetic, of fbvins simulate");
  return note;
}

/// The paper's Table 1: one row for each recording and algorithm.
Json single_table(const std::string& title, const std::vector<Group>& groups, const std::string& note) {
  Json table{{"title", title}, {"note", "Absolute trajectory error in metres after SE3 alignment; " + note}, {"texts", 2}};
  table["head"] = {"recording", "frontend", "Max",      "Mean",        "Median", "RMSE",
                   "Std",       "coverage", "restarts", "lost frames", "CPU ms"};
  table["rows"] = Json::array();
  for (const Group& g : groups) {
    const CellResult& c = *g.cells.front();
    Json row{g.dataset, g.variant};
    for (const Statistic& s : kStatistics) row.push_back(c.evaluation ? metres(c.evaluation->absolute_m.*s.member) : c.status);
    row.push_back(number(100 * c.coverage, 1) + " %");
    row.push_back(std::to_string(c.restarts));
    row.push_back(std::to_string(c.lost_frames));
    row.push_back(number(c.cpu_ms, 1));
    table["rows"].push_back(row);
  }
  return table;
}

/// Many flights per scenario.
Json scenario_table(const std::string& title, const std::vector<Group>& groups, const std::string& note) {
  Json table{{"title", title},
             {"note", "Absolute trajectory error in metres after SE3 alignment, over the flights of a scenario; " + note},
             {"texts", 2}};
  table["head"] = {"scenario",      "frontend", "flights",  "RMSE, mean",  "median",         "largest",
                   "largest error", "coverage", "restarts", "lost frames", "without result", "CPU ms"};
  table["rows"] = Json::array();
  for (const Group& g : groups) {
    const auto flights = g.flights(), good = g.evaluated();
    std::vector<double> rmse = collect(good, [](const CellResult& c) { return c.evaluation->absolute_m.rmse; });
    const std::vector<double> largest = collect(good, [](const CellResult& c) { return c.evaluation->absolute_m.max; });
    int restarts = 0, lost = 0;
    for (const CellResult* c : flights) restarts += c->restarts, lost += c->lost_frames;
    Json row{g.dataset, g.variant, std::to_string(flights.size()), metres(mean_of(rmse))};
    row.push_back(metres(percentile(rmse, 0.5)));
    row.push_back(rmse.empty() ? "-" : metres(*std::max_element(rmse.begin(), rmse.end())));
    row.push_back(largest.empty() ? "-" : metres(*std::max_element(largest.begin(), largest.end())));
    row.push_back(number(100 * mean_of(collect(flights, [](const CellResult& c) { return c.coverage; })), 1) + " %");
    row.push_back(std::to_string(restarts));
    row.push_back(std::to_string(lost));
    row.push_back(std::to_string(flights.size() - good.size()));
    row.push_back(number(mean_of(collect(g.cells, [](const CellResult& c) { return c.evaluation ? c.cpu_ms : NAN; })), 1));
    table["rows"].push_back(row);
  }
  return table;
}

/// Section 3.2 of the paper: reduction of each error against the first algorithm, mean over the recordings.
Json reduction_table(const std::vector<Group>& groups) {
  std::vector<std::string> variants;
  for (const Group& g : groups)
    if (std::find(variants.begin(), variants.end(), g.variant) == variants.end()) variants.push_back(g.variant);
  Json table;
  if (variants.size() < 2) return table;
  table = {{"title", fmt::format("Reduction against {}", variants.front())},
           {"note", "Reduction of each error, mean over the recordings (section 3.2 of the paper); negative: larger"},
           {"texts", 1}};
  table["head"] = {"", "Max", "Mean", "Median", "RMSE", "Std", "recordings"};
  table["rows"] = Json::array();
  for (std::size_t v = 1; v < variants.size(); ++v) {
    Json row{variants[v]};
    std::size_t recordings = 0;
    for (const Statistic& s : kStatistics) {
      std::vector<double> reductions;
      for (const Group& base : groups) {
        if (base.variant != variants.front()) continue;
        const auto other = std::find_if(groups.begin(), groups.end(),
                                        [&](const Group& g) { return g.dataset == base.dataset && g.variant == variants[v]; });
        if (other == groups.end()) continue;
        const auto error = [&](const CellResult& c) { return c.evaluation->absolute_m.*s.member; };
        const double was = mean_of(collect(base.evaluated(), error)), is = mean_of(collect(other->evaluated(), error));
        if (std::isfinite(was) && std::isfinite(is) && was > 0) reductions.push_back(100 * (1 - is / was));
      }
      recordings = reductions.size();
      row.push_back(number(mean_of(reductions), 2) + " %");
    }
    row.push_back(std::to_string(recordings));
    table["rows"].push_back(row);
  }
  return table;
}

/// NEES of all flights by tenth of a second; instants reached by fewer than half of them are left out.
std::map<int, std::vector<StateNees>> by_instant(const Group& group) {
  std::map<int, std::vector<StateNees>> instants;
  const auto flights = group.flights();
  for (const CellResult* c : flights)
    for (const auto& [t, nees] : c->nees_over_time) instants[static_cast<int>(std::lround(10 * t))].push_back(nees);
  std::erase_if(instants, [&](const auto& entry) { return 2 * entry.second.size() < flights.size(); });
  return instants;
}

double mean_nees(const std::vector<StateNees>& all, double StateNees::*member) {
  std::vector<double> values;
  for (const StateNees& n : all)
    if (std::isfinite(n.*member)) values.push_back(n.*member);
  return mean_of(values);
}

Json nees_table(const std::vector<Group>& groups) {
  Json table{{"title", "Consistency"},
             {"note",
              "Normalised estimation error squared, mean over flights and time; 3 is consistent, the target is 1.5 to 6, "
              "more is overconfident. In brackets: share of the instants whose mean over the flights lies within "
              "the 95 % bounds of chi-square"},
             {"texts", 2}};
  table["head"] = {"scenario", "frontend", "flights"};
  for (const Quantity& q : kQuantities) table["head"].push_back(q.name);
  table["rows"] = Json::array();
  for (const Group& g : groups) {
    const auto instants = by_instant(g);
    if (instants.empty()) continue;
    Json row{g.dataset, g.variant, std::to_string(g.evaluated().size())};
    for (const Quantity& q : kQuantities) {
      const double mean = mean_of(collect(g.evaluated(), [&](const CellResult& c) { return c.nees.*q.member; }));
      int inside = 0, judged = 0;
      for (const auto& [tenth, all] : instants) {
        const NeesBounds bounds = nees_bounds(static_cast<int>(all.size()));
        const double at = mean_nees(all, q.member);
        if (!std::isfinite(at)) continue;
        ++judged;
        inside += at >= bounds.low && at <= bounds.high ? 1 : 0;
      }
      row.push_back(judged > 0 ? fmt::format("{:.2f} ({:.0f} %)", mean, 100.0 * inside / judged) : "-");
    }
    table["rows"].push_back(row);
  }
  return table;
}

Json consistency_curves(const Group& group) {
  const auto instants = by_instant(group);
  const int flights = static_cast<int>(group.evaluated().size());
  Json curves{{"name", fmt::format("{}, {}", group.dataset, group.variant)}, {"flights", flights}};
  const auto rounded = [](double x) { return std::isfinite(x) ? Json(std::round(1000 * x) / 1000) : Json(nullptr); };
  curves["t"] = Json::array();
  for (const auto& [tenth, all] : instants) curves["t"].push_back(0.1 * tenth);
  for (const Quantity& q : kQuantities) {
    Json curve = Json::array();
    bool any = false;
    for (const auto& [tenth, all] : instants) {
      const double mean = mean_nees(all, q.member);
      any = any || std::isfinite(mean);
      curve.push_back(rounded(mean));
    }
    if (any) curves[q.key] = std::move(curve);
  }
  const NeesBounds bounds = nees_bounds(std::max(1, flights));
  curves["low"] = bounds.low;
  curves["high"] = bounds.high;
  return curves;
}

/// Whether repetitions gave identical bytes.
Json repetition_table(const std::vector<CellResult>& results) {
  std::map<std::string, std::set<std::string>> hashes;
  std::map<std::string, int> counts;
  for (const CellResult& r : results) {
    const std::string key = fmt::format("{}, {}, {}", r.recording.id, r.cell.frontend, r.cell.configuration.name);
    hashes[key].insert(r.trajectory_hash);
    ++counts[key];
  }
  Json table{{"title", "Repetitions"}, {"note", "The same input and configuration should give the same bytes"}, {"texts", 1}};
  table["head"] = {"", "repetitions", "different trajectories"};
  table["rows"] = Json::array();
  for (const auto& [key, found] : hashes)
    table["rows"].push_back({key, std::to_string(counts[key]), std::to_string(found.size())});
  return table;
}

}  // namespace

NeesBounds nees_bounds(int flights) {
  // Wilson and Hilferty's approximation of chi-square's quantiles.
  const double k = 3.0 * flights, a = 2 / (9 * k);
  const auto quantile = [&](double z) { return k * std::pow(1 - a + z * std::sqrt(a), 3) / flights; };
  return {quantile(-1.959964), quantile(1.959964)};
}

Json bench_payload(const std::string& title, const std::vector<CellResult>& results, const std::vector<Regression>& regressions) {
  Json payload{{"tables", Json::array()}, {"consistency", Json::array()}};
  const std::vector<Group> groups = groups_of(results);
  const std::string note = source_note(results);
  const bool many = std::any_of(results.begin(), results.end(), [&](const CellResult& r) {
    return std::any_of(results.begin(), results.end(), [&](const CellResult& o) {
      return o.recording.dataset == r.recording.dataset && o.recording.id != r.recording.id;
    });
  });
  payload["tables"].push_back(many ? scenario_table(title, groups, note) : single_table(title, groups, note));
  if (Json reductions = reduction_table(groups); !reductions.is_null()) payload["tables"].push_back(std::move(reductions));
  if (many) {
    payload["tables"].push_back(nees_table(groups));
    for (const Group& g : groups)
      if (!by_instant(g).empty()) payload["consistency"].push_back(consistency_curves(g));
  }
  if (std::any_of(results.begin(), results.end(), [](const CellResult& r) { return r.cell.repetition > 1; }))
    payload["tables"].push_back(repetition_table(results));
  if (!regressions.empty()) {
    Json table{
        {"title", "Worse than the reference"}, {"note", ""}, {"texts", 2}, {"head", {"cell", "what"}}, {"rows", Json::array()}};
    for (const Regression& r : regressions) table["rows"].push_back({r.cell, r.what});
    payload["tables"].push_back(std::move(table));
  }
  return payload;
}

std::string markdown(const Json& payload) {
  std::string text;
  for (const Json& table : payload["tables"]) {
    text += fmt::format("### {}\n{}\n\n", table["title"].get<std::string>(), table["note"].get<std::string>());
    const auto line = [&](const Json& cells) {
      for (const Json& cell : cells) text += fmt::format("| {} ", cell.get<std::string>());
      text += "|\n";
    };
    line(table["head"]);
    const std::size_t texts = table["texts"].get<std::size_t>();
    for (std::size_t i = 0; i < table["head"].size(); ++i) text += i < texts ? "|---" : "|---:";
    text += "|\n";
    for (const Json& row : table["rows"]) line(row);
    text += "\n";
  }
  return text;
}

}  // namespace fbvins

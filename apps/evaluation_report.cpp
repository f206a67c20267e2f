// SPDX-License-Identifier: Apache-2.0
#include "apps/evaluation_report.hpp"

#include <fmt/format.h>

namespace fbvins::app {
namespace {

std::string row(std::string_view name, const ErrorStatistics& s) {
  if (s.count == 0) return fmt::format("{:<24}{:>10}\n", name, "too short");
  return fmt::format("{:<24}{:>10.4f}{:>10.4f}{:>10.4f}{:>10.4f}{:>10.4f}{:>8}\n", name, s.max, s.mean, s.median, s.rmse, s.std,
                     s.count);
}

/// Where the truth says nothing.
std::string gaps_of(const Evaluation& e) {
  std::string text;
  if (e.longest_truth_gap_s > 0)
    text +=
        fmt::format("truth for {:.1f} % of the estimate's time, longest gap {:.2f} s: the errors above say nothing of the rest\n",
                    100 * e.truth_share, e.longest_truth_gap_s);
  if (e.end_drift_m) text += fmt::format("drift at the end, aligned before the first gap: {:.4f} m\n", *e.end_drift_m);
  return text;
}

Json numbers(const auto& vector) { return Json(std::vector<double>(vector.begin(), vector.end())); }

Json pose_nees_json(const PoseNees& n) {
  return Json{{"position", n.position}, {"orientation", n.orientation}, {"pose", n.pose}};
}

}  // namespace

Json to_json(const ErrorStatistics& s) {
  return Json{{"count", s.count}, {"max", s.max}, {"mean", s.mean}, {"median", s.median}, {"rmse", s.rmse}, {"std", s.std}};
}

Json to_json(const Evaluation& e, Alignment alignment) {
  const Similarity& s = e.alignment;
  Json json;
  json["pairs"] = e.pairs;
  json["truth_path_m"] = e.truth_path_m;
  json["alignment"] = Json{{"kind", to_string(alignment)},
                           {"scale", s.scale},
                           {"rotation_wxyz", {s.q.w(), s.q.x(), s.q.y(), s.q.z()}},
                           {"translation_m", numbers(s.p)}};
  json["ape_m"] = to_json(e.absolute_m);
  json["orientations_compared"] = e.orientations;
  json["ape_deg"] = to_json(e.absolute_rotation_deg);
  json["rpe_per_metre_m"] = to_json(e.per_metre_m);
  json["rpe_per_metre_deg"] = to_json(e.per_metre_deg);
  json["rpe_per_second_m"] = to_json(e.per_second_m);
  json["rpe_per_second_deg"] = to_json(e.per_second_deg);
  json["largest_excursion_m"] = e.largest_excursion_m;
  json["truth"] = Json{{"share", e.truth_share},
                       {"longest_gap_s", e.longest_truth_gap_s},
                       {"end_drift_m", e.end_drift_m ? Json(*e.end_drift_m) : Json(nullptr)}};
  return json;
}

Json to_json(const Coverage& c) {
  Json json{{"images", c.images}, {"with_pose", c.with_pose}, {"share", c.share}};
  json["first_pose_after_s"] = c.with_pose > 0 ? Json(c.first_pose_after_s) : Json(nullptr);
  json["longest_hole_s"] = c.longest_hole_s;
  return json;
}

Json to_json(const NeesSummary& n) {
  return Json{{"count", n.count},
              {"unusable", n.unusable},
              {"mean", pose_nees_json(n.mean)},
              {"share_within_95", pose_nees_json(n.share_within_95)}};
}

std::string to_table(const Evaluation& e, Alignment alignment) {
  std::string text = fmt::format("{} poses over {:.2f} m, alignment {}\n", e.pairs, e.truth_path_m, to_string(alignment));
  if (alignment == Alignment::sim3) text += fmt::format("scale of the estimate {:.6f}\n", 1 / e.alignment.scale);
  text += fmt::format("{:<24}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}\n", "", "Max", "Mean", "Median", "RMSE", "Std", "Count");
  text += row("absolute [m]", e.absolute_m);
  if (!e.orientations) return text + "orientations are not compared, nor relative errors, which need them\n" + gaps_of(e);
  text += row("absolute [deg]", e.absolute_rotation_deg);
  text += row("relative per metre [m]", e.per_metre_m);
  text += row("relative per metre [deg]", e.per_metre_deg);
  text += row("relative per 1 s [m]", e.per_second_m);
  text += row("relative per 1 s [deg]", e.per_second_deg);
  return text + gaps_of(e);
}

std::string to_line(const Coverage& c) {
  if (c.with_pose == 0) return fmt::format("coverage 0 % of {} images: no pose\n", c.images);
  return fmt::format("coverage {:.1f} % of {} images, first pose after {:.3f} s, longest gap {:.3f} s\n", 100 * c.share, c.images,
                     c.first_pose_after_s, c.longest_hole_s);
}

}  // namespace fbvins::app

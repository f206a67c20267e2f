// SPDX-License-Identifier: Apache-2.0
// What loop closure brings on whole flights: ATE of the odometry in W, in M as it was put out at each moment (and the
// same with the bounded correction), and in M after the run. Three figures, never mixed.
//
//   loop_accuracy DATASET...
#include <fmt/format.h>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "fbvins/pipeline/system.hpp"

using namespace fbvins;

namespace {

double ate_m(const Trajectory& truth, const Trajectory& estimate) {
  const auto e = evaluate(truth, estimate, {});
  return e ? e->absolute_m.rmse : -1;
}

bool measure(const std::string& path, const Vocabulary& vocabulary) {
  auto opened = open_dataset(path);
  if (!opened) {
    fmt::print(stderr, "{}\n", opened.error().message);
    return false;
  }
  Dataset& data = **opened;
  LoopCloser closer(data.rig(), {}, vocabulary);
  System system({}, data.rig(), RunMode::deterministic);
  Trajectory truth, in_W, causal, smooth;
  for (const TrajectoryPoint& p : data.ground_truth()) truth.push_back({p.t, p.T_WB});
  Pose<M, W> T_MW, T_MW_smooth;
  LoopStats total;
  int keyframes = 0;
  system.on_odometry([&](const Odometry& o) {
    if (!o.health.has_pose()) return;
    in_W.push_back({o.t, o.T_WB});
    causal.push_back({o.t, (T_MW * o.T_WB).cast_frames<W, B>()});
    smooth.push_back({o.t, (T_MW_smooth * o.T_WB).cast_frames<W, B>()});
  });
  system.on_keyframe([&](const Keyframe& k) {
    const MapUpdate u = closer.process(k);
    if (u.localised) T_MW = u.T_MW, T_MW_smooth = u.T_MW_smooth;
    ++keyframes;
    total.accepted += u.stats.accepted, total.refused += u.stats.refused;
    total.extract_ms += u.stats.extract_ms, total.recognise_ms += u.stats.recognise_ms;
    total.verify_ms += u.stats.verify_ms, total.optimise_ms += u.stats.optimise_ms;
  });
  while (auto event = data.next()) system.push(std::move(*event));
  if (auto end = system.finish(); !end) fmt::print(stderr, "{}\n", end.error().message);
  CpuTimer timer;
  const PoseGraphReport report = closer.finish();
  const double finish_ms = timer.lap_ms();
  const double w = ate_m(truth, in_W), after = ate_m(truth, closer.corrected(in_W));
  fmt::print("{}: ATE in W {:.4f} m; causal in M {:.4f} ({:.2f}), bounded {:.4f} ({:.2f}); after the run in M {:.4f} ({:.2f})\n",
             data.info().name, w, ate_m(truth, causal), ate_m(truth, causal) / w, ate_m(truth, smooth), ate_m(truth, smooth) / w,
             after, after / w);
  fmt::print(
      "  {} keyframes, {} loops, {} refused, {} left out; a keyframe: extraction {:.2f} ms, recognition {:.2f}, verification {:.2f}, graph {:.2f}, all {:.2f}; at the end {:.0f} ms\n",
      keyframes, total.accepted, total.refused, report.rejected, total.extract_ms / keyframes, total.recognise_ms / keyframes,
      total.verify_ms / keyframes, total.optimise_ms / keyframes, total.total_ms() / keyframes, finish_ms);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const auto vocabulary = Vocabulary::open(shipped_vocabulary());
  if (!vocabulary || argc < 2) {
    fmt::print(stderr, "{}\n", argc < 2 ? "usage: loop_accuracy DATASET..." : vocabulary.error().message);
    return 2;
  }
  bool good = true;
  for (int i = 1; i < argc; ++i) good &= measure(argv[i], *vocabulary);
  return good ? 0 : 1;
}

// SPDX-License-Identifier: Apache-2.0
// The booster's effect on matching, and its time. Prints Markdown tables.
//
//   fbvins_features_bench --photos DIR [--every N]   held-out photographs with random homographies and degradations:
//                                                    correct matches within 3 px, raw and boosted, by condition
//   fbvins_features_bench --keyframes DATASET        real keyframes with 20 to 70 % overlap: matches near the epipolar lines
//   fbvins_features_bench --time                     milliseconds an image by network, precision, kernel, keypoints
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/features/booster_network.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/io/dataset.hpp"
#include "training/native/pictures.hpp"
#include "training/native/warped_pair.hpp"

namespace fbvins {
namespace {

struct Arguments {
  std::vector<std::string> photos;
  std::string keyframes;
  std::vector<std::string> weights = {"boost-s"};
  int every = 1, features = 500, seed = 4242;
  bool time = false;
};

struct Score {
  double correct = 0, matches = 0;
  double ratio() const { return matches > 0 ? correct / matches : 0; }
  double gain(const Score& raw) const { return 100 * (correct / std::max(raw.correct, 1.0) - 1); }
};

/// Keypoints of one view, with raw descriptors and those of every network.
struct Described {
  std::vector<Keypoint> keypoints;
  std::vector<std::vector<Descriptor>> descriptors;  // raw first
};

class Describer {
 public:
  Describer(int features, const std::vector<BoosterWeights>& weights) : extractor_(options(features), true) {
    for (const BoosterWeights& w : weights) networks_.emplace_back(w, BoosterPrecision::int8, best_int8_kernel());
  }

  Described operator()(const ImageView& image) {
    OrbFeatures raw;
    extractor_.extract(image, raw);
    Described out{raw.keypoints, {raw.descriptors}};
    for (BoosterNetwork& network : networks_) {
      out.descriptors.push_back(raw.descriptors);
      network.run(image.width, image.height, raw.keypoints, raw.margins, out.descriptors.back());
    }
    return out;
  }

 private:
  static OrbOptions options(int features) {
    OrbOptions o;
    o.max_features = features;
    return o;
  }
  OrbExtractor extractor_;
  std::vector<BoosterNetwork> networks_;
};

/// Mutual nearest neighbours without further tests; of equal distances the first.
constexpr HammingOptions kNearest{256, 2.0, true};

/// Adds to score[method] the mutual nearest neighbours and those that are `correct`; with `as_many`, only the closest, as
/// many as the raw descriptors have.
template <class Correct>
void add_matches(const Described& a, const Described& b, const Correct& correct, std::vector<Score>& score,
                 bool as_many = false) {
  std::size_t most = SIZE_MAX;
  score.resize(a.descriptors.size());
  for (std::size_t method = 0; method < a.descriptors.size(); ++method) {
    std::vector<DescriptorMatch> matches = match_descriptors(a.descriptors[method], b.descriptors[method], kNearest);
    if (as_many && method == 0) most = matches.size();
    std::stable_sort(matches.begin(), matches.end(),
                     [](const DescriptorMatch& p, const DescriptorMatch& q) { return p.distance < q.distance; });
    if (matches.size() > most) matches.resize(most);
    for (const DescriptorMatch& m : matches) {
      score[method].matches += 1;
      score[method].correct +=
          correct(a.keypoints[static_cast<std::size_t>(m.a)].pixel, b.keypoints[static_cast<std::size_t>(m.b)].pixel) ? 1 : 0;
    }
  }
}

void print_scores(const std::string& what, const std::vector<Score>& scores, double pairs,
                  const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const Score& s = scores[i];
    fmt::print("| {} | {} | {:.1f} | {} | {:.1f} | {:.1f} % |\n", what, i == 0 ? "ORB" : names[i - 1], s.correct / pairs,
               i == 0 ? "" : fmt::format("{:+.1f} %", s.gain(scores[0])), s.matches / pairs, 100 * s.ratio());
  }
}

int photos(const Arguments& arguments, const std::vector<BoosterWeights>& weights) {
  constexpr double kCorrect_px = 3;
  Describer describe(arguments.features, weights);
  std::array<std::vector<Score>, kConditionNames.size()> scores;
  std::vector<std::string> paths;
  for (const std::string& folder : arguments.photos)
    for (const std::string& path : pictures_in(folder, Part::held_out)) paths.push_back(path);
  int pictures = 0;
  for (std::size_t i = 0; i < paths.size(); i += static_cast<std::size_t>(arguments.every)) {
    const Result<Image> picture = read_picture(paths[i]);
    if (!picture) return fmt::print(stderr, "{}: {}\n", paths[i], picture.error().message), 2;
    ++pictures;
    for (std::size_t c = 0; c < scores.size(); ++c) {
      Rng rng(static_cast<std::uint64_t>(arguments.seed), 100 * i + c + 1);
      const WarpedPair pair = make_warped_pair(picture->view(), static_cast<Condition>(c), rng);
      const Described a = describe(pair.a.view()), b = describe(pair.b.view());
      add_matches(
          a, b, [&](const Vec2& p, const Vec2& q) { return (transfer(pair.H_ba, p) - q).norm() < kCorrect_px; }, scores[c]);
    }
  }
  fmt::print("\n{} photographs, {} keypoints a view, mutual nearest neighbours, correct within {} px; means a pair\n\n", pictures,
             arguments.features, kCorrect_px);
  fmt::print("| condition | descriptor | correct | against ORB | matches | correct of them |\n|---|---|---|---|---|---|\n");
  for (std::size_t c = 0; c < scores.size(); ++c)
    print_scores(std::string(kConditionNames[c]), scores[c], pictures, arguments.weights);
  return 0;
}

struct View {
  Pose<W, B> T_WB;
  Described left;
};

/// Share of a's image that b sees as well, if both look at a wall kDepth_m ahead.
double overlap(const StereoRig& rig, const Pose<W, B>& a, const Pose<W, B>& b) {
  constexpr double kDepth_m = 4;
  const Pose<C0, C0> T_ba = (b * rig.T_BC0()).inverse() * (a * rig.T_BC0());
  int seen = 0, all = 0;
  for (int y = 20; y < rig.left().height(); y += 40)
    for (int x = 20; x < rig.left().width(); x += 40, ++all)
      if (const auto ray = rig.left().undistort(Vec2(x, y))) {
        const Vec3 p = T_ba * Vec3(kDepth_m * ray->homogeneous());
        if (const auto px = rig.left().project(p); p.z() > 0.1 && px && rig.left().inside(*px, 0)) ++seen;
      }
  return static_cast<double>(seen) / all;
}

int keyframes(const Arguments& arguments, const std::vector<BoosterWeights>& weights) {
  DatasetOptions options;
  options.require_imu = false;
  auto opened = open_dataset(arguments.keyframes, options);
  if (!opened) return fmt::print(stderr, "{}\n", opened.error().message), 2;
  Dataset& data = **opened;
  Describer describe(arguments.features, weights);
  std::vector<View> views;
  while (auto event = data.next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (frame == nullptr || !frame->left()) continue;
    const auto& truth = data.ground_truth();
    const auto at = std::min_element(truth.begin(), truth.end(), [&](const TrajectoryPoint& p, const TrajectoryPoint& q) {
      return std::abs((p.t - frame->t).seconds()) < std::abs((q.t - frame->t).seconds());
    });
    if (at == truth.end() || std::abs((at->t - frame->t).seconds()) > 0.01) continue;
    views.push_back({at->T_WB, describe(frame->left()->view())});
  }
  const StereoRig& rig = data.rig();
  const double band = 2.0 / rig.left().focal_px();
  std::vector<Score> scores, as_many;
  int pairs = 0;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      const double shared = std::min(overlap(rig, views[i].T_WB, views[j].T_WB), overlap(rig, views[j].T_WB, views[i].T_WB));
      const Pose<C0, C0> T_ji = (views[j].T_WB * rig.T_BC0()).inverse() * (views[i].T_WB * rig.T_BC0());
      if (shared < 0.2 || shared > 0.7 || T_ji.p.norm() < 0.1) continue;
      const Mat3 E = hat(T_ji.p.normalized()) * T_ji.R();
      const auto in_band = [&](const Vec2& p, const Vec2& q) {
        const auto a = rig.left().undistort(p), b = rig.left().undistort(q);
        if (!a || !b) return false;
        const Vec3 line_b = E * a->homogeneous(), line_a = E.transpose() * b->homogeneous();
        const double product = b->homogeneous().dot(line_b);
        return std::abs(product) < band * line_b.head<2>().norm() && std::abs(product) < band * line_a.head<2>().norm();
      };
      add_matches(views[i].left, views[j].left, in_band, scores);
      add_matches(views[i].left, views[j].left, in_band, as_many, true);
      ++pairs;
    }
  fmt::print(
      "\n{} pairs of {} keyframes with 20 to 70 % overlap, {} keypoints, mutual nearest neighbours, within 2 px of both epipolar lines; means a pair\n\n",
      pairs, views.size(), arguments.features);
  fmt::print("| which | descriptor | inliers | against ORB | matches | inlier ratio |\n|---|---|---|---|---|---|\n");
  print_scores("all matches", scores, std::max(pairs, 1), arguments.weights);
  print_scores("no more matches than ORB", as_many, std::max(pairs, 1), arguments.weights);
  return 0;
}

double cpu_ms(BoosterNetwork& network, const std::vector<Keypoint>& keypoints, const std::vector<Margins>& margins) {
  std::vector<double> times;
  std::vector<Descriptor> boosted(keypoints.size());
  for (int i = 0; i < 60; ++i) {
    CpuTimer timer;
    network.run(752, 480, keypoints, margins, boosted);
    times.push_back(timer.lap_ms());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

int times(const Arguments& arguments, const std::vector<BoosterWeights>& weights) {
  fmt::print(
      "\nMedian of 60 runs, one thread, CPU ms an image\n\n| network | precision | kernel | 150 keypoints | 300 | 500 |\n|---|---|---|---|---|---|\n");
  Rng rng(1);
  for (std::size_t w = 0; w < weights.size(); ++w)
    for (const auto& [precision, kernel] : {std::pair{BoosterPrecision::int8, Int8Kernel::avx512_vnni},
                                            {BoosterPrecision::int8, Int8Kernel::avx2},
                                            {BoosterPrecision::int8, Int8Kernel::neon_dot},
                                            {BoosterPrecision::int8, Int8Kernel::portable},
                                            {BoosterPrecision::float32, Int8Kernel::portable}}) {
      if (!int8_kernel_works(kernel)) continue;
      BoosterNetwork network(weights[w], precision, kernel);
      const bool int8 = precision == BoosterPrecision::int8;
      fmt::print("| {} | {} | {} |", arguments.weights[w], int8 ? "int8" : "float32", int8 ? name_of(kernel) : "");
      for (const std::size_t count : {150u, 300u, 500u}) {
        std::vector<Keypoint> keypoints(count);
        std::vector<Margins> margins(count);
        for (std::size_t i = 0; i < count; ++i) {
          keypoints[i].pixel = Vec2(rng.uniform(0, 752), rng.uniform(0, 480));
          keypoints[i].score = static_cast<float>(rng.uniform(10, 1e5));
          keypoints[i].angle_rad = static_cast<float>(rng.uniform(-std::numbers::pi, std::numbers::pi));
          for (auto* half : {&margins[i].of_bit, &margins[i].around})
            for (std::int8_t& m : *half) m = static_cast<std::int8_t>(rng.uniform(-80, 80));
        }
        fmt::print(" {:.2f} |", cpu_ms(network, keypoints, margins));
      }
      fmt::print("\n");
    }
  return 0;
}

int run(const Arguments& arguments) {
  std::vector<BoosterWeights> weights;
  for (const std::string& name : arguments.weights) {
    Result<BoosterWeights> loaded = load_booster_weights(booster_weights_path(name));
    if (!loaded) return fmt::print(stderr, "{}\n", loaded.error().message), 2;
    weights.push_back(std::move(*loaded));
  }
  int status = 0;
  if (!arguments.photos.empty()) status = std::max(status, photos(arguments, weights));
  if (!arguments.keyframes.empty()) status = std::max(status, keyframes(arguments, weights));
  if (arguments.time) status = std::max(status, times(arguments, weights));
  return status;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  CLI::App app("The booster's effect on matching, and its time.");
  fbvins::Arguments arguments;
  app.add_option("--photos", arguments.photos, "folders of photographs");
  app.add_option("--every", arguments.every, "only every n-th photograph")->check(CLI::PositiveNumber);
  app.add_option("--keyframes", arguments.keyframes, "recording with ground truth");
  app.add_option("--weights", arguments.weights, "names of shipped weights or paths, compared side by side");
  app.add_option("--features", arguments.features, "keypoints a view");
  app.add_option("--seed", arguments.seed);
  app.add_flag("--time", arguments.time, "measure times");
  CLI11_PARSE(app, argc, argv);
  return fbvins::run(arguments);
}

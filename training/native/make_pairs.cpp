// SPDX-License-Identifier: Apache-2.0
// Pictures to training pairs: keypoints and descriptors of both views by the project's own extractor, and the homography
// between the views, as records of fixed size that numpy maps (training/dataset.py).
//
//   booster_pairs --images DIR --pairs 20 --seed 1 --out pairs.bin        a folder of PNG and JPEG
//   booster_pairs --leaves 2000 --pairs 4 --seed 1 --out pairs.bin        made-up pictures
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fbvins/features/orb.hpp"
#include "fbvins/io/image_decode.hpp"
#include "training/native/warped_pair.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMost = 500;

/// As numpy sees it: little-endian, no padding (all members are multiples of four bytes).
struct ViewRecord {
  std::int32_t count = 0, width = 0, height = 0;
  float keypoints[kMost][6] = {};  // x, y (px), level, scale, angle (rad), score
  std::uint8_t descriptors[kMost][32] = {};
};
struct PairRecord {
  std::int32_t picture = 0, condition = 0;
  float H_ba[9] = {};
  ViewRecord a, b;
};

void record(const OrbFeatures& features, const Image& image, ViewRecord& out) {
  out.count = static_cast<std::int32_t>(std::min(features.size(), kMost));
  out.width = image.width(), out.height = image.height();
  for (std::size_t i = 0; i < static_cast<std::size_t>(out.count); ++i) {
    const Keypoint& k = features.keypoints[i];
    const float row[6] = {static_cast<float>(k.pixel.x()),
                          static_cast<float>(k.pixel.y()),
                          static_cast<float>(k.level),
                          k.scale,
                          k.angle_rad,
                          k.score};
    std::copy(std::begin(row), std::end(row), out.keypoints[i]);
    std::memcpy(out.descriptors[i], features.descriptors[i].bits.data(), 32);
  }
}

std::vector<std::string> pictures_in(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".jpg" || extension == ".jpeg" || extension == ".png") paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

Result<Image> read_picture(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  return decode_image(bytes);
}

struct Arguments {
  std::vector<std::string> folders;
  std::string out;
  int leaves = 0, pairs = 10, seed = 1, features = 500, every = 1;
};

int run(const Arguments& arguments) {
  std::vector<std::string> paths;
  for (const std::string& folder : arguments.folders)
    for (const std::string& path : pictures_in(folder)) paths.push_back(path);
  std::ofstream out(arguments.out, std::ios::binary);
  OrbOptions options;
  options.max_features = arguments.features;
  OrbExtractor extractor(options);
  OrbFeatures features;
  PairRecord pair;
  const int pictures = static_cast<int>(paths.size()) / arguments.every + arguments.leaves;
  long written = 0;
  for (int i = 0; i < pictures; ++i) {
    Rng rng(static_cast<std::uint64_t>(arguments.seed), static_cast<std::uint64_t>(i) + 1);
    const bool leaf = i >= pictures - arguments.leaves;
    Image picture;
    if (leaf) picture = rng.uniform() < 0.15 ? dead_leaves(752, 480, rng) : dead_leaves(480, 320, rng);
    else if (Result<Image> read = read_picture(paths[static_cast<std::size_t>(i * arguments.every)])) picture = std::move(*read);
    else {
      fmt::print(stderr, "{}: {}\n", paths[static_cast<std::size_t>(i * arguments.every)], read.error().message);
      return 2;
    }
    for (int k = 0; k < arguments.pairs; ++k) {
      pair = PairRecord{};
      pair.picture = i;
      pair.condition = k % 5;
      const WarpedPair views = make_warped_pair(picture.view(), static_cast<Condition>(pair.condition), rng);
      for (int j = 0; j < 9; ++j) pair.H_ba[j] = static_cast<float>(views.H_ba(j / 3, j % 3));
      extractor.extract(views.a.view(), features);
      record(features, views.a, pair.a);
      extractor.extract(views.b.view(), features);
      record(features, views.b, pair.b);
      out.write(reinterpret_cast<const char*>(&pair), sizeof(pair));
      ++written;
    }
  }
  out.close();
  if (!out) {
    fmt::print(stderr, "{}: cannot be written\n", arguments.out);
    return 2;
  }
  fmt::print("{} pairs of {} pictures\n", written, pictures);
  return 0;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  CLI::App app("Training pairs for the booster: pictures to keypoints and descriptors of warped, damaged views.");
  fbvins::Arguments arguments;
  app.add_option("--images", arguments.folders, "folders of PNG and JPEG, searched recursively");
  app.add_option("--leaves", arguments.leaves, "made-up pictures");
  app.add_option("--pairs", arguments.pairs, "pairs a picture, the conditions in turn");
  app.add_option("--every", arguments.every, "only every n-th file");
  app.add_option("--features", arguments.features, "features a view, up to 500");
  app.add_option("--seed", arguments.seed);
  app.add_option("--out", arguments.out)->required();
  CLI11_PARSE(app, argc, argv);
  return fbvins::run(arguments);
}

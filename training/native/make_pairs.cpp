// SPDX-License-Identifier: Apache-2.0
// Pictures to training pairs: keypoints and margins (whose signs are the descriptors) of both views by the project's own
// extractor, and where each keypoint of the first is in the second, as records of fixed size that numpy maps
// (training/dataset.py).
//
//   booster_pairs --images DIR --pairs 20 --seed 1 --out pairs.bin        a folder of PNG and JPEG, warped
//   booster_pairs --images DIR --part train ...                           the first four fifths of each folder
//   booster_pairs --images DIR --only "low light and blur" ...            one condition only
//   booster_pairs --leaves 2000 --pairs 4 --seed 1 --out pairs.bin        synthetic pictures, warped
//   booster_pairs --rooms 100 --pairs 60 --seed 1 --out pairs.bin         two views of simulated rooms, true geometry
//   booster_pairs --changed-rooms 100 --pairs 60 --seed 1 --out p.bin     before and after other lamps, furniture, viewpoints
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/features/orb.hpp"
#include "training/native/pictures.hpp"
#include "training/native/room_views.hpp"
#include "training/native/warped_pair.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMost = 500;

/// As numpy maps it: little-endian, no padding (all members are multiples of four bytes).
struct ViewRecord {
  std::int32_t count = 0, width = 0, height = 0;
  float keypoints[kMost][6] = {};  // x, y (px), level, scale, angle (rad), score
  Margins margins[kMost] = {};
};
struct PairRecord {
  std::int32_t picture = 0, condition = 0;
  float a_in_b[kMost][2] = {};  // px, NaN where not visible
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
    out.margins[i] = features.margins[i];
  }
}

struct Arguments {
  std::vector<std::string> folders;
  std::string out, only;
  Part part = Part::all;
  int leaves = 0, rooms = 0, changed_rooms = 0, pairs = 10, seed = 1, features = 500, every = 1;
};

class PairWriter {
 public:
  explicit PairWriter(const Arguments& arguments) : out_(arguments.out, std::ios::binary), extractor_(options(arguments), true) {}

  /// `transfer`: from a pixel of a to its position in b, nullopt where not visible.
  template <class Transfer>
  void write(int picture, Condition condition, const Image& a, const Image& b, const Transfer& transfer) {
    pair_ = PairRecord{};
    pair_.picture = picture;
    pair_.condition = static_cast<std::int32_t>(condition);
    extractor_.extract(a.view(), features_);
    record(features_, a, pair_.a);
    for (std::size_t i = 0; i < kMost; ++i) {
      constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
      const std::optional<Vec2> px =
          i < static_cast<std::size_t>(pair_.a.count) ? transfer(features_.keypoints[i].pixel) : std::nullopt;
      pair_.a_in_b[i][0] = px ? static_cast<float>(px->x()) : kNone;
      pair_.a_in_b[i][1] = px ? static_cast<float>(px->y()) : kNone;
    }
    extractor_.extract(b.view(), features_);
    record(features_, b, pair_.b);
    out_.write(reinterpret_cast<const char*>(&pair_), sizeof(pair_));
    ++written_;
  }

  bool finish() {
    out_.close();
    return static_cast<bool>(out_);
  }
  long written() const { return written_; }

 private:
  static OrbOptions options(const Arguments& arguments) {
    OrbOptions o;
    o.max_features = arguments.features;
    return o;
  }
  std::ofstream out_;
  OrbExtractor extractor_;
  OrbFeatures features_;
  PairRecord pair_;
  long written_ = 0;
};

Rng rng_of(const Arguments& arguments, int picture) {
  return Rng(static_cast<std::uint64_t>(arguments.seed), static_cast<std::uint64_t>(picture) + 1);
}

/// The condition of a picture's k-th pair: all in turn, or the one of --only.
Condition condition_of(const Arguments& arguments, int k) {
  const auto only = std::find(kConditionNames.begin(), kConditionNames.end(), arguments.only);
  return static_cast<Condition>(only == kConditionNames.end() ? k % static_cast<int>(kConditionNames.size())
                                                              : static_cast<int>(only - kConditionNames.begin()));
}

void write_warped(const Arguments& arguments, const Image& picture, int index, Rng& rng, PairWriter& out) {
  for (int k = 0; k < arguments.pairs; ++k) {
    const Condition condition = condition_of(arguments, k);
    const WarpedPair views = make_warped_pair(picture.view(), condition, rng);
    out.write(index, condition, views.a, views.b, [&](const Vec2& px) { return std::optional<Vec2>(transfer(views.H_ba, px)); });
  }
}

/// Half of the second views are degraded in addition to the simulated camera's own errors.
Result<void> write_room(const Arguments& arguments, const Result<RoomViews>& room, int index, Rng& rng, PairWriter& out) {
  if (!room) return room.error();
  for (int k = 0; k < arguments.pairs; ++k) {
    const auto pair = room->choose(rng);
    if (!pair) break;
    const Image& b = room->image(pair->to);
    out.write(index, Condition::viewpoint, room->image(pair->from),
              rng.uniform() < 0.5 ? b : damage(b.view(), random_damage(Condition::all, rng), rng),
              [&](const Vec2& px) { return room->transfer(pair->from, pair->to, px); });
  }
  return {};
}

int fail(const std::string& what) {
  fmt::print(stderr, "{}\n", what);
  return 2;
}

int run(const Arguments& arguments) {
  std::vector<std::string> paths;
  for (const std::string& folder : arguments.folders)
    for (const std::string& path : pictures_in(folder, arguments.part)) paths.push_back(path);
  PairWriter out(arguments);
  int index = 0;
  for (std::size_t i = 0; i < paths.size(); i += static_cast<std::size_t>(arguments.every), ++index) {
    const Result<Image> picture = read_picture(paths[i]);
    if (!picture) return fail(fmt::format("{}: {}", paths[i], picture.error().message));
    Rng rng = rng_of(arguments, index);
    write_warped(arguments, *picture, index, rng, out);
  }
  for (int i = 0; i < arguments.leaves; ++i, ++index) {
    Rng rng = rng_of(arguments, index);
    const Image picture = rng.uniform() < 0.15 ? dead_leaves(752, 480, rng) : dead_leaves(480, 320, rng);
    write_warped(arguments, picture, index, rng, out);
  }
  for (int i = 0; i < arguments.rooms + arguments.changed_rooms; ++i, ++index) {
    constexpr int kFrames = 40;
    Rng rng = rng_of(arguments, index);
    const int seed = 1000 * arguments.seed + i;
    const Result<RoomViews> room = i < arguments.rooms ? RoomViews::render(seed, kFrames) : RoomViews::render_changed(seed);
    if (Result<void> done = write_room(arguments, room, index, rng, out); !done) return fail(done.error().message);
  }
  if (!out.finish()) return fail(arguments.out + ": cannot be written");
  fmt::print("{} pairs of {} pictures and rooms\n", out.written(), index);
  return 0;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  CLI::App app("Training pairs for the booster: keypoints and margins of warped, degraded views of pictures.");
  fbvins::Arguments arguments;
  using fbvins::Part;
  app.add_option("--images", arguments.folders, "folders of PNG and JPEG, searched recursively");
  app.add_option("--part", arguments.part, "of every folder: all, train (the first four fifths), held-out (the last fifth)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Part>{{"all", Part::all}, {"train", Part::train}, {"held-out", Part::held_out}}));
  app.add_option("--leaves", arguments.leaves, "number of synthetic pictures");
  app.add_option("--rooms", arguments.rooms, "number of simulated rooms");
  app.add_option("--changed-rooms", arguments.changed_rooms, "number of simulated rooms that are seen again after changes");
  app.add_option("--pairs", arguments.pairs, "pairs per picture (the conditions in turn) or per room");
  app.add_option("--only", arguments.only, "pairs of pictures of this condition alone")
      ->check(CLI::IsMember(std::vector<std::string>(fbvins::kConditionNames.begin(), fbvins::kConditionNames.end())));
  app.add_option("--every", arguments.every, "only every n-th file");
  app.add_option("--features", arguments.features, "features per view, up to 500");
  app.add_option("--seed", arguments.seed);
  app.add_option("--out", arguments.out)->required();
  CLI11_PARSE(app, argc, argv);
  return fbvins::run(arguments);
}

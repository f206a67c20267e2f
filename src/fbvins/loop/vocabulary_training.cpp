// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/vocabulary_training.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numeric>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/hamming.hpp"

namespace fbvins {
namespace {

using Members = std::vector<std::int32_t>;

/// Counts the bits of many descriptors.
struct BitCounter {
  std::array<std::int32_t, 256> ones{};
  std::int32_t total = 0;

  void add(const Descriptor& d) {
    for (std::size_t w = 0; w < 4; ++w)
      for (std::size_t b = 0; b < 64; ++b) ones[64 * w + b] += static_cast<std::int32_t>((d.bits[w] >> b) & 1u);
    ++total;
  }
  /// Ties go to the bit of the centre before.
  Descriptor majority(const Descriptor& before) const {
    Descriptor d = before;
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint64_t bit = std::uint64_t{1} << (i % 64);
      if (2 * ones[i] > total) d.bits[i / 64] |= bit;
      else if (2 * ones[i] < total) d.bits[i / 64] &= ~bit;
    }
    return d;
  }
};

class Trainer {
 public:
  Trainer(const std::vector<Descriptor>& all, const VocabularyTrainingOptions& options)
      : all_(all), options_(options), rng_(static_cast<std::uint64_t>(options.seed)) {}

  /// Breadth first, so that children lie side by side and after their parent.
  void grow() {
    struct Open {
      std::int32_t node;
      int level;
      Members members;
    };
    std::deque<Open> open;
    Members everything(all_.size());
    std::iota(everything.begin(), everything.end(), 0);
    nodes_.push_back({});
    descriptors_.push_back({});
    open.push_back({0, 0, std::move(everything)});
    while (!open.empty()) {
      Open o = std::move(open.front());
      open.pop_front();
      if (o.level == options_.depth || static_cast<int>(o.members.size()) < options_.min_members) continue;
      std::vector<Members> parts = split(o.members);
      if (parts.size() < 2) continue;
      nodes_[static_cast<std::size_t>(o.node)].first_child = static_cast<std::int32_t>(nodes_.size());
      nodes_[static_cast<std::size_t>(o.node)].children = static_cast<std::int32_t>(parts.size());
      for (std::size_t i = 0; i < parts.size(); ++i) {
        open.push_back({static_cast<std::int32_t>(nodes_.size()), o.level + 1, std::move(parts[i])});
        nodes_.push_back({});
        descriptors_.push_back(centres_[i]);
      }
    }
    std::int32_t word = 0;
    for (VocabularyNode& n : nodes_)
      if (n.children == 0) n.word = word++;
  }

  std::vector<VocabularyNode> nodes_;
  std::vector<Descriptor> descriptors_;

 private:
  /// Members of each centre that kept any; centres_ holds the same centres after.
  std::vector<Members> split(const Members& members) {
    seed_centres(members);
    std::vector<Members> parts;
    for (int round = 0; round < options_.iterations; ++round) {
      parts.assign(centres_.size(), {});
      for (const std::int32_t m : members) parts[nearest(all_[static_cast<std::size_t>(m)])].push_back(m);
      if (!move_centres(parts)) break;
    }
    std::vector<Members> kept;
    std::vector<Descriptor> kept_centres;
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (!parts[i].empty()) kept.push_back(std::move(parts[i])), kept_centres.push_back(centres_[i]);
    centres_ = std::move(kept_centres);
    return kept;
  }

  /// k-means++ on Hamming distances: the next centre with probability proportional to the squared distance.
  void seed_centres(const Members& members) {
    centres_.assign(1, all_[static_cast<std::size_t>(members[rng_.below(static_cast<std::uint32_t>(members.size()))])]);
    std::vector<double> d2(members.size(), 1e12);
    while (static_cast<int>(centres_.size()) < options_.branching) {
      double total = 0;
      for (std::size_t i = 0; i < members.size(); ++i) {
        const double d = hamming_distance(all_[static_cast<std::size_t>(members[i])], centres_.back());
        d2[i] = std::min(d2[i], d * d);
        total += d2[i];
      }
      if (total <= 0) break;  // all the same
      double left = rng_.uniform() * total;
      std::size_t i = 0;
      while (i + 1 < members.size() && (left -= d2[i]) > 0) ++i;
      centres_.push_back(all_[static_cast<std::size_t>(members[i])]);
    }
  }

  std::size_t nearest(const Descriptor& d) {
    distance_.resize(centres_.size());
    hamming_distances(d, centres_, distance_.data());
    return static_cast<std::size_t>(std::min_element(distance_.begin(), distance_.end()) - distance_.begin());
  }

  bool move_centres(const std::vector<Members>& parts) {
    bool moved = false;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].empty()) continue;
      BitCounter counter;
      for (const std::int32_t m : parts[i]) counter.add(all_[static_cast<std::size_t>(m)]);
      const Descriptor centre = counter.majority(centres_[i]);
      moved |= !(centre == centres_[i]);
      centres_[i] = centre;
    }
    return moved;
  }

  const std::vector<Descriptor>& all_;
  VocabularyTrainingOptions options_;
  Rng rng_;
  std::vector<Descriptor> centres_;
  std::vector<std::uint16_t> distance_;
};

}  // namespace

Vocabulary train_vocabulary(std::string kind, const std::vector<std::vector<Descriptor>>& images,
                            const VocabularyTrainingOptions& options) {
  std::vector<Descriptor> all;
  for (const auto& image : images) all.insert(all.end(), image.begin(), image.end());
  Trainer trainer(all, options);
  if (all.empty()) return Vocabulary::from_nodes(std::move(kind), {{0, 0, 0, 1.0f}}, {{}});
  trainer.grow();

  const Vocabulary tree = Vocabulary::from_nodes(kind, trainer.nodes_, trainer.descriptors_);
  std::vector<int> images_with(static_cast<std::size_t>(tree.words()), 0), last(images_with.size(), -1);
  for (std::size_t i = 0; i < images.size(); ++i)
    for (const Descriptor& d : images[i]) {
      const auto word = static_cast<std::size_t>(tree.word_of(d));
      if (last[word] != static_cast<int>(i)) ++images_with[word], last[word] = static_cast<int>(i);
    }
  for (VocabularyNode& n : trainer.nodes_)
    if (n.children == 0)
      n.idf = static_cast<float>(
          std::log((1.0 + static_cast<double>(images.size())) / (1.0 + images_with[static_cast<std::size_t>(n.word)])) + 1e-3);
  return Vocabulary::from_nodes(std::move(kind), std::move(trainer.nodes_), std::move(trainer.descriptors_));
}

}  // namespace fbvins

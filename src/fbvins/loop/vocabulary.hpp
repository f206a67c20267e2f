// SPDX-License-Identifier: Apache-2.0
// Visual words: a tree of binary descriptors (k-majority). Going down to the nearest child at each node turns a
// descriptor into a word in branching * depth comparisons (docs/derivations/loop.md, L1-L2).
// The file is mapped into memory, not read: opening checks the checksum and costs milliseconds.
// Immutable; any number of threads.
//
//   Result<Vocabulary> vocabulary = Vocabulary::open("orb_vocabulary.fbv");
//   BowVector words = vocabulary->words_of(features.descriptors);
//   float similarity = bow_similarity(words, other);      // 0 nothing in common .. 1 the same
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/features/keypoint.hpp"

namespace fbvins {

/// Weight of one word in one image: term frequency times inverse document frequency, weights of an image sum to 1.
struct BowEntry {
  std::int32_t word = 0;
  float weight = 0;
  bool operator==(const BowEntry&) const = default;
};
/// In order of words.
using BowVector = std::vector<BowEntry>;

/// 1 - |a - b|_1 / 2, the share of weight in common (L2): added up in order of words, so that an InvertedIndex gives the same
/// bits.
float bow_similarity(const BowVector& a, const BowVector& b);

/// A node of the tree. Children lie side by side; the root is node 0, its descriptor means nothing.
struct VocabularyNode {
  std::int32_t first_child = 0;  ///< 0 for a leaf
  std::int32_t children = 0;
  std::int32_t word = -1;  ///< of a leaf
  float idf = 0;           ///< of a leaf: inverse document frequency (L1)
};

class Vocabulary {
 public:
  static constexpr std::uint32_t kVersion = 1;

  /// An error for a file that is missing, damaged, of another kind or of another version.
  static Result<Vocabulary> open(const std::string& path);
  /// From trained nodes; kind of the descriptors: "orb", "boosted".
  static Vocabulary from_nodes(std::string kind, std::vector<VocabularyNode> nodes, std::vector<Descriptor> descriptors);
  /// Atomic: the old or the new file, never half of one.
  Result<void> save(const std::string& path) const;

  const std::string& kind() const { return kind_; }
  int words() const { return words_; }
  /// Of what words depend on; never 0.
  std::uint64_t fingerprint() const { return fingerprint_; }
  std::span<const VocabularyNode> nodes() const { return nodes_; }
  std::span<const Descriptor> descriptors() const { return descriptors_; }

  /// Word of one descriptor; the first of equally near children.
  std::int32_t word_of(const Descriptor& descriptor) const;
  BowVector words_of(std::span<const Descriptor> descriptors) const;

 private:
  std::string body() const;
  std::int32_t leaf_of(const Descriptor& descriptor) const;

  std::string kind_;
  int words_ = 0;
  std::uint64_t fingerprint_ = 1;
  std::shared_ptr<const void> owner_;  // the mapping, or the trained arrays
  std::span<const VocabularyNode> nodes_;
  std::span<const Descriptor> descriptors_;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// Training of a vocabulary: hierarchical k-majority (C. Grana et al., "A fast approach for integrating ORB
// descriptors in the bag of words model", 2013): k-means on bits, a centre is the majority of its members.
// Pure function, one thread; the same input and seed give the same bytes.
//
//   Vocabulary vocabulary = train_vocabulary("orb", descriptors_of_images, {});
#pragma once

#include <string>
#include <vector>

#include "fbvins/loop/vocabulary.hpp"

namespace fbvins {

struct VocabularyTrainingOptions {
  int branching = 10;
  int depth = 5;
  int min_members = 24;
  int iterations = 8;
  int seed = 1;

  template <class V>
  void visit(V&& v) {
    v("branching", branching, "", "children of a node", 2, 64);
    v("depth", depth, "", "levels of the tree", 1, 8);
    v("min_members", min_members, "", "a node with fewer training descriptors is not split", 2, 1000000);
    v("iterations", iterations, "", "rounds of k-majority at most", 1, 100);
    v("seed", seed, "", "of the first centres", 0, 1000000);
  }
};

/// One vector of descriptors an image; words that appear in few images weigh more (idf).
Vocabulary train_vocabulary(std::string kind, const std::vector<std::vector<Descriptor>>& images,
                            const VocabularyTrainingOptions& options);

}  // namespace fbvins

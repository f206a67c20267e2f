// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/vocabulary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/loop/binary_file.hpp"

namespace fbvins {
namespace {

constexpr char kMagic[8] = {'F', 'B', 'V', 'W', 'O', 'R', 'D', 'S'};
constexpr std::uint32_t kMaxNodes = 1u << 24;
constexpr int kMaxChildren = 64;

/// 64 bytes, then the nodes, then the descriptors; little-endian.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::uint32_t nodes;
  char kind[16];
  std::uint32_t words;
  std::uint32_t reserved[3];
  std::uint64_t checksum;
  std::uint64_t padding;
};
static_assert(sizeof(Header) == 64 && sizeof(VocabularyNode) == 16 && sizeof(Descriptor) == 32);

Error damaged(const std::string& path, const char* what) {
  return {ErrorCode::malformed, fmt::format("{}: damaged vocabulary: {}", path, what)};
}

/// Descending must end in a leaf whatever the descriptor: children come after their parent and inside the file.
const char* fault_of(std::span<const VocabularyNode> nodes, std::uint32_t words) {
  std::uint32_t leaves = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const VocabularyNode& n = nodes[i];
    if (n.children == 0) {
      if (n.word < 0 || static_cast<std::uint32_t>(n.word) >= words || !(n.idf >= 0 && n.idf < 100)) return "a bad word";
      ++leaves;
    } else if (n.children < 0 || n.children > kMaxChildren || n.first_child <= static_cast<std::int64_t>(i) ||
               static_cast<std::size_t>(n.first_child) + static_cast<std::size_t>(n.children) > nodes.size()) {
      return "a bad tree";
    }
  }
  return leaves == words ? nullptr : "its words do not add up";
}

}  // namespace

float bow_similarity(const BowVector& a, const BowVector& b) {
  float sum = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->word == j->word) sum += std::min((i++)->weight, (j++)->weight);
    else if (i->word < j->word) ++i;
    else ++j;
  }
  return sum;
}

Result<Vocabulary> Vocabulary::open(const std::string& path) {
  auto mapped = MappedFile::open(path);
  if (!mapped) return mapped.error();
  const std::span<const std::byte> bytes = (*mapped)->bytes();
  Header header;
  if (bytes.size() < sizeof header) return damaged(path, "too short");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0)
    return Error{ErrorCode::unsupported, fmt::format("{}: not a vocabulary", path)};
  if (header.version != kVersion)
    return Error{ErrorCode::unsupported,
                 fmt::format("{}: vocabulary of version {}, this program reads {}", path, header.version, kVersion)};
  if (header.nodes == 0 || header.nodes > kMaxNodes) return damaged(path, "a bad number of nodes");
  const std::size_t node_bytes = header.nodes * sizeof(VocabularyNode);
  if (bytes.size() != sizeof header + node_bytes + header.nodes * sizeof(Descriptor)) return damaged(path, "wrong length");
  if (checksum64(bytes.subspan(sizeof header)) != header.checksum) return damaged(path, "the checksum differs");

  Vocabulary v;
  v.kind_.assign(header.kind, strnlen(header.kind, sizeof header.kind));
  v.words_ = static_cast<int>(header.words);
  v.fingerprint_ = std::max<std::uint64_t>(header.checksum, 1);
  v.nodes_ = {reinterpret_cast<const VocabularyNode*>(bytes.data() + sizeof header), header.nodes};
  v.descriptors_ = {reinterpret_cast<const Descriptor*>(bytes.data() + sizeof header + node_bytes), header.nodes};
  v.owner_ = std::move(*mapped);
  if (const char* fault = fault_of(v.nodes_, header.words)) return damaged(path, fault);
  return v;
}

Vocabulary Vocabulary::from_nodes(std::string kind, std::vector<VocabularyNode> nodes, std::vector<Descriptor> descriptors) {
  struct Arrays {
    std::vector<VocabularyNode> nodes;
    std::vector<Descriptor> descriptors;
  };
  auto arrays = std::make_shared<Arrays>(Arrays{std::move(nodes), std::move(descriptors)});
  Vocabulary v;
  v.kind_ = std::move(kind);
  v.nodes_ = arrays->nodes;
  v.descriptors_ = arrays->descriptors;
  v.words_ = static_cast<int>(std::count_if(v.nodes_.begin(), v.nodes_.end(), [](const auto& n) { return n.children == 0; }));
  v.owner_ = std::move(arrays);
  const std::string body = v.body();
  v.fingerprint_ = std::max<std::uint64_t>(checksum64(std::as_bytes(std::span(body))), 1);
  return v;
}

/// Of the file, behind its header.
std::string Vocabulary::body() const {
  std::string body;
  body.append(reinterpret_cast<const char*>(nodes_.data()), nodes_.size_bytes());
  body.append(reinterpret_cast<const char*>(descriptors_.data()), descriptors_.size_bytes());
  return body;
}

Result<void> Vocabulary::save(const std::string& path) const {
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kVersion;
  header.nodes = static_cast<std::uint32_t>(nodes_.size());
  std::memcpy(header.kind, kind_.data(), std::min(kind_.size(), sizeof header.kind - 1));
  header.words = static_cast<std::uint32_t>(words_);
  const std::string body = this->body();
  header.checksum = checksum64(std::as_bytes(std::span(body)));
  return write_file_atomically(path, std::string(reinterpret_cast<const char*>(&header), sizeof header) + body);
}

std::int32_t Vocabulary::leaf_of(const Descriptor& descriptor) const {
  std::int32_t at = 0;
  std::uint16_t distance[kMaxChildren];
  while (nodes_[static_cast<std::size_t>(at)].children > 0) {
    const VocabularyNode& node = nodes_[static_cast<std::size_t>(at)];
    hamming_distances(descriptor,
                      descriptors_.subspan(static_cast<std::size_t>(node.first_child), static_cast<std::size_t>(node.children)),
                      distance);
    at = node.first_child + static_cast<std::int32_t>(std::min_element(distance, distance + node.children) - distance);
  }
  return at;
}

std::int32_t Vocabulary::word_of(const Descriptor& descriptor) const {
  return nodes_[static_cast<std::size_t>(leaf_of(descriptor))].word;
}

BowVector Vocabulary::words_of(std::span<const Descriptor> descriptors) const {
  BowVector all, bow;
  all.reserve(descriptors.size());
  for (const Descriptor& d : descriptors) {
    const VocabularyNode& leaf = nodes_[static_cast<std::size_t>(leaf_of(d))];
    all.push_back({leaf.word, leaf.idf});
  }
  std::sort(all.begin(), all.end(), [](const BowEntry& a, const BowEntry& b) { return a.word < b.word; });
  double total = 0;
  for (const BowEntry& e : all) {
    if (!bow.empty() && bow.back().word == e.word) bow.back().weight += e.weight;
    else bow.push_back(e);
    total += e.weight;
  }
  if (total > 0)
    for (BowEntry& e : bow) e.weight = static_cast<float>(e.weight / total);
  return bow;
}

}  // namespace fbvins

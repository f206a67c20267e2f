// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of a header with named fields and data; messages lie in chunks.
// The index at the end is not needed: all records are read in order.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/decompress.hpp"
#include "fbvins/core/byte_source.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLargestHeader_bytes = 1u << 20u;
enum Op : std::uint8_t { kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7 };

/// Seconds in the low half, nanoseconds in the high one.
Time time_of(std::uint64_t stamp) {
  return {static_cast<std::int64_t>(stamp & 0xffffffffu) * 1'000'000'000 + static_cast<std::int64_t>(stamp >> 32u)};
}

/// The fields of a record's header: name=value, each with its length.
class Fields {
 public:
  explicit Fields(std::string_view bytes) {
    ByteCursor in(bytes);
    while (in.ok() && in.left() > 0) {
      const std::string_view field = in.take(in.get<std::uint32_t>());
      const std::size_t equals = field.find('=');
      if (!in.ok() || equals == std::string_view::npos) {
        ok_ = false;
        return;
      }
      fields_.insert_or_assign(std::string(field.substr(0, equals)), std::string(field.substr(equals + 1)));
    }
  }
  bool ok() const { return ok_; }
  std::string text(const std::string& name) const {
    const auto at = fields_.find(name);
    return at == fields_.end() ? "" : at->second;
  }
  template <class Number>
  std::optional<Number> number(const std::string& name) const {
    const auto at = fields_.find(name);
    if (at == fields_.end() || at->second.size() != sizeof(Number)) return std::nullopt;
    return ByteCursor(at->second).get<Number>();
  }

 private:
  std::map<std::string, std::string> fields_;
  bool ok_ = true;
};

class Ros1Bag final : public BagReader {
 public:
  Ros1Bag(std::shared_ptr<const ByteSource> bytes, std::string name)
      : bytes_(std::move(bytes)), name_(std::move(name)), next_(kMagic.size()) {}

  std::string format() const override { return "ROS 1 bag"; }

  std::string_view read(const MessagePlace& place) override {
    if (kept_at_ != place.chunk) {
      const std::optional<Head> head = head_at(place.chunk);
      if (!head) return {};
      unpack_chunk(*head, kept_);
      kept_at_ = place.chunk;
    }
    if (place.offset > kept_.size() || place.length > kept_.size() - place.offset) return {};
    return std::string_view(kept_).substr(place.offset, place.length);
  }

 protected:
  std::optional<BagMessage> advance() override {
    while (true) {
      if (auto message = next_loaded()) return message;
      if (!load_next()) return std::nullopt;
    }
  }

 private:
  struct Head {
    Fields fields;
    std::uint64_t data = 0, length = 0;
    bool whole = false;
  };

  void complain_at(std::uint64_t offset, const std::string& sentence) {
    complain(fmt::format("{}: byte {}: {}", name_, offset, sentence));
  }

  /// The record at `at`; nullopt where its header is incomplete or malformed.
  std::optional<Head> head_at(std::uint64_t at) const {
    const std::string size = bytes_->read(at, sizeof(std::uint32_t));
    const auto length = ByteCursor(size).get<std::uint32_t>();
    if (size.size() < sizeof length || length > kLargestHeader_bytes) return std::nullopt;
    const std::string text = bytes_->read(at + sizeof length, length + sizeof length);
    if (text.size() < length + sizeof length) return std::nullopt;
    Head head{Fields(std::string_view(text).substr(0, length))};
    head.length = ByteCursor(std::string_view(text).substr(length)).get<std::uint32_t>();
    head.data = at + sizeof length + length + sizeof length;
    head.whole = head.length <= bytes_->size() - head.data;
    if (!head.fields.ok()) return std::nullopt;
    return head;
  }

  /// Returns whether all records are there. Buffers are reused: new ones of this size would cost more than unpacking.
  bool unpack_chunk(const Head& chunk, std::string& records) {
    const std::string compression = chunk.fields.text("compression");
    const auto size = chunk.fields.number<std::uint32_t>("size").value_or(0);
    if (is_plain(compression)) {
      bytes_->fill(records, chunk.data, chunk.length);
      return chunk.whole && (size == 0 || records.size() == size);
    }
    bytes_->fill(packed_, chunk.data, chunk.length);
    Unpacked out = unpack(compression, packed_, size, std::move(records));
    records = std::move(out.bytes);
    return chunk.whole && out.whole;
  }

  /// Goes on to the next record outside of chunks; false at the end of the file.
  bool load_next() {
    const std::uint64_t at = next_, size = bytes_->size();
    if (at >= size) return ended();
    const std::optional<Head> head = head_at(at);
    if (!head) {
      if (size - at > kLargestHeader_bytes) complain_at(at, "there is no record here, and what follows cannot be read");
      damage_.ends_early = true;
      next_ = size;
      return false;
    }
    next_ = head->whole ? head->data + head->length : size;
    const std::uint8_t op = head->fields.number<std::uint8_t>("op").value_or(0);
    if (!head->whole) damage_.ends_early = true;
    if (op == kIndex || op == kChunkInfo) indexed_ = true;
    if (op == kConnection && head->whole) take_connection(head->fields, bytes_->read(head->data, head->length));
    if (op == kChunk && !(window() && head->whole && lies_outside(*head))) load_chunk(at, *head);
    return true;
  }

  /// By the indexes of its connections, which follow a chunk. One without, or with a connection still unknown, is read.
  bool lies_outside(const Head& chunk) {
    constexpr std::size_t kEntry_bytes = 12;  // seconds, nanoseconds, place
    std::vector<std::size_t> topics;
    std::optional<std::pair<Time, Time>> span;
    for (std::uint64_t at = chunk.data + chunk.length;;) {
      const std::optional<Head> head = head_at(at);
      if (!head || head->fields.number<std::uint8_t>("op") != kIndex) break;
      const auto known = connections_.find(head->fields.number<std::uint32_t>("conn").value_or(~0u));
      if (!head->whole || known == connections_.end()) return false;
      topics.push_back(known->second);
      const std::string entries = bytes_->read(head->data, head->length);
      for (ByteCursor in(entries); in.left() >= kEntry_bytes; in.skip(sizeof(std::uint32_t))) {
        const Time t = time_of(in.get<std::uint64_t>());
        span = span ? std::pair(std::min(span->first, t), std::max(span->second, t)) : std::pair(t, t);
      }
      at = head->data + head->length;
    }
    return span && can_leave_out(span->first, span->second, topics);
  }

  bool ended() {
    if (!indexed_) damage_.ends_early = true;
    return false;
  }

  /// Of compressed chunks in a row so much is unpacked, then nothing more: the bag is made to keep the reader busy.
  bool is_affordable(const Head& chunk) {
    constexpr std::uint64_t kFree = std::uint64_t{64} << 20u, kRatio = 1000;
    if (is_plain(chunk.fields.text("compression"))) return true;
    return unpacked_bytes_ <= kFree + kRatio * (chunk.data + chunk.length);
  }

  void load_chunk(std::uint64_t at, const Head& head) {
    if (!is_affordable(head)) {
      complain_at(at, "what is compressed here unpacks to a thousand times its size: it is left out");
      next_ = bytes_->size();
      loaded_.clear();
      return;
    }
    loaded_whole_ = unpack_chunk(head, loaded_);
    unpacked_bytes_ += loaded_.size();
    loaded_at_ = at;
    position_ = 0;
    if (loaded_whole_ || !head.whole) return;
    if (loaded_.empty())
      complain_at(at,
                  fmt::format("this chunk, compressed by '{}', cannot be read", fbvins::quoted(head.fields.text("compression"))));
    else complain_at(at, "this chunk is damaged and is read up to its last complete record");
  }

  std::optional<BagMessage> next_loaded() {
    while (position_ < loaded_.size()) {
      ByteCursor in(std::string_view(loaded_).substr(position_));
      const Fields fields(in.take(in.get<std::uint32_t>()));
      const auto length = in.get<std::uint32_t>();
      const std::size_t data_at = position_ + in.position();
      const std::string_view data = in.take(length);
      const auto op = fields.number<std::uint8_t>("op");
      if (!in.ok() || !fields.ok() || !op) {
        if (loaded_whole_) complain_at(loaded_at_, "there is no whole record here in the chunk");
        position_ = loaded_.size();
        return std::nullopt;
      }
      position_ += in.position();
      if (*op == kConnection) take_connection(fields, data);
      if (*op != kMessage) continue;
      const auto known = connections_.find(fields.number<std::uint32_t>("conn").value_or(~0u));
      const auto time = fields.number<std::uint64_t>("time");
      if (known == connections_.end() || !time) {
        complain_at(loaded_at_, "a message in this chunk is of no known connection");
        continue;
      }
      return BagMessage{known->second, time_of(*time), data, {loaded_at_, data_at, length}};
    }
    return std::nullopt;
  }

  void take_connection(const Fields& fields, std::string_view data) {
    const auto id = fields.number<std::uint32_t>("conn");
    const Fields about(data);
    if (!id || !about.ok() || connections_.contains(*id)) return;
    const std::string topic = fields.text("topic"), type = about.text("type");
    connections_.emplace(*id, number_of({topic.empty() ? about.text("topic") : topic, type, Encoding::ros1}));
  }

  std::shared_ptr<const ByteSource> bytes_;
  std::string name_;
  std::uint64_t next_;
  std::string loaded_, kept_;  ///< records of the chunk in work, and of the one that read() used last
  std::string packed_;         ///< the last one's bytes in the file
  std::uint64_t loaded_at_ = 0, kept_at_ = 0, unpacked_bytes_ = 0;
  bool loaded_whole_ = true, indexed_ = false;
  std::size_t position_ = 0;
  std::map<std::uint32_t, std::size_t> connections_;
};

}  // namespace

Result<std::unique_ptr<BagReader>> read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name) {
  if (bytes->read(0, kMagic.size()) != kMagic)
    return Error{ErrorCode::malformed, fmt::format("{}: does not begin as a ROS 1 bag of format 2.0 does", name)};
  return std::unique_ptr<BagReader>(std::make_unique<Ros1Bag>(std::move(bytes), name));
}

}  // namespace fbvins

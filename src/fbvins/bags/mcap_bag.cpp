// SPDX-License-Identifier: Apache-2.0
// MCAP files of ROS messages, chunks or messages compressed or not: rosbag2's, Foxglove's and converted ROS 1 bags.
#include <fmt/format.h>

#include <map>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/decompress.hpp"
#include "fbvins/core/byte_source.hpp"
#include "fbvins/io/mcap_reader.hpp"

namespace fbvins {
namespace {

std::optional<std::string> unpack_chunk(std::string_view compression, std::string_view bytes, std::uint64_t size) {
  Unpacked out = unpack(compression, bytes, size);
  if (!out.known) return std::nullopt;
  return std::move(out.bytes);
}

class McapBag final : public BagReader {
 public:
  McapBag(std::shared_ptr<const ByteSource> bytes, McapReader reader) : bytes_(std::move(bytes)), reader_(std::move(reader)) {
    reader_.pass_over([this](Time first, Time last, const std::vector<const McapChannel*>& channels) {
      std::vector<std::size_t> topics;
      for (const McapChannel* channel : channels)
        if (is_message_of_ros(*channel)) topics.push_back(topic_of(*channel));
      return can_leave_out(first, last, topics);
    });
  }

  std::string format() const override { return "MCAP"; }

  std::string_view read(const MessagePlace& place) override {
    const std::string_view bytes = stored(place);
    if (!is_zstd(bytes)) return bytes;
    read_ = unpack("zstd", bytes, 0, std::move(read_)).bytes;
    return read_;
  }

 protected:
  std::optional<BagMessage> advance() override {
    while (const std::optional<McapMessage> message = reader_.next()) {
      if (!is_message_of_ros(*message->channel)) {
        note_stranger(*message->channel);
        continue;
      }
      const MessagePlace place{message->chunk, message->offset, message->data.size()};
      if (!is_zstd(message->data)) return BagMessage{topic_of(*message->channel), message->log_time, message->data, place};
      Unpacked out = unpack("zstd", message->data, 0, std::move(unpacked_));
      unpacked_ = std::move(out.bytes);
      if (out.whole) return BagMessage{topic_of(*message->channel), message->log_time, unpacked_, place};
      reader_.complain(message->offset, "this message cannot be unpacked");
    }
    const McapDamage& damage = reader_.damage();
    damage_ = {damage.parts, damage.first, damage.ends_early};
    return std::nullopt;
  }

 private:
  /// As it lies in the file.
  std::string_view stored(const MessagePlace& place) {
    if (place.chunk == 0) {
      bytes_->fill(message_, place.offset, place.length);
      return message_;
    }
    if (kept_at_ != place.chunk) kept_ = reader_.records_of(place.chunk), kept_at_ = place.chunk;
    if (place.offset > kept_.size() || place.length > kept_.size() - place.offset) return {};
    return std::string_view(kept_).substr(place.offset, place.length);
  }

  static bool is_message_of_ros(const McapChannel& channel) {
    return channel.message_encoding == "cdr" || channel.message_encoding == "ros1";
  }

  void note_stranger(const McapChannel& channel) {
    if (known_strangers_.insert(&channel).second)
      strangers_.insert(fmt::format("{} ({}, {})", channel.topic, channel.schema_name, channel.message_encoding));
  }

  std::size_t topic_of(const McapChannel& channel) {
    const auto [known, is_new] = numbers_.try_emplace(&channel);
    if (is_new)
      known->second = number_of(
          {channel.topic, plain_type(channel.schema_name), channel.message_encoding == "cdr" ? Encoding::cdr : Encoding::ros1});
    return known->second;
  }

  std::shared_ptr<const ByteSource> bytes_;
  McapReader reader_;
  std::map<const McapChannel*, std::size_t> numbers_;
  std::set<const McapChannel*> known_strangers_;
  std::string kept_, message_;  ///< records of the compressed chunk that read() used last; a message outside of such
  std::uint64_t kept_at_ = 0;
  std::string unpacked_, read_;  ///< compressed messages that next() and read() returned last
};

}  // namespace

Result<std::unique_ptr<BagReader>> read_mcap_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name) {
  Result<McapReader> reader = McapReader::open(bytes, name, unpack_chunk);
  if (!reader) return reader.error();
  return std::unique_ptr<BagReader>(std::make_unique<McapBag>(std::move(bytes), *std::move(reader)));
}

}  // namespace fbvins

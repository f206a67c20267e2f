// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/decompress.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>

namespace fbvins {
namespace {

constexpr std::uint64_t kFirstRatio = 8;  // first output buffer / compressed bytes
constexpr std::uint64_t kFirst_bytes = 4096;

/// Buffer that grows with the output, so that a wrong size costs no memory.
class Room {
 public:
  Room(std::string bytes, std::uint64_t first, std::uint64_t most) : bytes_(std::move(bytes)), most_(most) {
    const std::uint64_t there = bytes_.size();
    bytes_.resize(std::min(most, std::max(first, there)));
  }
  /// False: full.
  bool grow() {
    if (used_ == most_) return false;
    bytes_.resize(std::min<std::uint64_t>(most_, 2 * bytes_.size()));
    return bytes_.size() > used_;
  }
  char* begin() { return bytes_.data() + used_; }
  std::size_t left() const { return bytes_.size() - used_; }
  void use(std::size_t count) { used_ += count; }
  bool full() const { return used_ == most_; }
  std::string take() {
    bytes_.resize(used_);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint64_t most_, used_ = 0;
};

bool unpack_lz4(std::string_view in, Room& room) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw, LZ4F_freeDecompressionContext);
  while (true) {
    if (room.left() == 0 && !room.grow()) return room.full();
    std::size_t written = room.left(), read = in.size();
    const std::size_t wants = LZ4F_decompress(context.get(), room.begin(), &written, in.data(), &read, nullptr);
    if (LZ4F_isError(wants)) return false;
    room.use(written);
    in.remove_prefix(read);
    if (wants == 0) return true;
    if (read == 0 && written == 0) return false;
  }
}

bool unpack_bz2(std::string_view in, Room& room) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return false;
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end(&stream, BZ2_bzDecompressEnd);
  stream.next_in = const_cast<char*>(in.data());  // NOLINT: the library does not write there
  stream.avail_in = static_cast<unsigned>(std::min<std::size_t>(in.size(), std::numeric_limits<unsigned>::max()));
  while (true) {
    if (room.left() == 0 && !room.grow()) return room.full();
    const auto before = static_cast<unsigned>(room.left());
    const unsigned input = stream.avail_in;
    stream.next_out = room.begin();
    stream.avail_out = before;
    const int result = BZ2_bzDecompress(&stream);
    room.use(before - stream.avail_out);
    if (result == BZ_STREAM_END) return true;
    if (result != BZ_OK || (stream.avail_out == before && stream.avail_in == input)) return false;
  }
}

/// Size of the content as the frame says; 0 where it says none.
std::uint64_t size_in_frame(std::string_view in) {
  const unsigned long long size = ZSTD_getFrameContentSize(in.data(), in.size());
  return size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR ? 0 : size;
}

bool unpack_zstd(std::string_view in, Room& room) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), ZSTD_freeDStream);
  ZSTD_inBuffer input{in.data(), in.size(), 0};
  while (true) {
    if (room.left() == 0 && !room.grow()) return room.full();
    ZSTD_outBuffer output{room.begin(), room.left(), 0};
    const std::size_t before = input.pos, wants = ZSTD_decompressStream(stream.get(), &output, &input);
    if (ZSTD_isError(wants)) return false;
    room.use(output.pos);
    if (wants == 0) return true;
    if (output.pos == 0 && input.pos == before) return false;
  }
}

}  // namespace

Unpacked unpack(std::string_view compression, std::string_view bytes, std::uint64_t size, std::string room) {
  if (is_plain(compression)) {
    room.assign(bytes);
    return {std::move(room), true, size == 0 || bytes.size() == size};
  }
  auto* const work = compression == "lz4"    ? unpack_lz4
                     : compression == "bz2"  ? unpack_bz2
                     : compression == "zstd" ? unpack_zstd
                                             : nullptr;
  if (work == nullptr) return {{}, false, false};
  if (compression == "zstd" && size == 0) size = size_in_frame(bytes);
  const std::uint64_t most = largest_unpacked_bytes(bytes.size());
  if (size > most) return {};
  Room out_room(std::move(room), kFirst_bytes + kFirstRatio * bytes.size(), size == 0 ? most : size);
  const bool ended = work(bytes, out_room);
  Unpacked out{out_room.take(), true, ended};
  if (size != 0 && out.bytes.size() != size) out.whole = false;
  return out;
}

}  // namespace fbvins

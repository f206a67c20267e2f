// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/frame_ring.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>

#include <bit>
#include <cerrno>
#include <cstring>

namespace fbvins {
namespace {

/// The memory must be readable at any time: a tmpfs memfd, sealed against shrinking, large enough.
Result<void> check_memory(const FileDescriptor& memory, const FrameLayout& layout) {
  const auto wrong = [](std::string what) { return Error{ErrorCode::malformed, "the images' memory " + std::move(what)}; };
  const int seals = ::fcntl(memory.number(), F_GET_SEALS);
  if (seals < 0) return wrong("is not a memfd that allows sealing");
  if ((seals & F_SEAL_SHRINK) == 0) return wrong("is not sealed with F_SEAL_SHRINK");
  struct statfs kind {};
  if (::fstatfs(memory.number(), &kind) != 0 || kind.f_type != TMPFS_MAGIC) return wrong("is not of ordinary pages");
  struct stat state {};
  if (::fstat(memory.number(), &state) != 0 || state.st_size < 0 || static_cast<std::uint64_t>(state.st_size) < layout.bytes())
    return wrong(fmt::format("has {} bytes where {} slots need {}", state.st_size, layout.slots, layout.bytes()));
  return {};
}

}  // namespace

Result<std::shared_ptr<FrameRing>> FrameRing::map(const FileDescriptor& memory, const FrameLayout& layout,
                                                  std::shared_ptr<const WakeEvent> bell) {
  if (Result<void> good = check_memory(memory, layout); !good) return good.error();
  void* address = ::mmap(nullptr, layout.bytes(), PROT_READ, MAP_SHARED, memory.number(), 0);
  if (address == MAP_FAILED)
    return Error{ErrorCode::unreadable, fmt::format("the images' memory cannot be mapped: {}", std::strerror(errno))};
  return std::shared_ptr<FrameRing>(new FrameRing(static_cast<const std::uint8_t*>(address), layout, std::move(bell)));
}

FrameRing::~FrameRing() { ::munmap(const_cast<std::uint8_t*>(memory_), layout_.bytes()); }

Result<StereoFrame> FrameRing::take(const SocketFrame& frame) {
  if (frame.slot >= layout_.slots)
    return Error{ErrorCode::malformed, fmt::format("frame: no slot {}, there are {}", frame.slot, layout_.slots)};
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(frame.slot);
  if ((held_ & bit) != 0)
    return Error{ErrorCode::malformed, fmt::format("frame: slot {} again, which is not released", frame.slot)};
  const bool scarce = 2 * held() >= layout_.slots;
  held_ |= bit;
  if (!scarce) return borrow(frame);
  StereoFrame copied = copy(frame);
  released_.fetch_or(bit);
  bell_->ring();
  return copied;
}

std::uint64_t FrameRing::released() {
  const std::uint64_t slots = released_.exchange(0);
  held_ &= ~slots;
  return slots;
}

int FrameRing::held() const { return std::popcount(held_ & ~released_.load()); }

const std::uint8_t* FrameRing::pixels(const SocketFrame& frame, bool right) const {
  return memory_ + static_cast<std::size_t>(frame.slot) * layout_.slot_bytes + (right ? layout_.right_offset_bytes : 0);
}

StereoFrame FrameRing::borrow(const SocketFrame& frame) {
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(frame.slot);
  const std::shared_ptr<const std::uint8_t> slot(pixels(frame, false), [ring = shared_from_this(), bit](const std::uint8_t*) {
    ring->released_.fetch_or(bit);
    ring->bell_->ring();
  });
  const auto image = [&](bool there, bool right) -> std::shared_ptr<const Image> {
    if (!there) return nullptr;
    return std::make_shared<const Image>(layout_.width_px, layout_.height_px,
                                         std::shared_ptr<const std::uint8_t>(slot, pixels(frame, right)));
  };
  return {frame.t, image(frame.left, false), image(frame.right, true)};
}

StereoFrame FrameRing::copy(const SocketFrame& frame) const {
  const auto image = [&](bool there, bool right) -> std::shared_ptr<const Image> {
    if (!there) return nullptr;
    Image own(layout_.width_px, layout_.height_px);
    std::memcpy(own.row(0), pixels(frame, right), layout_.image_bytes());
    return std::make_shared<const Image>(std::move(own));
  };
  return {frame.t, image(frame.left, false), image(frame.right, true)};
}

}  // namespace fbvins

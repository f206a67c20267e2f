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
                                                  std::shared_ptr<const WakeEvent> wake) {
  if (Result<void> good = check_memory(memory, layout); !good) return good.error();
  void* address = ::mmap(nullptr, layout.bytes(), PROT_READ, MAP_SHARED, memory.number(), 0);
  if (address == MAP_FAILED)
    return Error{ErrorCode::unreadable, fmt::format("the images' memory cannot be mapped: {}", std::strerror(errno))};
  return std::shared_ptr<FrameRing>(new FrameRing(static_cast<const std::uint8_t*>(address), layout, std::move(wake)));
}

FrameRing::~FrameRing() { ::munmap(const_cast<std::uint8_t*>(memory_), layout_.bytes()); }

Result<StereoFrame> FrameRing::take(const SocketFrame& frame) {
  if (frame.slot >= layout_.slots)
    return Error{ErrorCode::malformed, fmt::format("frame: no slot {}, there are {}", frame.slot, layout_.slots)};
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(frame.slot);
  if ((held_ & bit) != 0)
    return Error{ErrorCode::malformed, fmt::format("frame: slot {} again, which is not released", frame.slot)};
  const std::uint32_t depth = layout_.depth_offset_bytes > 0 ? FBVINS_SOCKET_DEPTH : 0;
  if (((frame.images & ~depth) >> static_cast<unsigned>(layout_.cameras)) != 0)
    return Error{ErrorCode::malformed, fmt::format("frame: images of more than the {} cameras of the hello", layout_.cameras)};
  const bool scarce = 2 * held() >= layout_.slots;
  held_ |= bit;
  if (!scarce) return borrow(frame);
  StereoFrame copied = copy(frame);
  released_.fetch_or(bit);
  wake_->signal();
  return copied;
}

std::uint64_t FrameRing::released() {
  const std::uint64_t slots = released_.exchange(0);
  held_ &= ~slots;
  return slots;
}

int FrameRing::held() const { return std::popcount(held_ & ~released_.load()); }

const std::uint8_t* FrameRing::slot(const SocketFrame& frame) const {
  return memory_ + static_cast<std::size_t>(frame.slot) * layout_.slot_bytes;
}

const std::uint8_t* FrameRing::pixels(const SocketFrame& frame, int camera) const {
  return slot(frame) + layout_.offset_bytes[static_cast<std::size_t>(camera)];
}

std::shared_ptr<const DepthImage> FrameRing::depth(const SocketFrame& frame) const {
  if ((frame.images & FBVINS_SOCKET_DEPTH) == 0) return nullptr;
  auto out = std::make_shared<DepthImage>(DepthImage{layout_.depth_width_px, layout_.depth_height_px, {}});
  out->mm.resize(layout_.depth_values());
  std::memcpy(out->mm.data(), slot(frame) + layout_.depth_offset_bytes, 2 * layout_.depth_values());
  return out;
}

template <class ImageOf>
StereoFrame FrameRing::with_images(const SocketFrame& frame, ImageOf&& image_of) const {
  StereoFrame out{frame.t};
  out.offsets = frame.offsets;
  out.depth = depth(frame);
  for (int i = 0; i < layout_.cameras; ++i) {
    if ((frame.images >> static_cast<unsigned>(i) & 1U) == 0) continue;
    out.set_image(i, std::make_shared<const Image>(image_of(pixels(frame, i))));
  }
  return out;
}

StereoFrame FrameRing::borrow(const SocketFrame& frame) {
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(frame.slot);
  const std::shared_ptr<const std::uint8_t> slot(pixels(frame, 0), [ring = shared_from_this(), bit](const std::uint8_t*) {
    ring->released_.fetch_or(bit);
    ring->wake_->signal();
  });
  return with_images(frame, [&](const std::uint8_t* pixels) {
    return Image(layout_.width_px, layout_.height_px, std::shared_ptr<const std::uint8_t>(slot, pixels));
  });
}

StereoFrame FrameRing::copy(const SocketFrame& frame) const {
  return with_images(frame, [&](const std::uint8_t* pixels) {
    Image own(layout_.width_px, layout_.height_px);
    std::memcpy(own.row(0), pixels, layout_.image_bytes());
    return own;
  });
}

}  // namespace fbvins

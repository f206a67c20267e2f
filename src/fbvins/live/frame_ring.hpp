// SPDX-License-Identifier: Apache-2.0
// A sender's images where it wrote them: its shared memory, mapped for reading, as slots that frames are made of without a
// copy. A slot goes back when the last image in it is gone, on whatever thread that is; images outlive the sender and its
// connection. All but the images' end: one thread.
//
//   Result<std::shared_ptr<FrameRing>> ring = FrameRing::map(std::move(memfd), hello.layout, bell);
//   Result<StereoFrame> frame = (*ring)->take(message);   // an error where the sender announces a slot twice
//   ...                                                   // the bell rings
//   std::uint64_t free_again = (*ring)->released();       // bit k: slot k
//
// The sender cannot take the memory away: it must be sealed against shrinking, so no read ends in SIGBUS. It may write to a
// slot that is in use; then its images are garbage, and nothing else is.
#pragma once

#include <atomic>
#include <memory>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/live/bell.hpp"
#include "fbvins/live/socket_message.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

class FrameRing : public std::enable_shared_from_this<FrameRing> {
 public:
  static Result<std::shared_ptr<FrameRing>> map(const FileDescriptor& memory, const FrameLayout& layout,
                                                std::shared_ptr<const Bell> bell);
  FrameRing(const FrameRing&) = delete;
  FrameRing& operator=(const FrameRing&) = delete;
  ~FrameRing();

  /// Where half of the slots are out already the images are copied, and the slot is free at once: whoever keeps frames for
  /// long cannot leave the sender without a slot.
  Result<StereoFrame> take(const SocketFrame& frame);
  /// The slots that became free since it was last asked; the sender may be told.
  std::uint64_t released();
  /// Slots that are not the sender's.
  int held() const;

 private:
  FrameRing(const std::uint8_t* memory, const FrameLayout& layout, std::shared_ptr<const Bell> bell)
      : memory_(memory), layout_(layout), bell_(std::move(bell)) {}
  StereoFrame borrow(const SocketFrame& frame);
  StereoFrame copy(const SocketFrame& frame) const;
  const std::uint8_t* pixels(const SocketFrame& frame, bool right) const;

  const std::uint8_t* memory_;
  FrameLayout layout_;
  std::shared_ptr<const Bell> bell_;
  std::uint64_t held_ = 0;
  std::atomic<std::uint64_t> released_ = 0;
};

}  // namespace fbvins

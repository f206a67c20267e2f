// SPDX-License-Identifier: Apache-2.0
// A sender's shared memory, mapped for reading: its slots become frames without a copy but of depth images. A slot is released
// when the last image in it is destroyed, on whatever thread that is; images may outlive the sender and its connection. But for
// the images' destruction: one thread.
//
//   Result<std::shared_ptr<FrameRing>> ring = FrameRing::map(std::move(memfd), hello.layout, wake);
//   Result<StereoFrame> frame = (*ring)->take(message);   // an error where the sender announces a slot twice
//   ...                                                   // the event is signalled
//   std::uint64_t free_again = (*ring)->released();       // bit k: slot k
//
// The sender cannot take the memory away: it must be sealed against shrinking, so no read ends in SIGBUS. It may write to a
// slot that is in use; then its images are garbage, and nothing else is.
#pragma once

#include <atomic>
#include <memory>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/live/socket_message.hpp"
#include "fbvins/live/wake_event.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

class FrameRing : public std::enable_shared_from_this<FrameRing> {
 public:
  static Result<std::shared_ptr<FrameRing>> map(const FileDescriptor& memory, const FrameLayout& layout,
                                                std::shared_ptr<const WakeEvent> wake);
  FrameRing(const FrameRing&) = delete;
  FrameRing& operator=(const FrameRing&) = delete;
  ~FrameRing();

  /// Where half of the slots are held already the images are copied and the slot is released at once, so that whoever keeps
  /// frames for long does not use up the sender's slots.
  Result<StereoFrame> take(const SocketFrame& frame);
  /// The slots released since the last call, to be sent to the sender.
  std::uint64_t released();
  /// Slots that are not the sender's.
  int held() const;

 private:
  FrameRing(const std::uint8_t* memory, const FrameLayout& layout, std::shared_ptr<const WakeEvent> wake)
      : memory_(memory), layout_(layout), wake_(std::move(wake)) {}
  StereoFrame borrow(const SocketFrame& frame);
  StereoFrame copy(const SocketFrame& frame) const;
  const std::uint8_t* slot(const SocketFrame& frame) const;
  const std::uint8_t* pixels(const SocketFrame& frame, int camera) const;
  std::shared_ptr<const DepthImage> depth(const SocketFrame& frame) const;
  /// `image_of(pixels)`: of each camera that the frame has one of.
  template <class ImageOf>
  StereoFrame with_images(const SocketFrame& frame, ImageOf&& image_of) const;

  const std::uint8_t* memory_;
  FrameLayout layout_;
  std::shared_ptr<const WakeEvent> wake_;
  std::uint64_t held_ = 0;
  std::atomic<std::uint64_t> released_ = 0;
};

}  // namespace fbvins

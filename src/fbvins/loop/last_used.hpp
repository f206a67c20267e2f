// SPDX-License-Identifier: Apache-2.0
// Private: values by number, of which the last ones used are kept, up to a number of bytes. One thread at a time.
//
//   LastUsed<Place> kept(1'000'000);
//   std::shared_ptr<Place> place = kept.find(7);
//   if (!place) place = kept.keep(7, read(7), bytes);
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>

namespace fbvins {

template <class T>
class LastUsed {
 public:
  /// The last one is kept in any case.
  explicit LastUsed(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  /// Null where it is not kept.
  std::shared_ptr<T> find(std::size_t number) {
    const auto known = by_number_.find(number);
    if (known == by_number_.end()) return nullptr;
    held_.splice(held_.begin(), held_, known->second);
    return held_.front().value;
  }
  /// One that is not kept yet.
  std::shared_ptr<T> keep(std::size_t number, T value, std::uint64_t bytes) {
    held_.push_front({number, std::make_shared<T>(std::move(value)), bytes + kOverhead_bytes});
    by_number_[number] = held_.begin();
    bytes_ += held_.front().bytes;
    while (bytes_ > most_bytes_ && held_.size() > 1) {
      bytes_ -= held_.back().bytes;
      by_number_.erase(held_.back().number);
      held_.pop_back();
    }
    return held_.front().value;
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  /// Of list, table and vectors.
  static constexpr std::uint64_t kOverhead_bytes = 256;
  struct Held {
    std::size_t number;
    std::shared_ptr<T> value;
    std::uint64_t bytes;
  };

  std::uint64_t most_bytes_, bytes_ = 0;
  std::list<Held> held_;  ///< the last used first
  std::unordered_map<std::size_t, typename std::list<Held>::iterator> by_number_;
};

}  // namespace fbvins

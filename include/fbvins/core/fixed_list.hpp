// SPDX-License-Identifier: Apache-2.0
// A list of at most N values within the object that has it: no memory is allocated, and a copy copies what is in the list.
//
//   FixedList<int, 4> list;
//   list.push_back(3);
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace fbvins {

template <class T, std::size_t N>
class FixedList {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  FixedList() {}  // NOLINT: the places begin empty
  FixedList(const FixedList& other) : size_(other.size_) { std::uninitialized_copy(other.begin(), other.end(), items_); }
  FixedList& operator=(const FixedList& other) {
    if (this == &other) return *this;
    size_ = other.size_;
    std::uninitialized_copy(other.begin(), other.end(), items_);
    return *this;
  }
  ~FixedList() = default;

  static constexpr std::size_t capacity() { return N; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* begin() { return items_; }
  T* end() { return items_ + size_; }
  const T* begin() const { return items_; }
  const T* end() const { return items_ + size_; }
  T& front() { return items_[0]; }
  const T& front() const { return items_[0]; }
  T& operator[](std::size_t index) { return items_[index]; }
  const T& operator[](std::size_t index) const { return items_[index]; }

  /// Not into a full list.
  T& push_back(const T& value) {
    assert(size_ < N);
    return *std::construct_at(items_ + size_++, value);
  }
  /// Before the others.
  T& push_front(const T& value) {
    const T copy = value;
    push_back(copy);
    std::rotate(begin(), end() - 1, end());
    return front();
  }
  void clear() { size_ = 0; }
  template <class Predicate>
  void erase_if(Predicate&& leaves) {
    size_ = static_cast<std::size_t>(std::remove_if(begin(), end(), leaves) - begin());
  }

 private:
  union {
    T items_[N];  // the first size_ of them
  };
  std::size_t size_ = 0;
};

}  // namespace fbvins

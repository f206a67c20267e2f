// SPDX-License-Identifier: Apache-2.0
// Private: a long series in bounded memory. When it is full every second value is dropped, and from then on only every second
// new one is kept, and so on: it always covers the whole time, ever more coarsely. One thread.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace fbvins {

template <class T>
class Thinned {
 public:
  explicit Thinned(std::size_t most) : most_(most) {}

  void push(T value) {
    if (count_++ % stride_ != 0) return;
    if (values_.size() >= most_) halve();
    values_.push_back(std::move(value));
  }
  void clear() { values_.clear(), count_ = 0, stride_ = 1; }
  const std::vector<T>& values() const { return values_; }

 private:
  void halve() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < values_.size(); i += 2) values_[kept++] = std::move(values_[i]);
    values_.resize(kept);
    stride_ *= 2;
  }

  std::size_t most_;
  std::size_t count_ = 0, stride_ = 1;
  std::vector<T> values_;
};

}  // namespace fbvins

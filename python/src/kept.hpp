// SPDX-License-Identifier: Apache-2.0
// References of C++ objects to Python's: to the makers of frontends (register_frontend) and to their frontends.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace fbvins::python {

/// A reference that ends with the interpreter at the latest, on whatever thread.
class Kept {
 public:
  explicit Kept(nb::object object) : object_(std::move(object)) {}
  Kept(const Kept&) = delete;
  Kept& operator=(const Kept&) = delete;
  ~Kept() {
    if (!Py_IsInitialized()) {
      (void)object_.release();
      return;
    }
    const nb::gil_scoped_acquire acquired;
    object_.reset();
  }
  nb::handle get() const { return object_; }
  void reset() { object_.reset(); }

 private:
  nb::object object_;
};

/// The frontends in Python that were made since the last call and are alive: a System shows those that it made to the cyclic
/// garbage collector.
std::vector<std::shared_ptr<Kept>> newly_made_frontends();

}  // namespace fbvins::python

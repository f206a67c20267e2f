// SPDX-License-Identifier: Apache-2.0
// Private: numbers, poses and vectors as bytes of a map file, little-endian, as every machine this runs on. Values.
//
//   BytesOut out;
//   out.put(T_MB);
//   BytesIn in(bytes);
//   const auto T = in.pose<Pose<M, B>>();
//   if (!in.ok()) return damaged();           // too short, or no pose
#pragma once

#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

class BytesOut {
 public:
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const Vec3& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  void put(const Quat& q) {
    for (const double c : {q.w(), q.x(), q.y(), q.z()}) put(c);
  }
  template <class A, class Z>
  void put(const Pose<A, Z>& T) {
    put(T.q);
    put(T.p);
  }
  void raw(const void* data, std::size_t n) { bytes_.append(static_cast<const char*>(data), n); }
  std::size_t size() const { return bytes_.size(); }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// After the first value that is not there or not sensible nothing that was read may be used.
class BytesIn {
 public:
  explicit BytesIn(std::string_view bytes) : rest_(bytes) {}

  bool ok() const { return ok_; }
  bool at_end() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }
  void check(bool good) { ok_ = ok_ && good; }
  template <class T>
  T get() {
    T value{};
    raw(&value, sizeof value);
    return value;
  }
  void raw(void* out, std::size_t n) {
    check(n <= rest_.size());
    if (!ok_ || n == 0) return;  // an empty vector has no address to copy to
    std::memcpy(out, rest_.data(), n);
    rest_.remove_prefix(n);
  }
  Vec3 vec3() {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v[i] = get<double>();
    check(v.allFinite());
    return v;
  }
  template <class P>
  P pose() {
    const double w = get<double>(), x = get<double>(), y = get<double>(), z = get<double>();
    const Quat q(w, x, y, z);
    check(std::abs(q.squaredNorm() - 1) < 1e-6);  // false for NaN
    return P(q, vec3());
  }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace fbvins

// SPDX-License-Identifier: Apache-2.0
// NumPy arrays in and out: inputs are checked, outputs are not copied a second time. All functions need the GIL.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins::python {

namespace nb = nanobind;

/// Raises an Error of the library as a Python exception: FileNotFoundError, OSError, ValueError or RuntimeError.
[[noreturn]] void raise(const Error& error);

template <class T>
T value_or_raise(Result<T> result) {
  if (!result) raise(result.error());
  return *std::move(result);
}
inline void check(const Result<void>& result) {
  if (!result) raise(result.error());
}

/// An array to return that owns its memory, also as a property, where nanobind would make the object its owner.
template <class T>
struct Array {
  nb::ndarray<nb::numpy, T> numbers;
};

/// Moves the numbers into a NumPy array.
template <class T>
Array<T> to_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return {nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.begin(), owner)};
}

/// An Eigen matrix or vector, row-major; a vector has one axis.
template <class Derived>
Array<double> to_array(const Eigen::MatrixBase<Derived>& m) {
  std::vector<double> values;
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j) values.push_back(m(i, j));
  if (m.cols() == 1) return to_array(std::move(values), {static_cast<std::size_t>(m.rows())});
  return to_array(std::move(values), {static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())});
}

Array<double> matrix_of(const Quat& q, const Vec3& p);
template <class To, class From>
Array<double> to_array(const Pose<To, From>& T) {
  return matrix_of(T.q, T.p);
}

/// In the package's order, w first.
inline Eigen::Vector4d wxyz(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// One number per row: `of(row)`.
template <class T, class Rows, class Function>
Array<T> column(const Rows& rows, Function of) {
  std::vector<T> values;
  values.reserve(rows.size());
  for (const auto& row : rows) values.push_back(static_cast<T>(of(row)));
  return to_array(std::move(values), {rows.size()});
}

/// One Eigen vector or matrix of fixed size per row: (N, n) or (N, n, m).
template <class Rows, class Function>
Array<double> columns(const Rows& rows, Function of) {
  using Matrix = std::decay_t<decltype(of(*rows.begin()))>;
  constexpr std::size_t kRows = Matrix::RowsAtCompileTime, kColumns = Matrix::ColsAtCompileTime;
  std::vector<double> values;
  values.reserve(rows.size() * kRows * kColumns);
  for (const auto& row : rows) {
    const Matrix m = of(row);
    for (std::size_t i = 0; i < kRows; ++i)
      for (std::size_t j = 0; j < kColumns; ++j) values.push_back(m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
  }
  if (kColumns == 1) return to_array(std::move(values), {rows.size(), kRows});
  return to_array(std::move(values), {rows.size(), kRows, kColumns});
}

/// Any size of an axis, in the shape of a checked array.
inline constexpr std::int64_t kAny = -1;

/// An array of this type and shape in C order: read in place where it is just that, else a copy, where no value changes by it
/// (float32 as float64, int32 as int64, a view with steps). Raises ValueError with what was expected of `name` and what it is.
/// The object keeps the memory alive.
template <class T>
struct CheckedArray {
  nb::object keeper;
  const T* data = nullptr;
  std::vector<std::size_t> shape;

  std::size_t rows() const { return shape.empty() ? 1 : shape[0]; }
};
template <class T>
CheckedArray<T> checked(nb::handle object, const char* name, std::initializer_list<std::int64_t> shape);

/// Converts a list or tuple of numbers to an array of double; returns any other object as it is.
nb::object as_double(nb::handle object);

/// For __reduce__: a function of fbvins/_restore.py and its argument.
nb::object reduced(const char* function, nb::object argument);

/// A whole number: Python's or NumPy's. Raises TypeError for any other object.
std::int64_t whole_number(nb::handle object, const char* name);
/// Whether the object has axes: (N,), not a number.
bool has_axes(nb::handle object);

Vec3 vector3(nb::handle object, const char* name);
/// (4, 4): a rotation and a translation.
template <class To, class From>
Pose<To, From> transform(nb::handle object, const char* name);

}  // namespace fbvins::python

template <class T>
struct nanobind::detail::type_caster<fbvins::python::Array<T>> {
  using Inner = make_caster<ndarray<numpy, T>>;
  static constexpr auto Name = Inner::Name;
  template <class>
  using Cast = fbvins::python::Array<T>;
  static handle from_cpp(const fbvins::python::Array<T>& array, rv_policy, cleanup_list* cleanup) noexcept {
    return Inner::from_cpp(array.numbers, rv_policy::automatic, cleanup);
  }
};

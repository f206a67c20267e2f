// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <string_view>
#include <type_traits>

namespace fbvins::python {
namespace {

template <class T>
constexpr const char* kName = "";
template <>
constexpr const char* kName<std::uint8_t> = "uint8";
template <>
constexpr const char* kName<std::uint16_t> = "uint16";
template <>
constexpr const char* kName<std::int8_t> = "int8";
template <>
constexpr const char* kName<std::int64_t> = "int64";
template <>
constexpr const char* kName<double> = "float64";

std::string text_of(std::initializer_list<std::int64_t> shape) {
  std::vector<std::string> sides;
  for (const std::int64_t side : shape) sides.push_back(side == kAny ? "N" : std::to_string(side));
  return fmt::format("({}{})", fmt::join(sides, ", "), sides.size() == 1 ? "," : "");
}

/// Type and shape of the object, for messages.
std::string text_of(nb::handle object) {
  const nb::object type = object.type().attr("__name__");
  if (!nb::hasattr(object, "dtype") || !nb::hasattr(object, "shape")) return nb::str(type).c_str();
  const nb::object kind = object.attr("dtype"), shape = object.attr("shape");
  return fmt::format("{} {}", nb::str(kind).c_str(), nb::str(shape).c_str());
}

template <class Array>
bool has_holes(const Array& array) {
  std::int64_t next = 1;
  for (std::size_t axis = array.ndim(); axis-- > 0;) {
    if (array.shape(axis) > 1 && array.stride(axis) != next) return true;
    next *= static_cast<std::int64_t>(array.shape(axis));
  }
  return false;
}

/// Whether NumPy converts it without losing a digit; stamps may be unsigned, images must not be of another kind of number.
template <class T>
bool keeps_values(nb::handle object) {
  if (!nb::hasattr(object, "dtype")) return false;
  const nb::object kind = object.attr("dtype").attr("kind");
  if (std::string_view(nb::str(kind).c_str()) == "b") return false;
  constexpr const char* kRule = std::is_same_v<T, std::int64_t> || std::is_same_v<T, double> ? "same_kind" : "safe";
  const nb::object numpy = nb::module_::import_("numpy");
  return nb::cast<bool>(nb::module_::import_("builtins")
                            .attr("bool")(numpy.attr("can_cast")(object.attr("dtype"), kName<T>, nb::arg("casting") = kRule)));
}

}  // namespace

nb::object reduced(const char* function, nb::object argument) {
  return nb::make_tuple(nb::module_::import_("fbvins._restore").attr(function), nb::make_tuple(std::move(argument)));
}

std::int64_t whole_number(nb::handle object, const char* name) {
  const nb::object number = nb::steal(PyNumber_Index(object.ptr()));
  if (!number.is_valid()) {
    PyErr_Clear();
    throw nb::type_error(fmt::format("{}: a whole number is expected, not {}", name, text_of(object)).c_str());
  }
  return nb::cast<std::int64_t>(number);
}

bool has_axes(nb::handle object) { return nb::hasattr(object, "ndim") && nb::cast<int>(object.attr("ndim")) > 0; }

void raise(const Error& error) {
  PyObject* type = PyExc_ValueError;
  switch (error.code) {
    case ErrorCode::not_found: type = PyExc_FileNotFoundError; break;
    case ErrorCode::unreadable:
    case ErrorCode::unwritable: type = PyExc_OSError; break;
    case ErrorCode::stage_failed: type = PyExc_RuntimeError; break;
    case ErrorCode::malformed:
    case ErrorCode::unsupported:
    case ErrorCode::invalid_argument: break;
  }
  PyErr_SetString(type, error.message.c_str());
  throw nb::python_error();
}

Array<double> matrix_of(const Quat& q, const Vec3& p) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = q.toRotationMatrix();
  T.topRightCorner<3, 1>() = p;
  return to_array(T);
}

template <class T>
CheckedArray<T> checked(nb::handle object, const char* name, std::initializer_list<std::int64_t> shape) {
  const auto refuse = [&](const std::string& why) {
    throw nb::value_error(
        fmt::format("{}: a NumPy array of {} {} in C order is expected, {}", name, kName<T>, text_of(shape), why).c_str());
  };
  nb::ndarray<nb::ro> array;
  if (!nb::ndarray_check(object) || !nb::try_cast(object, array)) refuse(fmt::format("not {}", text_of(object)));
  bool fits = array.ndim() == shape.size() && array.device_type() == nb::device::cpu::value;
  for (std::size_t axis = 0; fits && axis < shape.size(); ++axis)
    fits = shape.begin()[axis] == kAny || static_cast<std::int64_t>(array.shape(axis)) == shape.begin()[axis];
  const bool exact = array.dtype() == nb::dtype<T>();
  if (!fits || (!exact && !keeps_values<T>(object))) refuse(fmt::format("not {}", text_of(object)));
  nb::object keeper = nb::borrow(object);
  if (!exact || has_holes(array)) {
    keeper = nb::module_::import_("numpy").attr("ascontiguousarray")(object, nb::arg("dtype") = kName<T>);
    array = nb::cast<nb::ndarray<nb::ro>>(keeper);
  }
  CheckedArray<T> out{std::move(keeper), static_cast<const T*>(array.data()), {}};
  for (std::size_t axis = 0; axis < array.ndim(); ++axis) out.shape.push_back(array.shape(axis));
  return out;
}

template CheckedArray<std::uint8_t> checked(nb::handle, const char*, std::initializer_list<std::int64_t>);
template CheckedArray<std::uint16_t> checked(nb::handle, const char*, std::initializer_list<std::int64_t>);
template CheckedArray<std::int8_t> checked(nb::handle, const char*, std::initializer_list<std::int64_t>);
template CheckedArray<std::int64_t> checked(nb::handle, const char*, std::initializer_list<std::int64_t>);
template CheckedArray<double> checked(nb::handle, const char*, std::initializer_list<std::int64_t>);

nb::object as_double(nb::handle object) {
  if (!nb::isinstance<nb::list>(object) && !nb::isinstance<nb::tuple>(object)) return nb::borrow(object);
  return nb::module_::import_("numpy").attr("asarray")(object, nb::arg("dtype") = "float64");
}

Vec3 vector3(nb::handle object, const char* name) {
  const CheckedArray<double> array = checked<double>(as_double(object), name, {3});
  return {array.data[0], array.data[1], array.data[2]};
}

template <class To, class From>
Pose<To, From> transform(nb::handle object, const char* name) {
  const CheckedArray<double> array = checked<double>(as_double(object), name, {4, 4});
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(array.data);
  const Mat3 R = T.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-3;  // matrices typed by hand have three or four digits
  const bool rigid = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < kTolerance && R.determinant() > 0 &&
                     T.row(3) == Eigen::RowVector4d(0, 0, 0, 1) && T.allFinite();
  if (!rigid) throw nb::value_error(fmt::format("{}: a rotation and a translation over 0 0 0 1 is expected", name).c_str());
  return {R, Vec3(T.topRightCorner<3, 1>())};
}
template Pose<B, C0> transform(nb::handle, const char*);
template Pose<B, C1> transform(nb::handle, const char*);

}  // namespace fbvins::python

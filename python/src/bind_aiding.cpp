// SPDX-License-Identifier: Apache-2.0
// Readings of the sensors that aid images and IMU, as a Recording delivers them and System.push() takes them.
#include <fmt/format.h>

#include <limits>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fbvins/types/aiding.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

Vec3 vector_or(nb::handle value, const char* name, const Vec3& otherwise) {
  return value.is_none() ? otherwise : vector3(value, name);
}

Quat axes_of(nb::handle wxyz) {
  if (wxyz.is_none()) return Quat::Identity();
  const auto q = checked<double>(wxyz, "orientation", {4});
  return {q.data[0], q.data[1], q.data[2], q.data[3]};
}

/// ValueError where it cannot be.
template <class Sample>
Sample possible(Sample reading) {
  if (const std::string why = impossible(reading); !why.empty()) throw nb::value_error(why.c_str());
  return reading;
}

template <class Sample>
void bind_common(nb::class_<Sample>& bound, const char* name) {
  bound
      .def_prop_ro(
          "t", [](const Sample& s) { return s.t.ns; }, "ns of the cameras' clock")
      .def("__repr__", [name](const Sample& s) { return fmt::format("<fbvins.{} t={} ns>", name, s.t.ns); });
}

void bind_range(nb::module_& m) {
  nb::class_<RangeSample> bound(
      m, "RangeSample",
      "A reading of a rangefinder, for System.push(): distance in m along a beam that begins at point and "
      "points along direction, both (3,) in B, None: the origin, and down along -z. distance may be inf, "
      "where it sees nothing. ValueError for one that cannot be.");
  bound.def(
      "__init__",
      [](RangeSample* at, nb::handle t, double distance, double sigma, nb::handle point, nb::handle direction, double nearest,
         double farthest) {
        RangeSample r{Time{whole_number(t, "t")},
                      distance,
                      sigma,
                      vector_or(point, "point", Vec3::Zero()),
                      vector_or(direction, "direction", -Vec3::UnitZ()),
                      nearest,
                      farthest};
        new (at) RangeSample(possible(r));
      },
      "t"_a, "distance"_a, "sigma"_a = 0.02, "point"_a.none() = nb::none(), "direction"_a.none() = nb::none(), "nearest"_a = 0.1,
      "farthest"_a = 40.0,
      nb::sig("def __init__(self, t: int, distance: float, sigma: float = 0.02, point: numpy.ndarray | None = None, "
              "direction: numpy.ndarray | None = None, nearest: float = 0.1, farthest: float = 40.0) -> None"));
  bind_common(bound, "RangeSample");
  bound.def_ro("distance", &RangeSample::distance_m, "m").def_ro("sigma", &RangeSample::sigma_m, "m");
  bound.def_prop_ro(
      "point", [](const RangeSample& r) { return to_array(r.p_B); }, "(3,), m, in B");
  bound.def_prop_ro(
      "direction", [](const RangeSample& r) { return to_array(r.direction_B); }, "(3,), in B");
}

void bind_velocity(nb::module_& m) {
  nb::class_<VelocitySample> bound(
      m, "VelocitySample",
      "A reading of a sensor of velocity (wheels, optical flow), for System.push(): velocity (3,) in m/s "
      "in the sensor's axes, sigma (3,) the standard deviations along them, 100 for one that is not "
      "measured; point (3,) in m where it sits in B, orientation (4,) w, x, y, z takes its axes to B's. "
      "ValueError for one that cannot be.");
  bound.def(
      "__init__",
      [](VelocitySample* at, nb::handle t, nb::handle velocity, nb::handle sigma, nb::handle point, nb::handle orientation) {
        VelocitySample v{Time{whole_number(t, "t")}, vector3(velocity, "velocity"),
                         vector_or(sigma, "sigma", VelocitySample{}.sigma_mps), vector_or(point, "point", Vec3::Zero()),
                         axes_of(orientation)};
        new (at) VelocitySample(possible(v));
      },
      "t"_a, "velocity"_a, "sigma"_a.none() = nb::none(), "point"_a.none() = nb::none(), "orientation"_a.none() = nb::none(),
      nb::sig("def __init__(self, t: int, velocity: numpy.ndarray, sigma: numpy.ndarray | None = None, "
              "point: numpy.ndarray | None = None, orientation: numpy.ndarray | None = None) -> None"));
  bind_common(bound, "VelocitySample");
  bound.def_prop_ro(
      "velocity", [](const VelocitySample& v) { return to_array(v.v_mps); }, "(3,), m/s, in the sensor's axes");
  bound.def_prop_ro(
      "sigma", [](const VelocitySample& v) { return to_array(v.sigma_mps); }, "(3,), m/s");
  bound.def_prop_ro(
      "point", [](const VelocitySample& v) { return to_array(v.p_B); }, "(3,), m, in B");
}

void bind_pressure(nb::module_& m) {
  nb::class_<PressureSample> bound(
      m, "PressureSample",
      "A reading of a barometer, for System.push(): pressure and its standard deviation in Pa. ValueError "
      "for one that cannot be.");
  bound.def(
      "__init__",
      [](PressureSample* at, nb::handle t, double pressure, double sigma) {
        new (at) PressureSample(possible(PressureSample{Time{whole_number(t, "t")}, pressure, sigma}));
      },
      "t"_a, "pressure"_a, "sigma"_a = 2.0, nb::sig("def __init__(self, t: int, pressure: float, sigma: float = 2.0) -> None"));
  bind_common(bound, "PressureSample");
  bound.def_ro("pressure", &PressureSample::pressure_pa, "Pa").def_ro("sigma", &PressureSample::sigma_pa, "Pa");
}

}  // namespace

void bind_aiding(nb::module_& m) {
  bind_range(m);
  bind_velocity(m);
  bind_pressure(m);
}

}  // namespace fbvins::python

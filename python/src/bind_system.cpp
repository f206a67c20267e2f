// SPDX-License-Identifier: Apache-2.0
// The odometry fed from Python. Locks: no thread waits for the GIL while it holds a lock of the System, and the GIL is released
// while the System works.
#include <fmt/format.h>

#include <deque>
#include <exception>
#include <mutex>

#include "bindings.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/io/imu_state_file.hpp"
#include "fbvins/pipeline/system.hpp"
#include "images.hpp"
#include "kept.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

std::optional<ImuState> imu_state(const std::string& path, const ImuNoise& imu) {
  return path.empty() ? std::nullopt : value_or_raise(read_imu_state(path, imu));
}

class PySystem {
 public:
  PySystem(const Config& config, const StereoRig& rig, bool threaded, nb::object map, nb::object on_odometry,
           nb::object on_map_update, const std::string& state)
      : rig_(rig), map_(std::move(map)), on_odometry_(std::move(on_odometry)), on_map_update_(std::move(on_map_update)) {
    (void)newly_made_frontends();
    LoopMap* mapper = map_.is_none() ? nullptr : nb::cast<PyMap&>(map_).map.get();
    system_.emplace(value_or_raise(System::create(config, rig, threaded ? RunMode::threaded : RunMode::deterministic,
                                                  {.mapper = mapper, .imu_state = imu_state(state, rig.imu_noise)})));
    frontends_ = newly_made_frontends();
    system_->on_odometry([this](const Odometry& o) { tell(on_odometry_, o, odometry_); });
    if (mapper != nullptr) system_->on_map_update([this](const MapUpdate& u) { tell(on_map_update_, u, updates_); });
  }
  PySystem(const PySystem&) = delete;
  PySystem& operator=(const PySystem&) = delete;
  ~PySystem() {
    nb::gil_scoped_release released;  // ending threads may still call back
    system_.reset();
  }

  void push_imu(nb::handle t, nb::handle gyro, nb::handle accel) {
    if (has_axes(t)) return push_readings(t, gyro, accel);
    const ImuSample sample{Time{whole_number(t, "t")}, vector3(gyro, "gyro"), vector3(accel, "accel")};
    require_order(sample.t, newest_reading_, "reading");
    require_finite(sample.gyro_radps, "gyro", sample.t);
    require_finite(sample.accel_mps2, "accel", sample.t);
    push(sample);
    newest_reading_ = sample.t;
  }
  void push_images(nb::handle t, nb::handle left, nb::handle right, nb::handle depth, const std::vector<nb::object>& more,
                   const std::vector<std::int64_t>& offsets) {
    const Time stamp{whole_number(t, "t")};
    require_order(stamp, newest_image_, "image");
    const int further = std::max(0, rig_.camera_count() - 2);
    if (std::cmp_greater(more.size(), further))
      throw nb::value_error(fmt::format("more: the rig has {} further cameras, not {}", further, more.size()).c_str());
    if (offsets.size() > static_cast<std::size_t>(rig_.camera_count()))
      throw nb::value_error(fmt::format("offsets: the rig has {} cameras, not {}", rig_.camera_count(), offsets.size()).c_str());
    StereoFrame frame{
        stamp, {image_of(left, "left", rig_.left()), image_of(right, "right", rig_.right())}, depth_of(depth, rig_)};
    for (std::size_t i = 0; i < more.size(); ++i) frame.images.push_back(image_of(more[i], "more", rig_.cameras[i + 2].camera));
    if (frame.without_images()) throw nb::value_error("left, right and more are all None: a frame has an image");
    for (std::size_t i = 0; i < offsets.size(); ++i)
      if (offsets[i] != 0) frame.offsets.set(static_cast<int>(i), Duration{offsets[i]});
    push(std::move(frame));
    newest_image_ = stamp;
  }
  void push(SensorEvent event) {
    done([&] { return system_->push(std::move(event)); });
  }
  /// `covariance`: (3, 3), or the standard deviation of each axis.
  void push_position(nb::handle t, nb::handle position, nb::handle covariance, nb::handle point) {
    PositionAnchor anchor{.t = Time{whole_number(t, "t")}, .p_A = vector3(position, "position"), .p_B = point_of(point)};
    if (nb::isinstance<nb::float_>(covariance) || nb::isinstance<nb::int_>(covariance)) {
      const auto sigma_m = nb::cast<double>(covariance);
      anchor.covariance = sigma_m * sigma_m * Mat3::Identity();
    } else {
      const auto given = checked<double>(covariance, "covariance", {3, 3});
      anchor.covariance = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(given.data);
    }
    push_anchor(std::move(anchor));
  }
  void push_height(nb::handle t, double height, double sigma, nb::handle point) {
    push_anchor(HeightAnchor{Time{whole_number(t, "t")}, height, sigma, point_of(point)});
  }
  /// Without a place the tag is a landmark of the map.
  void push_tag(nb::handle t, int id, nb::handle position, nb::handle orientation, nb::handle covariance, nb::handle place,
                nb::handle facing) {
    if (place.is_none() != facing.is_none()) throw nb::value_error("place and place_orientation: both or neither");
    TagAnchor anchor{.t = Time{whole_number(t, "t")},
                     .id = id,
                     .T_AT = unknown_place(),
                     .T_BT = {quaternion(orientation, "orientation"), vector3(position, "position")}};
    if (!place.is_none()) {
      anchor.T_AT = {quaternion(facing, "place_orientation"), vector3(place, "place")};
      if (!anchor.T_AT.p.allFinite()) throw nb::value_error("place: not finite");
    }
    const auto given = checked<double>(covariance, "covariance", {6, 6});
    anchor.covariance = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(given.data);
    push_anchor(std::move(anchor));
  }
  void finish() {
    done([&] { return system_->finish(); });
  }

  std::vector<Odometry> poll() { return take(odometry_); }
  std::vector<MapUpdate> poll_map() { return take(updates_); }
  InputCounts counts() const { return system_->input_counts(); }
  const StereoRig& rig() const { return rig_; }

  /// For Python's cyclic garbage collector.
  int traverse(visitproc visit, void* arg) const {
    for (const nb::object* held : {&map_, &on_odometry_, &on_map_update_}) Py_VISIT(held->ptr());
    for (const std::shared_ptr<Kept>& frontend : frontends_) Py_VISIT(frontend->get().ptr());
    return 0;
  }
  void forget() {
    {
      nb::gil_scoped_release released;
      (void)system_->finish();
    }
    on_odometry_ = on_map_update_ = nb::none();
    for (const std::shared_ptr<Kept>& frontend : frontends_) frontend->reset();
  }

 private:
  static Quat quaternion(nb::handle wxyz, const char* name) {
    const auto q = checked<double>(wxyz, name, {4});
    return {q.data[0], q.data[1], q.data[2], q.data[3]};
  }
  static Vec3 point_of(nb::handle point) { return point.is_none() ? Vec3(Vec3::Zero()) : vector3(point, "point"); }
  void push_anchor(Anchor anchor) {
    if (map_.is_none()) throw nb::value_error("anchors are for a map: System(map=...) has none");
    if (const std::string why = impossible(anchor); !why.empty()) throw nb::value_error(why.c_str());
    done([&] { return system_->push(std::move(anchor)); });
  }
  void push_readings(nb::handle t, nb::handle gyro, nb::handle accel) {
    const auto stamps = checked<std::int64_t>(t, "t", {kAny});
    const auto n = static_cast<std::int64_t>(stamps.rows());
    const auto rates = checked<double>(gyro, "gyro", {n, 3}), forces = checked<double>(accel, "accel", {n, 3});
    std::vector<ImuSample> samples;  // all are looked at before any is taken
    std::optional<Time> newest = newest_reading_;
    for (std::ptrdiff_t i = 0; i < n; ++i) {
      const double *w = rates.data + 3 * i, *f = forces.data + 3 * i;
      samples.push_back({Time{stamps.data[i]}, Vec3(w[0], w[1], w[2]), Vec3(f[0], f[1], f[2])});
      require_order(samples.back().t, newest, "reading");
      require_finite(samples.back().gyro_radps, "gyro", samples.back().t);
      require_finite(samples.back().accel_mps2, "accel", samples.back().t);
      newest = samples.back().t;
    }
    done([&]() -> Result<void> {
      for (const ImuSample& sample : samples)
        if (Result<void> taken = system_->push(sample); !taken) return taken;
      return {};
    });
    newest_reading_ = newest;
  }

  /// Arrays come from a program of somebody's: what is wrong there is said. A recording's events are taken as a sensor's.
  static void require_order(Time t, const std::optional<Time>& newest, const char* what) {
    if (newest && t <= *newest)
      throw nb::value_error(
          fmt::format("t: the stamp {} ns is not after {} ns, that of the {} before", t.ns, newest->ns, what).c_str());
  }
  static void require_finite(const Vec3& v, const char* name, Time t) {
    if (!v.allFinite())
      throw nb::value_error(fmt::format("{}: [{}, {}, {}] at {} ns is not finite", name, v.x(), v.y(), v.z(), t.ns).c_str());
  }

  /// Works without the GIL. Raises the original exception of a callback.
  template <class Work>
  void done(Work work) {
    const Result<void> result = [&] {
      nb::gil_scoped_release released;
      return work();
    }();
    if (result) return;
    if (failure_) std::rethrow_exception(failure_);
    raise(result.error());
  }

  /// On the thread that calls back, without the GIL. Without a callback the values wait for poll().
  template <class T>
  void tell(const nb::object& callback, const T& value, std::deque<T>& waiting) {
    if (callback.is_none()) {
      const std::lock_guard lock(mutex_);
      waiting.push_back(value);
      return;
    }
    const nb::gil_scoped_acquire acquired;
    try {
      callback(value);
    } catch (nb::python_error&) {
      failure_ = std::current_exception();
      throw std::runtime_error("a Python callback raised");
    }
  }
  template <class T>
  std::vector<T> take(std::deque<T>& waiting) {
    const std::lock_guard lock(mutex_);
    std::vector<T> out(waiting.begin(), waiting.end());
    waiting.clear();
    return out;
  }

  StereoRig rig_;
  nb::object map_, on_odometry_, on_map_update_;
  std::vector<std::shared_ptr<Kept>> frontends_;  ///< in Python
  std::mutex mutex_;
  std::deque<Odometry> odometry_;
  std::deque<MapUpdate> updates_;
  std::optional<Time> newest_reading_, newest_image_;  ///< of those that came as arrays
  std::exception_ptr failure_;                         // written and read with the GIL
  std::optional<System> system_;
};

int traverse(PyObject* self, visitproc visit, void* arg) {
#if PY_VERSION_HEX >= 0x03090000
  Py_VISIT(Py_TYPE(self));
#endif
  return nb::inst_ready(self) ? nb::inst_ptr<PySystem>(self)->traverse(visit, arg) : 0;
}
int clear(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<PySystem>(self)->forget();
  return 0;
}
const PyType_Slot kSlots[] = {
    {Py_tp_traverse, reinterpret_cast<void*>(&traverse)}, {Py_tp_clear, reinterpret_cast<void*>(&clear)}, {0, nullptr}};

nb::dict counts_of(const PySystem& system) {
  const InputCounts counts = system.counts();
  nb::dict out;
  out["imu_accepted"] = counts.imu.accepted;
  out["imu_duplicate"] = counts.imu.duplicate;
  out["imu_backward"] = counts.imu.backward;
  out["imu_invalid"] = counts.imu.invalid;
  out["imu_overflow"] = counts.imu.overflow;
  out["images"] = counts.images;
  out["images_backward"] = counts.images_backward;
  out["images_repeated"] = counts.images_repeated;
  return out;
}

/// What ties the map to a building.
void bind_anchors(nb::class_<PySystem>& system) {
  system
      .def(
          "push_position", &PySystem::push_position, "t"_a, "position"_a, "covariance"_a, "point"_a.none() = nb::none(),
          nb::sig("def push_position(self, t: int, position: numpy.ndarray, covariance: float | numpy.ndarray, "
                  "point: numpy.ndarray | None = None) -> None"),
          "For the map: where a point of the body is in the building's frame, measured from outside. t in ns of the cameras' clock, "
          "position (3,) in m, covariance a standard deviation in m or (3, 3) in m^2, point (3,) in m in B, None for its origin. "
          "Best before the next images; one that is late by more than some seconds is not used. ValueError without a map and for "
          "numbers that are impossible.")
      .def("push_height", &PySystem::push_height, "t"_a, "height"_a, "sigma"_a, "point"_a.none() = nb::none(),
           nb::sig("def push_height(self, t: int, height: float, sigma: float, point: numpy.ndarray | None = None) -> None"),
           "The same of a height above z = 0 of the building alone, m.")
      .def(
          "push_tag", &PySystem::push_tag, "t"_a, "id"_a, "position"_a, "orientation"_a, "covariance"_a,
          "place"_a.none() = nb::none(), "place_orientation"_a.none() = nb::none(),
          nb::sig("def push_tag(self, t: int, id: int, position: numpy.ndarray, orientation: numpy.ndarray, "
                  "covariance: numpy.ndarray, place: numpy.ndarray | None = None, "
                  "place_orientation: numpy.ndarray | None = None) -> None"),
          "The same of a tag that a detector of yours saw: position (3,) in m and orientation (4,) w, x, y, z of the tag in B, "
          "covariance (6, 6) of (position in B, rotation in the tag); where it hangs in the building, or None: then it is a landmark, "
          "which says where the vehicle is when it is seen again, in this flight or in another. The tag's frame: origin in its "
          "middle, x to the right and y upwards as a viewer of the upright tag sees it, z towards the viewer.");
}

}  // namespace

void bind_system(nb::module_& m) {
  nb::class_<PySystem> system(m, "System", nb::type_slots(kSlots));
  system
      .def(nb::init<const Config&, const StereoRig&, bool, nb::object, nb::object, nb::object, const std::string&>(), "config"_a,
           "rig"_a, "threaded"_a = false, "map"_a = nb::none(), "on_odometry"_a = nb::none(), "on_map_update"_a = nb::none(),
           "imu_state"_a = "")
      .def(
          "push_imu", &PySystem::push_imu, "t"_a, "gyro"_a, "accel"_a,
          nb::sig("def push_imu(self, t: int | numpy.ndarray, gyro: numpy.ndarray, accel: numpy.ndarray) -> None"),
          "Readings in order of time. One: t in ns, gyro (3,) in rad/s, accel (3,) in m/s^2 (specific force, +g upwards at rest), "
          "both in B. Or many at once: int64 (N,), float64 (N, 3), float64 (N, 3). ValueError for stamps that do not increase and for "
          "numbers that are not finite.")
      .def(
          "push_images", &PySystem::push_images, "t"_a, "left"_a.none(), "right"_a.none() = nb::none(),
          "depth"_a.none() = nb::none(), "more"_a = std::vector<nb::object>{}, "offsets"_a = std::vector<std::int64_t>{},
          nb::sig("def push_images(self, t: int, left: numpy.ndarray | None, right: numpy.ndarray | None = None, "
                  "depth: numpy.ndarray | None = None, more: list[numpy.ndarray | None] = [], offsets: list[int] = []) -> None"),
          "A frame: t in ns of the cameras' clock, images uint8 (height, width) of the rig's size, None where a "
          "camera delivered nothing; more: those of the cameras from number 2 on; offsets: of cameras without a common trigger, how "
          "long after t each took its image, ns; of a rig with a depth sensor depth uint16 (height, width), mm, 0 where nothing was "
          "measured. "
          "Arrays in C order are not copied, and other threads read them later: pass new arrays, do not "
          "write to them afterwards. ValueError for stamps that do not increase.")
      .def(
          "push", [](PySystem& s, const ImuSample& sample) { s.push(sample); }, "event"_a,
          "An event of a Recording, or a reading of your sensor; before the images that follow it.")
      .def(
          "push", [](PySystem& s, const StereoFrame& frame) { s.push(frame); }, "event"_a)
      .def(
          "push", [](PySystem& s, const RangeSample& reading) { s.push(reading); }, "event"_a)
      .def(
          "push", [](PySystem& s, const VelocitySample& reading) { s.push(reading); }, "event"_a)
      .def(
          "push", [](PySystem& s, const PressureSample& reading) { s.push(reading); }, "event"_a)
      .def("finish", &PySystem::finish,
           "Processes all waiting events and ends; afterwards only results already waiting for poll() are left.")
      .def("poll", &PySystem::poll, "The Odometry of all images processed since the last call; empty with on_odometry.")
      .def("poll_map", &PySystem::poll_map, "The MapUpdates since the last call; empty with on_map_update.")
      .def_prop_ro("input_counts", &counts_of, "Numbers of readings and images accepted, and refused by reason.")
      .def_prop_ro("rig", &PySystem::rig)
      .def(
          "__enter__", [](nb::handle self) { return nb::borrow(self); }, nb::sig("def __enter__(self) -> System"))
      .def(
          "__exit__",
          [](PySystem& s, nb::handle type, nb::handle, nb::handle) {
            if (type.is_none()) s.finish();
          },
          "type"_a.none(), "value"_a.none(), "traceback"_a.none());
  bind_anchors(system);
  system.attr("__doc__") =
      "Stereo visual-inertial odometry, fed by push_imu() and push_images() in order of time. One thread at a time may push. "
      "threaded: frontend, estimator and map run on threads of their own; same results. A callback is called with each Odometry "
      "(MapUpdate) on the thread that computed it; its exception is raised by a later push or finish(). In a `with`, "
      "finish() is called at the end.";
}

}  // namespace fbvins::python

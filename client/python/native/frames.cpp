// Coded frames of streams and recordings, as arrays.
#include "pneuma_client/frames.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "messages.h"
#include "module.h"

namespace pneuma::python {

namespace py = pybind11;

namespace {

/// (N, 3) of the numbers of all bodies, one after the other.
py::array_t<float> joined(const client::DecodedFrame& frame, std::vector<double> client::SoftBodyFrame::* numbers) {
  std::size_t count = 0;
  for (const client::SoftBodyFrame& body : frame.bodies) count += (body.*numbers).size();
  py::array_t<float> all({static_cast<py::ssize_t>(count / 3), py::ssize_t{3}});
  float* out = all.mutable_data();
  for (const client::SoftBodyFrame& body : frame.bodies) {
    for (const double number : body.*numbers) *out++ = static_cast<float>(number);
  }
  return all;
}

/// (solids, 7): x y z of the place, w x y z of the orientation.
py::array_t<double> poses_of(const client::DecodedFrame& frame) {
  py::array_t<double> poses({static_cast<py::ssize_t>(frame.solids.size()), py::ssize_t{7}});
  double* out = poses.mutable_data();
  for (const client::SolidFrame& solid : frame.solids) {
    for (const double number : {solid.position.x(), solid.position.y(), solid.position.z(), solid.orientation.w(),
                                solid.orientation.x(), solid.orientation.y(), solid.orientation.z()}) {
      *out++ = number;
    }
  }
  return poses;
}

/// The streams of a connection, or the one of a recording. Of one thread.
class Decoder {
 public:
  void stream(std::string_view subscribed) { check(decoder_.add_stream(parsed<v1::Subscribed>(subscribed))); }
  void topology(std::string_view topology) { check(decoder_.take_topology(parsed<v1::Topology>(topology))); }
  void layout(std::string_view layout) { check(decoder_.take_layout(parsed<v1::Layout>(layout))); }

  /// (time_s, positions, velocities or None, poses); None of a frame that is to be passed over.
  py::object frame(std::string_view bytes) {
    const auto message = parsed<v1::Frame>(bytes);
    base::Result<std::optional<client::DecodedFrame>> taken = take(message, bytes.size());
    const std::optional<client::DecodedFrame> frame = checked(std::move(taken));
    if (!frame) return py::none();
    const auto velocities = &client::SoftBodyFrame::velocities_m_s;
    return py::make_tuple(frame->time_s, joined(*frame, &client::SoftBodyFrame::positions_m),
                          frame->has_velocities ? py::object(joined(*frame, velocities)) : py::none(),
                          poses_of(*frame));
  }
  [[nodiscard]] bool waits_for_key(std::uint32_t stream_id) const { return decoder_.waits_for_key(stream_id); }

 private:
  base::Result<std::optional<client::DecodedFrame>> take(const v1::Frame& message, std::size_t bytes) {
    const py::gil_scoped_release others_run;
    return decoder_.take_frame(message, bytes);
  }

  client::StreamDecoder decoder_;
};

}  // namespace

void add_frames(py::module_& module) {
  using py::literals::operator""_a;
  py::class_<Decoder>(module, "Decoder")
      .def(py::init<>())
      .def("stream", &Decoder::stream, "subscribed"_a)
      .def("topology", &Decoder::topology, "topology"_a)
      .def("layout", &Decoder::layout, "layout"_a)
      .def("frame", &Decoder::frame, "frame"_a)
      .def("waits_for_key", &Decoder::waits_for_key, "stream_id"_a);
}

}  // namespace pneuma::python

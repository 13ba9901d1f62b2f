// Files of recordings: the messages of a stream, as bytes.
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "messages.h"
#include "module.h"
#include "pneuma_client/recording.h"

namespace pneuma::python {

namespace py = pybind11;

namespace {

class Reader {
 public:
  explicit Reader(const std::string& path) : reader_(checked(client::RecordingReader::open(path))) {}

  [[nodiscard]] py::bytes header() const { return serialised(reader_.header()); }
  /// Why the file ends before its end; empty where it is whole.
  [[nodiscard]] std::string damage() const { return reader_.damage().ok() ? "" : reader_.damage().message(); }
  /// The next ServerMessage; None at the end.
  std::optional<py::bytes> next() {
    const auto record = checked(reader_.next());
    if (!record) return std::nullopt;
    return serialised(record->message);
  }

 private:
  client::RecordingReader reader_;
};

class Writer {
 public:
  Writer(const std::string& path, std::string_view header, bool replace)
      : writer_(checked(client::RecordingWriter::create(
            path, parsed<v1::RecordingHeader>(header),
            replace ? client::RecordingWriter::IfThere::replace : client::RecordingWriter::IfThere::refuse))) {}

  void append(std::string_view message) { check(writer_.append(message, parsed<v1::ServerMessage>(message))); }
  void flush() { check(writer_.flush()); }
  void finish() { check(writer_.finish()); }

 private:
  client::RecordingWriter writer_;
};

}  // namespace

void add_recordings(py::module_& module) {
  using py::literals::operator""_a;
  py::class_<Reader>(module, "RecordingReader")
      .def(py::init<const std::string&>(), "path"_a)
      .def_property_readonly("header", &Reader::header)
      .def_property_readonly("damage", &Reader::damage)
      .def("next", &Reader::next);
  py::class_<Writer>(module, "RecordingWriter")
      .def(py::init<const std::string&, std::string_view, bool>(), "path"_a, "header"_a, "replace"_a)
      .def("append", &Writer::append, "message"_a)
      .def("flush", &Writer::flush)
      .def("finish", &Writer::finish);
}

}  // namespace pneuma::python

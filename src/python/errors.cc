// SPDX-License-Identifier: Apache-2.0
#include "python/errors.h"

namespace truetriad::python {
namespace py = pybind11;

void Raise(const Error& error) {
  const char* name = error.kind() == ErrorKind::kUsage      ? "Usage"
                     : error.kind() == ErrorKind::kBadInput ? "BadInput"
                                                            : "NotEnough";
  const py::object type = py::module_::import("truetriad").attr(name);
  const py::object exception = type(Printable(error.message));
  const FilePlace& place = error.place;
  exception.attr("code") = InfoOf(error.code).name;
  exception.attr("message") = Printable(error.message);
  exception.attr("file") = place.file.empty() ? py::none() : py::object(NameOrText(place.file));
  exception.attr("line") = place.line > 0 ? py::object(py::int_(place.line)) : py::none();
  exception.attr("column") = place.column > 0 ? py::object(py::int_(place.column)) : py::none();
  PyErr_SetObject(type.ptr(), exception.ptr());
  throw py::error_already_set();
}

ProgressCallback ProgressOf(const py::object& progress) {
  using Clock = std::chrono::steady_clock;
  // The caller's frame holds a reference to the callable while the work runs.
  return [callable = progress.ptr(), next = Clock::now()](double share) mutable {
    constexpr auto kPause = std::chrono::milliseconds(50);  // 20 calls/s.
    const auto now = Clock::now();
    if (now < next) return;
    next = now + kPause;
    const py::gil_scoped_acquire acquired;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (callable != Py_None) py::reinterpret_borrow<py::object>(callable)(share);
  };
}

}  // namespace truetriad::python

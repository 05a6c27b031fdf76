// SPDX-License-Identifier: Apache-2.0
#include "python/numbers.h"

#include <limits>

#include "python/errors.h"

namespace truetriad::python {
namespace py = pybind11;
namespace {

[[noreturn]] void RaiseNoNumbers(const std::string& what, const std::string& found) {
  Raise(Error(ErrorCode::kInvalidArgument,
              what + ": " + found + "; expected an array of integers or real numbers"));
}

}  // namespace

Doubles NumbersOf(const py::handle& values, const std::string& what) {
  py::object stated = py::reinterpret_borrow<py::object>(values);
  const bool is_masked = py::hasattr(stated, "filled") && py::hasattr(stated, "mask");
  if (!is_masked && py::isinstance<Doubles>(stated)) return py::reinterpret_borrow<Doubles>(stated);

  std::string refused;
  try {
    const py::dtype type = py::array(stated).dtype();
    if (std::string("iufO").find(type.kind()) == std::string::npos) {
      refused = "the values are of the type " + std::string(py::str(py::handle(type)));
    } else {
      if (is_masked) {
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        stated = stated.attr("astype")("float64").attr("filled")(kNone);
      }
      return Doubles(stated);
    }
  } catch (const py::error_already_set& failure) {
    refused = py::str(failure.value());
  }
  RaiseNoNumbers(what, refused);
}

}  // namespace truetriad::python

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <pybind11/numpy.h>

namespace truetriad::python {

using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// A C-contiguous float64 array of integers or reals; the same object if it already is one. Masked
/// values become NaN. Raises Usage for other types (texts, booleans, complex, dates), which NumPy
/// would convert silently. `what` is the name in the message.
Doubles NumbersOf(const pybind11::handle& values, const std::string& what);

}  // namespace truetriad::python

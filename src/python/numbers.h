// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <pybind11/numpy.h>

namespace truetriad::python {

using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// A C-contiguous float64 array of integers or reals; the very one where it is that already. What
/// is masked becomes NaN. Raises Usage for what is no number (texts, booleans, complex, dates):
/// NumPy would convert these in silence. `what` names it in the message.
Doubles NumbersOf(const pybind11::handle& values, const std::string& what);

}  // namespace truetriad::python

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad::python {

/// Raises truetriad.Usage, BadInput or NotEnough, with code, message, file, line and column.
[[noreturn]] void Raise(const Error& error);

/// Of text that may hold the bytes of a file's name that are no UTF-8: these print as U+FFFD.
inline pybind11::str Printable(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
}

/// The same as Python holds names of files, from which os.fsencode() makes the bytes again.
inline pybind11::str NameOrText(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape"));
}

/// The value; raises its error.
template <typename T>
T ValueOf(Result<T> result) {
  if (!result) Raise(result.error());
  return *std::move(result);
}
inline void Check(const Status& status) {
  if (!status) Raise(status.error());
}

/// Runs what takes long while other threads of Python go on.
template <typename Work>
auto WithoutGil(const Work& work) {
  const pybind11::gil_scoped_release released;
  return work();
}

/// Calls `progress`, None or a callable, with the share that is done, and looks for Ctrl-C: a few
/// times a second, since taking the interpreter's lock costs. What either raises ends the work.
ProgressCallback ProgressOf(const pybind11::object& progress);

}  // namespace truetriad::python

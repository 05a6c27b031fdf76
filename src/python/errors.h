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

/// Text that may hold a file name that is not UTF-8: invalid bytes become U+FFFD.
inline pybind11::str Printable(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
}

/// Like Printable, but in Python's representation of file names: os.fsencode() restores the bytes.
inline pybind11::str NameOrText(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape"));
}

/// Returns the value, or raises the error.
template <typename T>
T ValueOf(Result<T> result) {
  if (!result) Raise(result.error());
  return *std::move(result);
}
inline void Check(const Status& status) {
  if (!status) Raise(status.error());
}

/// Runs `work` without the interpreter's lock, so that other Python threads can run meanwhile.
template <typename Work>
auto WithoutGil(const Work& work) {
  const pybind11::gil_scoped_release released;
  return work();
}

/// Calls `progress`, None or a callable, with the share done, and checks for Ctrl-C. The lock is
/// taken at most 20 times a second, since taking it is slow. An exception of the callable or from
/// Ctrl-C ends the work.
ProgressCallback ProgressOf(const pybind11::object& progress);

}  // namespace truetriad::python

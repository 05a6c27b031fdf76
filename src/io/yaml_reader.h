// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <yaml-cpp/yaml.h>

#include "truetriad/base/result.h"

namespace truetriad {

/// One value of a YAML file, read strictly: unknown and duplicate keys, missing keys and wrong
/// types are errors with file:line and the key's full name.
///
///   YamlReader yaml = *YamlReader::FromFile(path);
///   yaml.Require("unit", &unit);
///   yaml.Optional("rate_hz", &rate_hz);
///   YamlReader time = yaml.Child("time");   // and so on
///   yaml.RejectUnknown();
///   TRUETRIAD_RETURN_IF_ERROR(yaml.status());
///
/// Errors are collected, so that users see all of them at once: a read that fails leaves its value
/// unchanged, and `status()` of any reader of the file lists the errors.
class YamlReader {
 public:
  /// Error: the file is unreadable, is not YAML, or has a duplicate key anywhere.
  static Result<YamlReader> FromFile(const std::string& path);
  /// `name` replaces the file's name in messages.
  static Result<YamlReader> FromText(const std::string& text, const std::string& name);

  /// Reads the value of `key`. Returns false and records an error if the value is missing or wrong.
  template <typename T>
  bool Require(std::string_view key, T* value) {
    return RequireChild(key).Read(value);
  }

  /// Reads the value of `key` if the key is present. Returns true if the value was read; a wrong
  /// value is an error.
  template <typename T>
  bool Optional(std::string_view key, T* value) {
    YamlReader child = Child(key);
    return child && child.Read(value);
  }

  /// The value of `key`. If there is none, the result is false in a condition.
  YamlReader Child(std::string_view key);
  /// Like Child, but a missing key is recorded as an error.
  YamlReader RequireChild(std::string_view key);

  /// Reads this value itself, as a text, a finite number, an integer, true/false, or a list of
  /// numbers. False if there is no value, or if the value is something else, which is an error.
  bool Read(std::string* value);
  bool Read(double* value);
  bool Read(std::int64_t* value);
  bool Read(int* value);
  bool Read(bool* value);
  bool Read(std::vector<double>* value);
  bool Read(Eigen::Vector3d* value);

  /// Reads a text of one line with at most `longest` characters, such as a serial number or a lot.
  bool ReadName(std::string* value, std::size_t longest = kLongestName);
  static constexpr std::size_t kLongestName = 200;  ///< Characters; more do not fit a line.

  /// The items of a list; the keys of a map. If the value is something else, the result is empty
  /// and an error is recorded.
  std::vector<YamlReader> Items();
  std::vector<std::string> Keys();

  /// Records an error for each key of this map that was not asked for.
  void RejectUnknown();

  /// An error that states the line and the name of this value.
  Error ErrorHere(ErrorCode code, const std::string& message) const;
  /// Records an error that states the line and the name of this value.
  void Fail(const std::string& message, ErrorCode code = ErrorCode::kInvalidValue);
  /// "file:line: streams.gyroscope.unit: ", for messages.
  std::string Place() const;

  /// All errors of the file so far: status() joins them into one, errors() lists them.
  Status status() const;
  const std::vector<Error>& errors() const { return shared_->errors; }

  explicit operator bool() const { return present_; }
  bool IsMap() const { return present_ && node_.IsMap(); }
  bool IsSequence() const { return present_ && node_.IsSequence(); }
  bool IsScalar() const { return present_ && node_.IsScalar(); }
  int line() const { return node_.Mark().line + 1; }
  const std::string& file() const { return shared_->file; }
  /// "streams.gyroscope.unit"; empty for the whole file.
  const std::string& name() const { return name_; }

 private:
  struct Shared {
    std::string file;
    std::vector<Error> errors;
  };

  YamlReader(const YAML::Node& node,
             bool present,
             std::string name,
             std::shared_ptr<Shared> shared);
  void RejectDuplicates(std::set<int>* visited, std::set<int>* ancestors);
  bool ReadScalar(std::string_view expected, std::string* text);

  YAML::Node node_;  ///< The value; if there is none, its parent, for the line number.
  bool present_ = true;
  std::string name_;
  std::shared_ptr<Shared> shared_;
  std::set<std::string, std::less<>> asked_;
};

/// Reads a small file as text and guards it as an input. Error: it is missing, unreadable, a
/// folder, or too large for a file written by hand.
Result<std::string> ReadSmallFile(const std::string& path);
/// Like ReadSmallFile, but the file is not guarded: it may be overwritten.
Result<std::string> LookAtSmallFile(const std::string& path);

}  // namespace truetriad

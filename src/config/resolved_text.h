// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include "config/yaml_values.h"
#include "io/yaml_text.h"

namespace truetriad {

/// Writes nested maps, one key a line, and marks the lines that no document asked for.
class ResolvedText {
 public:
  explicit ResolvedText(const std::set<std::string>& given) : given_(given) {}

  void Open(std::string_view key) {
    Indent() << key << ":\n";
    path_ += std::string(key) + ".";
    ++depth_;
  }

  void Close() {
    path_.erase(path_.rfind('.', path_.size() - 2) + 1);
    --depth_;
  }

  /// One line; the value is all `parts` one after another.
  template <typename... Parts>
  void Line(std::string_view key, const Parts&... parts) {
    Indent() << key << ": ";
    (text_ << ... << parts);
    text_ << (given_.contains(path_ + std::string(key)) ? "\n" : "  # default\n");
  }

  /// A value that took the place of `auto`.
  void ChosenLine(std::string_view key, std::string_view value) {
    Indent() << key << ": " << value << "  # chosen by auto\n";
  }

  void Line(std::string_view key, const Stated& stated) {
    if (!stated.value) {
      Line(key, "unknown");
    } else if (stated.sigma) {
      Line(key, "{ value: ", *stated.value, ", sigma: ", *stated.sigma, " }");
    } else {
      Line(key, *stated.value);
    }
  }

  const std::string& str() const { return text_.str(); }

 private:
  YamlText& Indent() { return text_ << std::string(2 * depth_, ' '); }

  const std::set<std::string>& given_;
  YamlText text_;
  std::string path_;  ///< "sensors.accelerometer."
  std::size_t depth_ = 0;
};

}  // namespace truetriad

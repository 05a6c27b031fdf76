// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <concepts>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace truetriad {

/// Free text for a YAML file: double-quoted and escaped, so that no content is read as structure, a
/// number or a truth value. YAML cannot hold bytes that are not UTF-8; they are written in the form
/// \xFF.
struct Quoted {
  std::string_view text;
};

/// Writes YAML text without yaml-cpp's emitter, which would raise the cost of a whole calibration
/// by half (for configs/experiments/joint.yaml, from 124 to 189 million instructions). Numbers do
/// not depend on the locale; NaN is `.nan`; vectors and matrices are flow lists of rows.
class YamlText {
 public:
  /// `digits`: significant digits of every number; 0: the fewest that read back to the same bits.
  explicit YamlText(int digits = 0) : digits_(digits) {}

  YamlText& operator<<(std::string_view text) {
    text_ += text;
    return *this;
  }

  template <std::integral T>
  YamlText& operator<<(T value) {
    if constexpr (std::same_as<T, bool>) {
      return *this << std::string_view(value ? "true" : "false");
    } else {
      return *this << std::string_view(std::to_string(value));
    }
  }

  YamlText& operator<<(double number) {
    if (std::isnan(number)) return *this << ".nan";
    if (std::isinf(number)) return *this << (number > 0.0 ? ".inf" : "-.inf");
    char buffer[40];
    char* const end = buffer + sizeof buffer;
    const auto written =
        digits_ == 0 ? std::to_chars(buffer, end, number)
                     : std::to_chars(buffer, end, number, std::chars_format::general, digits_);
    return *this << std::string_view(buffer, written.ptr);
  }

  YamlText& operator<<(Quoted quoted);

  template <typename Derived>
  YamlText& operator<<(const Eigen::MatrixBase<Derived>& matrix) {
    constexpr bool kIsVector = Derived::ColsAtCompileTime == 1;
    *this << "[";
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      if (row > 0) *this << ", ";
      if constexpr (kIsVector) {
        *this << matrix(row);
      } else {
        *this << matrix.row(row).transpose();
      }
    }
    return *this << "]";
  }

  const std::string& str() const { return text_; }

 private:
  int digits_;
  std::string text_;
};

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace truetriad {

// Numbers as people read them. Independent of the locale, so the same input gives the same bytes.
// NaN is "n/a" and infinities are "∞" everywhere; a rounded zero has no minus sign.

/// `decimals` digits after the point. Range: 0…17.
std::string Fixed(double value, int decimals);

/// `digits` significant digits, in scientific notation when very large or small. Range: 1…17.
std::string Significant(double value, int digits);

/// "1.2345 ± 0.0012": σ to two digits and the value to the same place, as
/// "(1.2345 ± 0.0012)e-9" when there would be more than eight decimals. Without a σ (zero or NaN)
/// the value alone, to six significant digits.
std::string WithSigma(double value, double sigma);

/// Of a table the cells of three axes, and that of a value which may be missing: "–".
using ThreeCells = std::array<std::string, 3>;
ThreeCells Fixed(const Eigen::Vector3d& values, int decimals);
ThreeCells Significant(const Eigen::Vector3d& values, int digits);
ThreeCells WithSigma(const Eigen::Vector3d& values, const Eigen::Vector3d& sigmas);
std::string Significant(const std::optional<double>& value, int digits);

/// The cells with words between them: "0.12, 0.34, 0.56".
std::string Joined(const ThreeCells& cells, std::string_view between = ", ");

/// A share as "12.3 %", three significant digits.
std::string Percent(double share);

/// "0.25", "< 1e-6": what is below one in a million nobody counts.
std::string Probability(double p);

/// "m/s^2" -> "m/s²", "uT/degC" -> "µT/°C", "tau^1" -> "τ¹"; any other unit as it is.
std::string DisplayUnit(std::string_view unit);

}  // namespace truetriad

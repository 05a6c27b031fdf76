// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string_view>

#include <GeographicLib/MagneticModel.hpp>
#include <GeographicLib/NormalGravity.hpp>

#include "base/companion.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

constexpr const char* kModelName = "wmm2025";
// Years for which the model is issued.
constexpr double kFirstYear = 2025.0;
constexpr double kLastYear = 2030.0;  // A model is issued for five years.

// σ of the World Magnetic Model 2025, averaged over the globe and five years: dF, dI and dD =
// hypot(0.26, 5417 nT / H) in the chapter "error model" of its technical report.
constexpr double kStrengthSigmaUt = 0.138;
constexpr double kDipSigmaDeg = 0.20;             // dI.
constexpr double kDeclinationSigmaDeg = 0.26;     // dD far from the poles.
constexpr double kDeclinationSigmaDegUt = 5.417;  // To be divided by the horizontal strength H.

// 1 nT = 1e-3 uT.
constexpr double kUtPerNt = 1e-3;

// The number in characters [begin, end) of `text`; nullopt if one of them is not a digit.
std::optional<int> Digits(std::string_view text, std::size_t begin, std::size_t end) {
  const std::string_view digits = text.substr(begin, end - begin);
  if (digits.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  int value = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return value;
}

}  // namespace

double NormalGravityMps2(double latitude_deg, double height_m) {
  double y = 0.0;
  double z = 0.0;
  // The return value is the potential, not gravity.
  GeographicLib::NormalGravity::WGS84().Gravity(latitude_deg, height_m, y, z);
  return std::hypot(y, z);
}

Result<double> DecimalYear(const std::string& date) {
  namespace chrono = std::chrono;
  const Error error =
      Error(ErrorCode::kInvalidValue, "`" + date + "` is not a date; expected one like 2026-01-31");
  if (date.size() != 10 || date[4] != '-' || date[7] != '-') return error;
  const std::optional<int> year = Digits(date, 0, 4);
  const std::optional<int> month = Digits(date, 5, 7);
  const std::optional<int> day = Digits(date, 8, 10);
  if (!year || !month || !day) return error;
  const chrono::year_month_day ymd{chrono::year(*year),
                                   chrono::month(static_cast<unsigned>(*month)),
                                   chrono::day(static_cast<unsigned>(*day))};
  if (!ymd.ok()) return error;
  const auto first_of = [](int y) {
    return chrono::sys_days(chrono::year(y) / chrono::January / 1);
  };
  const double days = static_cast<double>((chrono::sys_days(ymd) - first_of(*year)).count());
  return *year + days / static_cast<double>((first_of(*year + 1) - first_of(*year)).count());
}

Result<EarthField> WorldMagneticModel(const EarthPlace& place, double year) {
  // The condition is written so that NaN is refused as well.
  if (!(year >= kFirstYear && year <= kLastYear)) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", year);
    return Error(ErrorCode::kValueOutOfRange,
                 "the World Magnetic Model 2025 is valid from 2025.0 to 2030.0, not in " +
                     std::string(text));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string file,
                             FindSharedFile("magnetic/" + std::string(kModelName) + ".wmm"));
  double east_nt = 0.0;
  double north_nt = 0.0;
  double up_nt = 0.0;
  try {
    const GeographicLib::MagneticModel model(kModelName,
                                             std::filesystem::path(file).parent_path().string());
    model(year, place.latitude_deg, place.longitude_deg, place.height_m, east_nt, north_nt, up_nt);
  } catch (const std::exception& failure) {
    return Error(ErrorCode::kBrokenInstallation,
                 {file},
                 std::string("the World Magnetic Model cannot be read (") + failure.what() +
                     "); reinstall truetriad");
  }
  double horizontal_nt = 0.0;
  double strength_nt = 0.0;
  EarthField field;
  GeographicLib::MagneticModel::FieldComponents(
      east_nt, north_nt, up_nt, horizontal_nt, strength_nt, field.declination_deg, field.dip_deg);
  field.strength_ut = strength_nt * kUtPerNt;
  field.strength_sigma_ut = kStrengthSigmaUt;
  field.dip_sigma_deg = kDipSigmaDeg;
  field.declination_sigma_deg =
      std::hypot(kDeclinationSigmaDeg, kDeclinationSigmaDegUt / (horizontal_nt * kUtPerNt));
  return field;
}

}  // namespace truetriad

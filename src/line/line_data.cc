// SPDX-License-Identifier: Apache-2.0
#include "line/line_data.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "math/distributions.h"

namespace truetriad::line {

Estimate ShareOf(int count, int all, double confidence) {
  if (all <= 0) return {};
  const double n = all, share = count / n;
  const double z = NormalQuantile(0.5 * (1.0 + confidence));
  const double center = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half =
      z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n);
  return {share, {std::max(0.0, center - half), std::min(1.0, center + half)}};
}

const std::string& TagOf(const UnitRecord& unit, const std::string& name) {
  static const std::string kNone;
  const auto at = unit.tags.find(name);
  return at == unit.tags.end() ? kNone : at->second;
}

double SecondsOf(const std::string& moment) {
  std::tm stated{};
  const char* rest = strptime(moment.c_str(), "%Y-%m-%d", &stated);
  if (rest == nullptr || std::isdigit(static_cast<unsigned char>(moment[0])) == 0) return kNotKnown;
  double fraction = 0.0;
  std::int64_t offset_s = 0;
  if (*rest == 'T' || *rest == ' ') {
    rest = strptime(rest + 1, "%H:%M", &stated);
    if (rest != nullptr && *rest == ':') rest = strptime(rest + 1, "%S", &stated);
    if (rest != nullptr && *rest == '.') {
      char* end = nullptr;
      fraction = std::strtod(rest, &end);
      rest = end;
    }
    if (rest != nullptr && *rest != '\0') {
      std::tm zone{};  // Receives only the offset from strptime.
      rest = strptime(rest, "%z", &zone);
      offset_s = zone.tm_gmtoff;
    }
  }
  if (rest == nullptr || *rest != '\0') return kNotKnown;
  const int day = stated.tm_mday;
  stated.tm_isdst = 0;
  const auto seconds = static_cast<double>(timegm(&stated) - offset_s) + fraction;
  // If the day does not exist, timegm has changed it: a 30th of February to the 2nd of March.
  return stated.tm_mday == day && seconds >= 0.0 ? seconds : kNotKnown;
}

std::string MomentOf(std::int64_t seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

}  // namespace truetriad::line

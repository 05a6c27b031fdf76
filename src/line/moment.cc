// SPDX-License-Identifier: Apache-2.0
#include "line/moment.h"

#include <cstdio>
#include <ctime>

#include "line/interval.h"

namespace truetriad::line {

double SecondsOf(const std::string& moment) {
  std::tm utc{};
  double seconds = 0.0;
  const int fields = std::sscanf(moment.c_str(),
                                 "%4d-%2d-%2dT%2d:%2d:%lf",
                                 &utc.tm_year,
                                 &utc.tm_mon,
                                 &utc.tm_mday,
                                 &utc.tm_hour,
                                 &utc.tm_min,
                                 &seconds);
  if (fields != 3 && fields != 6) return kNotKnown;
  utc.tm_year -= 1900;
  utc.tm_mon -= 1;
  return static_cast<double>(timegm(&utc)) + seconds;
}

}  // namespace truetriad::line

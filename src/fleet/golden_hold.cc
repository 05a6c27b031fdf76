// SPDX-License-Identifier: Apache-2.0
#include "fleet/golden_hold.h"

#include <array>
#include <cstdio>
#include <ctime>

#include "line/golden_history.h"
#include "line/line_data.h"
#include "truetriad/config/experiment.h"

namespace truetriad::fleet {
namespace {

constexpr double kHourS = 3600.0;

std::string HoursText(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f h", seconds / kHourS);
  return text.data();
}

}  // namespace

Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s) {
  const std::string remedy =
      "; measure it and run check-station with --store and --tag=station=" + station;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<StationCheck> check,
                             store.LastStationCheck(station));
  if (!check) {
    return std::optional("station " + station + " has no check of its golden unit" + remedy);
  }
  if (!check->agrees) {
    return std::optional("station " + station + " did not agree with its golden unit at " +
                         check->created + remedy);
  }
  // NaN: what cannot be dated is no check of today.
  const double old_s = static_cast<double>(std::time(nullptr)) - line::SecondsOf(check->created);
  if (old_s < -line::kClocksDifferS) {
    return std::optional("station " + station + " has a check of its golden unit at " +
                         check->created + ", which is " + HoursText(-old_s) +
                         " from now: a clock is or was wrong" + remedy);
  }
  if (old_s <= age_s) return std::optional<std::string>();
  return std::optional("station " + station + " was checked with its golden unit at " +
                       check->created + ", " + HoursText(age_s) + " ago or more" + remedy);
}

Result<std::string> StationOf(const WorkPlan& plan) {
  // Without an experiment the tags alone are overrides of one that anything can be said of.
  const std::string any = "experiment: 1\nsensors: { accelerometer: {} }\n";
  const bool is_given = !plan.config_text.empty();
  std::vector<std::string> overrides;
  for (const std::string& item : plan.overrides) {
    if (is_given || item.starts_with("run.station=")) overrides.push_back(item);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Experiment experiment,
      ReadExperimentText(is_given ? plan.config_text : any, plan.config_path, overrides));
  if (!experiment.tags.station.empty()) return experiment.tags.station;
  return Error(ErrorCode::kMissingArgument,
               "no station is named whose golden unit is to be required; give --tag=station=NAME");
}

}  // namespace truetriad::fleet

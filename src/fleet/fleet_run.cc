// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <array>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "fleet/log_files.h"
#include "line/golden_history.h"
#include "line/line_data.h"

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

namespace {

/// Units that are known beforehand, in their order.
class ListedUnits : public OrderSource {
 public:
  explicit ListedUnits(std::vector<UnitOrder> units) : units_(std::move(units)) {}

  std::optional<Arrival> Next() override {
    if (next_ == units_.size()) return std::nullopt;
    return Arrival{std::move(units_[next_++])};
  }
  bool HasEnded() const override { return next_ == units_.size(); }

 private:
  std::vector<UnitOrder> units_;
  std::size_t next_ = 0;
};

}  // namespace

Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string config_sha256, ConfigSha256(options.plan));
  FleetProgress progress;
  if (options.resumes) {
    TRUETRIAD_ASSIGN_OR_RETURN(const DoneLogs done, DoneLogs::In(store, config_sha256));
    progress.skipped = std::erase_if(units, [&](const UnitOrder& unit) { return done.Has(unit); });
  }
  progress.units = units.size();
  ListedUnits source(std::move(units));
  TRUETRIAD_ASSIGN_OR_RETURN(progress,
                             FleetEngine(options, config_sha256, &source, &store, listener)
                                 .Run(std::move(progress), is_stopped));
  if (!progress.is_stopped) TRUETRIAD_RETURN_IF_ERROR(store.MarkEnd());
  return progress;
}

Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string config_sha256, ConfigSha256(options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(DoneLogs done, DoneLogs::In(store, config_sha256));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<LogWatch> source,
                             LogWatch::Open(watched, std::move(done), [&](const std::string& note) {
                               if (listener.on_note) listener.on_note(note);
                             }));
  FleetOptions patient = options;
  patient.is_patient = true;
  TRUETRIAD_ASSIGN_OR_RETURN(
      FleetProgress progress,
      FleetEngine(patient, config_sha256, source.get(), &store, listener).Run({}, is_stopped));
  // A watch ends when it is told to.
  TRUETRIAD_RETURN_IF_ERROR(store.MarkEnd());
  return progress;
}

}  // namespace truetriad::fleet

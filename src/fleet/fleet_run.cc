// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <optional>
#include <string>
#include <utility>

#include "fleet/done_logs.h"

namespace truetriad::fleet {
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

}  // namespace truetriad::fleet

// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_watch.h"

#include <memory>
#include <string>
#include <utility>

#include "fleet/done_logs.h"

namespace truetriad::fleet {

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

// SPDX-License-Identifier: Apache-2.0
#include "fleet/done_logs.h"

#include <functional>
#include <optional>
#include <vector>

#include "truetriad/base/version.h"

namespace truetriad::fleet {
namespace {

std::size_t HashOf(const LogStamp& stamp) {
  return std::hash<std::string>()(std::to_string(stamp.bytes) + "," +
                                  std::to_string(stamp.modified_ns));
}

}  // namespace

Result<DoneLogs> DoneLogs::In(Store& store, const std::string& config_sha256) {
  DoneLogs done;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<KnownRun> runs, store.LastRuns());
  for (const KnownRun& run : runs) {
    if (run.config_sha256 != config_sha256 || run.software_version != Version()) continue;
    done.Add(run.log, {run.log_bytes, run.log_modified_ns});
  }
  return done;
}

void DoneLogs::Add(const std::string& log, const LogStamp& stamp) {
  stamps_[std::hash<std::string>()(log)] = HashOf(stamp);
}

bool DoneLogs::Has(const std::string& log, const LogStamp& stamp) const {
  const auto found = stamps_.find(std::hash<std::string>()(log));
  return found != stamps_.end() && found->second == HashOf(stamp);
}

bool DoneLogs::Has(const std::string& log) const {
  const std::optional<LogStamp> stamp = StampOf(log);
  return stamp && Has(log, *stamp);
}

}  // namespace truetriad::fleet

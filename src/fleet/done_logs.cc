// SPDX-License-Identifier: Apache-2.0
#include "fleet/done_logs.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "truetriad/base/error.h"
#include "truetriad/base/version.h"
#include "truetriad/model/tags.h"

namespace truetriad::fleet {
namespace {

std::size_t HashOf(const LogStamp& stamp) {
  return std::hash<std::string>()(std::to_string(stamp.bytes) + "," +
                                  std::to_string(stamp.modified_ns));
}

std::size_t HashOf(const std::string& text) { return std::hash<std::string>()(text); }

/// Of each tag that is stated, and of the time of measurement.
std::vector<std::size_t> HashesOf(const Tags& tags, const std::string& recorded) {
  std::vector<std::size_t> hashes;
  if (!recorded.empty()) hashes.push_back(HashOf("recorded=" + recorded));
  const auto add = [&](const TagKey& tag) {
    const std::string& value = tags.*tag.value;
    if (!value.empty()) hashes.push_back(HashOf(std::string(tag.key) + "=" + value));
  };
  for (const TagKey& tag : kDeviceTags) add(tag);
  for (const TagKey& tag : kRunTags) add(tag);
  return hashes;
}

}  // namespace

Result<DoneLogs> DoneLogs::In(Store& store, const std::string& config_sha256) {
  DoneLogs done;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<KnownRun> runs, store.LastRuns());
  for (const KnownRun& run : runs) {
    if (run.config_sha256 != config_sha256 || run.software_version != Version()) continue;
    // The other log may have been taken away, as the refusal advises.
    if (run.code == InfoOf(ErrorCode::kOtherDevice).name) continue;
    done.Add(run.log, {run.log_bytes, run.log_modified_ns}, run.serial, run.tags, run.recorded);
  }
  return done;
}

void DoneLogs::Add(const std::string& log,
                   const LogStamp& stamp,
                   const std::string& serial,
                   const Tags& tags,
                   const std::string& recorded) {
  logs_[HashOf(log)] = {HashOf(stamp), HashOf(serial), HashesOf(tags, recorded)};
}

bool DoneLogs::Has(const UnitOrder& order, const LogStamp& stamp) const {
  const auto found = logs_.find(HashOf(order.log));
  if (found == logs_.end() || found->second.stamp != HashOf(stamp)) return false;
  const Done& done = found->second;
  if (!order.serial.empty() && done.serial != HashOf(order.serial)) return false;
  const std::vector<std::size_t> wanted = HashesOf(order.tags, order.recorded);
  return std::all_of(wanted.begin(), wanted.end(), [&](std::size_t tag) {
    return std::find(done.tags.begin(), done.tags.end(), tag) != done.tags.end();
  });
}

bool DoneLogs::Has(const UnitOrder& order) const {
  const std::optional<LogStamp> stamp = StampOf(order.log);
  return stamp && Has(order, *stamp);
}

}  // namespace truetriad::fleet

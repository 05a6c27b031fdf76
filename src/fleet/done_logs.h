// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "fleet/log_files.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Which logs have a run by one experiment and this program, and how they were then. Keeps two
/// numbers a log; should two have one number (of 2^64), one of them is calibrated again.
class DoneLogs {
 public:
  /// Nothing yet.
  DoneLogs() = default;
  /// What the store has. Error (bad input): it cannot be read.
  static Result<DoneLogs> In(Store& store, const std::string& config_sha256);

  void Add(const std::string& log, const LogStamp& stamp);
  /// Its last run was of this state of the log.
  bool Has(const std::string& log, const LogStamp& stamp) const;
  /// The same of the log as it is now.
  bool Has(const std::string& log) const;

 private:
  std::unordered_map<std::size_t, std::size_t> stamps_;  ///< By log.
};

}  // namespace truetriad::fleet

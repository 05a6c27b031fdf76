// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "fleet/log_files.h"
#include "fleet/store.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Which logs have a run by one experiment and this program, and how they were then. Keeps a few
/// numbers a log; should two have one number (of 2^64), one of them is calibrated again.
class DoneLogs {
 public:
  /// Nothing yet.
  DoneLogs() = default;
  /// What the store has. Error (bad input): it cannot be read.
  static Result<DoneLogs> In(Store& store, const std::string& config_sha256);

  /// `serial`, `tags`, `recorded`: of its run.
  void Add(const std::string& log,
           const LogStamp& stamp,
           const std::string& serial,
           const Tags& tags,
           const std::string& recorded = "");
  /// The last run of the order's log was of this state of it, and has the serial number, tags and
  /// time of measurement that the order states. Of those that it does not state any do: they label
  /// what is run.
  bool Has(const UnitOrder& order, const LogStamp& stamp) const;
  /// The same of the log as it is now.
  bool Has(const UnitOrder& order) const;

 private:
  struct Done {
    std::size_t stamp = 0, serial = 0;
    std::vector<std::size_t> tags;  ///< One each, with its name; the time of measurement likewise.
  };

  std::unordered_map<std::size_t, Done> logs_;
};

}  // namespace truetriad::fleet

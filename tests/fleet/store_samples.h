// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "fleet/store.h"
#include "report/sample_calibration.h"

namespace truetriad::fleet {

inline UnitRun RunOf(const std::string& serial) {
  UnitRun run;
  Fill(SampleCalibration(), &run);
  run.id = NewRunId();
  run.serial = serial;
  run.log = serial + ".csv";
  run.config_sha256 = "abc";
  run.tags.lot = "L17";
  return run;
}

/// A run of A1 and its verdict.
inline UnitRun RunOf(const std::string& id, Verdict verdict) {
  UnitRun run = RunOf("A1");
  run.id = id;
  run.verdict = verdict;
  return run;
}

/// Of each log the last run.
inline std::vector<UnitRun> LastRuns(Store& store) {
  std::vector<UnitRun> runs;
  const Status status = store.ForEachLastRun([&](const UnitRun& run) { runs.push_back(run); });
  EXPECT_TRUE(status) << status.error().message;
  return runs;
}

/// The rows of an answer.
inline std::vector<std::vector<std::optional<std::string>>> Ask(Store& store,
                                                                const std::string& sql) {
  const Result<Table> table = store.Query(sql);
  EXPECT_TRUE(table) << table.error().message;
  return table ? table->rows : std::vector<std::vector<std::optional<std::string>>>();
}

}  // namespace truetriad::fleet

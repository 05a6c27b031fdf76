// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fleet/unit_run.h"
#include "report/sample_calibration.h"

namespace truetriad::fleet {

/// A name as of NewRunId: `digits` are hexadecimal, up to eight, and say their order. Another text
/// stays as it is.
inline std::string SampleId(const std::string& digits) {
  const bool is_other = digits.empty() || digits.size() > 8 ||
                        digits.find_first_not_of("0123456789abcdef") != std::string::npos;
  return is_other ? digits
                  : "20261125T120000.000000Z-" + std::string(8 - digits.size(), '0') + digits;
}

/// A run of a usable unit with a finding that has all there is (`id` as SampleId), inputs, tags and
/// limits.
inline UnitRun SampleRun(const std::string& id, const std::string& serial) {
  UnitRun run;
  Fill(SampleCalibration(), &run);
  run.id = SampleId(id);
  run.serial = serial;
  run.log = serial + ".csv";
  run.log_bytes = 1'400'000;
  run.log_modified_ns = 1'795'570'000'123'456'789;
  run.created = "2026-11-25T12:00:00Z";
  run.recorded = "2026-11-25T11:30:00Z";
  run.recorded_by = "recording";
  run.config_sha256 = "abc";
  run.tags.lot = "L17";
  run.tags.note = "=1+1, \"x\"";
  run.wall_s = 0.1;
  run.cpu_s = 1.0 / 3.0;
  run.inputs = {{serial + ".csv", "0a1f", 4200}};
  run.readings = {{"accelerometer", "1a"}, {"gyroscope", "2b"}};
  run.findings.push_back(Finding(FindingCode::kClockOffset, "the clock is late", "set time: auto")
                             .About(Triad::kMagnetometer, 2)
                             .AtPose(7)
                             .With("offset", 0.1, 0.01, "s")
                             .With("share", 1e-300));
  LimitCheck check;
  check.name = "accelerometer.bias";
  check.component = "x";
  check.limit.upper = 0.7;
  check.worst = 0.1;
  check.sigma = 1.0 / 7.0;
  check.pass = true;
  run.judgements.push_back(check);
  return run;
}

}  // namespace truetriad::fleet

// SPDX-License-Identifier: Apache-2.0
// make_fleet STORE UNITS: a store of a line that might be: lots, stations and fixtures, limits,
// some units that fail, are refused or are tried again, a drift, and serial numbers that are meant
// to break pages. The first units have reports beside the store. The same every time.
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "report/sample_calibration.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 6> kStrange = {"<script>alert(1)</script>",
                                                 "O'Brien \"the\" unit; DROP TABLE run",
                                                 "../../etc/passwd",
                                                 "line\nend",
                                                 "sep\xE2\x80\xA8"
                                                 "arator & <b>bold</b>",
                                                 "Prüfling Ω №5"};
constexpr int kReports = 3;

std::string Padded(int number, int digits) {
  const std::string text = std::to_string(number);
  return std::string(static_cast<std::size_t>(std::max(0, digits - static_cast<int>(text.size()))),
                     '0') +
         text;
}

/// `second` after the beginning of a month.
std::string MomentOf(int second) {
  return "2026-10-" + Padded(1 + second / 86400 % 30, 2) + "T" + Padded(second / 3600 % 24, 2) +
         ":" + Padded(second / 60 % 60, 2) + ":" + Padded(second % 60, 2) + "Z";
}

class Line {
 public:
  explicit Line(int units) : units_(units) {}

  /// The run of unit `i`, its `attempt`th, from 0.
  UnitRun RunOf(int i, int attempt) {
    UnitRun run;
    const int second = static_cast<int>(25.0 * 86400.0 * i / units_) + 120 * attempt;
    run.serial = i < static_cast<int>(kStrange.size()) ? kStrange[static_cast<std::size_t>(i)]
                                                       : "U" + Padded(i, 6);
    run.recorded = run.created = MomentOf(second);
    run.recorded_by = "list";
    run.id = "202610" + Padded(1 + second / 86400, 2) + "T" + Padded(second % 86400, 6) + "Z-" +
             Padded(i, 8) + "-" + std::to_string(attempt);
    run.log = "line/" + std::to_string(i) + ".csv";
    run.software_version = "0.1.0";
    run.tags.lot = "L" + Padded(1 + 12 * i / units_, 2);
    run.tags.station = "S" + std::to_string(1 + i % 4);
    run.tags.fixture = "F" + std::to_string(1 + i % 7);
    run.mode = "poses";
    // Every fifth unit is not tried again.
    if (i % 250 == 40) {
      run.verdict = Verdict::kNoResult;
      run.code = "wrong-field-count";
      run.message = run.log + ":812: has 9 fields, and its header 10";
    } else if (i % 125 == 50 || (i % 250 == 111 && attempt == 0)) {
      run.verdict = Verdict::kNoResult;
      run.code = "coplanar-poses";
      run.message = "All poses lie in one plane: the z axis was never turned up or down.";
      Finding finding(FindingCode::kMessage, run.message);
      finding.severity = Severity::kRefusal;
      run.findings.push_back(finding);
    } else {
      Measure(i, attempt, &run);
    }
    return run;
  }

 private:
  void Measure(int i, int attempt, UnitRun* run) {
    const double drift = 0.06 * i / units_ + 0.02 * (i % 4 == 2 ? 1 : 0);
    double worst = 0.0;
    for (const char* sensor : {"accelerometer", "gyroscope", "magnetometer"}) {
      for (const char axis : {'x', 'y', 'z'}) {
        const double value = drift + 0.2 * normal_(random_) * (attempt > 0 ? 0.6 : 1.0);
        if (*sensor == 'a' && std::abs(value) > std::abs(worst)) worst = value;
        run->parameters.push_back({std::string(sensor) + ".bias." + axis, value, 0.0004});
      }
      for (const char* entry : {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy"}) {
        const double nominal = entry[0] == entry[1] ? 1.0 : 0.0;
        run->parameters.push_back({std::string(sensor) + ".sensitivity." + entry,
                                   nominal + 0.004 * normal_(random_),
                                   4e-5});
      }
    }
    LimitCheck check;
    check.name = "accelerometer.bias";
    check.component = "x";
    check.limit.lower = -0.4;
    check.limit.upper = 0.4;
    check.worst = worst;
    check.sigma = 0.0004;
    check.pass = std::abs(worst) <= 0.4;
    run->judgements.push_back(check);
    run->verdict = check.pass ? Verdict::kPass : Verdict::kFail;
    if (check.pass) return;
    run->code = "limit:" + check.FullName();
    run->message = check.FullName() + " is outside its limits";
  }

  int units_;
  std::mt19937_64 random_{20261001};
  std::normal_distribution<double> normal_;
};

Status WriteReport(const std::string& units, UnitRun* run) {
  run->folder = (fs::path(units) / FolderNameOf(run->serial) / run->id).string();
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(run->folder));
  Calibration calibration = SampleCalibration();
  calibration.serial = run->serial;
  return WriteFileAtomically((fs::path(run->folder) / "report.html").string(),
                             CalibrationHtml(calibration, {.assets = std::string(kAssetsOfRun)}));
}

Status Make(const std::string& path, int units) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStore(path));
  const std::string folder = (fs::path(path).parent_path() / "units").string();
  TRUETRIAD_RETURN_IF_ERROR(WriteSharedAssets(folder));
  Line line(units);
  for (int i = 0; i < units; ++i) {
    for (int attempt = 0; attempt < 3; ++attempt) {
      UnitRun run = line.RunOf(i, attempt);
      if (i < kReports) TRUETRIAD_RETURN_IF_ERROR(WriteReport(folder, &run));
      TRUETRIAD_RETURN_IF_ERROR(store->Add(run));
      // The first unit is tried three times, others that are not good mostly once more.
      const bool is_again = i == 0 || (IsRed(run.verdict) && attempt == 0 && i % 5 != 0);
      if (!is_again) break;
    }
  }
  return {};
}

}  // namespace
}  // namespace truetriad::fleet

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: make_fleet STORE UNITS\n");
    return 1;
  }
  const truetriad::Status status = truetriad::fleet::Make(argv[1], std::stoi(argv[2]));
  if (!status) std::fprintf(stderr, "%s\n", status.error().message.c_str());
  return status ? 0 : 2;
}

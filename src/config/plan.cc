// SPDX-License-Identifier: Apache-2.0
#include "config/plan.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "config/documents.h"
#include "config/experiment_draft.h"
#include "config/yaml_values.h"
#include "model/attitude_sets.h"

namespace truetriad {
namespace {

constexpr NamedValues<PlanCriterion, 2> kCriteria = {{
    {PlanCriterion::kDeterminant, "D"},
    {PlanCriterion::kVariances, "A"},
}};
constexpr NamedValues<bool, 2> kPlanStarts = {{{false, "nothing"}, {true, "recording"}}};
/// Numbers of attitudes that a grid may be spread over: fewer leave gaps, more take minutes.
constexpr Range kSpread{24, 5000, "24 to 5000 attitudes"};

/// A whole number within `range`.
bool ReadCount(YamlReader reader, const Range& range, int* value) {
  int count = 0;
  double number = 0.0;
  if (!ReadNumber(reader, range, &number) || !reader.Read(&count)) return false;
  *value = count;
  return true;
}

void ReadRotations(YamlReader reader, PlanGrid* grid) {
  if (!reader) return;
  grid->continuous = false;
  if (IsWord(reader, "hand")) {
    grid->attitudes = HandAttitudes();
  } else if (IsWord(reader, "cube-24")) {
    grid->attitudes = CubeAttitudes();
  } else if (IsWord(reader, "six-face")) {
    grid->attitudes = SixFaceAttitudes();
  } else if (reader.IsMap()) {
    int count = 0;
    if (ReadCount(reader.RequireChild("spread"), kSpread, &count)) {
      grid->attitudes = SpreadAttitudes(count);
      grid->continuous = true;
    }
    reader.RejectUnknown();
  } else {
    reader.Fail("expected one of hand, cube-24, six-face, { spread: 600 }");
  }
}

void ReadTemperatures(YamlReader reader, std::vector<double>* temperatures) {
  if (!reader) return;
  temperatures->clear();
  for (const YamlReader& item : reader.Items()) {
    ReadNumber(item, kTemperatureDegc, &temperatures->emplace_back());
  }
  std::sort(temperatures->begin(), temperatures->end());
  if (std::adjacent_find(temperatures->begin(), temperatures->end()) != temperatures->end()) {
    reader.Fail("a temperature is listed twice");
  }
}

void ReadNominalSensor(YamlReader reader, Triad triad, NominalSensor* nominal) {
  if (!reader) return;
  YamlReader unit = reader.Child("unit");
  if (std::string name; unit && unit.Read(&name)) {
    if (const Result<Unit> parsed = ParseTriadUnit(triad, name)) {
      nominal->unit = *parsed;
    } else {
      unit.Fail(parsed.error().message, parsed.error().code);
    }
  }
  YamlReader sensitivity = reader.Child("sensitivity");
  if (sensitivity.IsScalar()) {
    if (double gain = 0.0; ReadNumber(sensitivity, kPositive, &gain)) {
      nominal->sensitivity = gain * Eigen::Matrix3d::Identity();
    }
  } else if (Eigen::Matrix3d matrix; ReadNumbers(sensitivity, &matrix)) {
    nominal->sensitivity = matrix;
    if (!(std::abs(matrix.determinant()) > 0.0)) {
      sensitivity.Fail("the matrix is singular; expected raw readings per true unit");
    }
  }
  ReadNumbers(reader.Child("bias"), &nominal->bias);
  reader.RejectUnknown();
}

void ReadNominal(YamlReader reader, PlanConfig* plan) {
  if (!reader) return;
  for (const Triad triad : kTriads) {
    ReadNominalSensor(reader.Child(TriadName(triad)), triad, &plan->nominal[triad]);
  }
  double number = 0.0;
  if (ReadNumber(reader.Child("strength_ut"), kPositive, &number)) {
    plan->nominal_strength_ut = number;
  }
  if (ReadNumber(reader.Child("dip_deg"), kDipDeg, &number)) {
    plan->nominal_dip_deg = number;
  }
  reader.RejectUnknown();
}

}  // namespace

void ReadPlan(YamlReader reader, const std::string& path, PlanConfig* plan) {
  if (!reader) return;
  ReadCount(reader.Child("poses"), {1, 1000, "1 to 1000 poses"}, &plan->poses);
  if (YamlReader wanted = reader.Child("wanted")) {
    for (const std::string& name : wanted.Keys()) {
      ReadNumber(wanted.Child(name), kPositive, &plan->wanted[name]);
    }
  }
  ReadCount(reader.Child("max_poses"), {1, 1000, "1 to 1000 poses"}, &plan->max_poses);
  ReadRotations(reader.Child("rotations"), &plan->grid);
  ReadTemperatures(reader.Child("temperatures_degc"), &plan->grid.temperatures_degc);
  ReadChoice(reader.Child("criterion"), kCriteria, &plan->criterion);
  if (std::string file; reader.Optional("program", &file)) plan->program = Resolve(file, path);
  ReadCount(reader.Child("random"), {0, 10000, "0 to 10000 draws"}, &plan->random_draws);
  ReadChoice(reader.Child("start"), kPlanStarts, &plan->from_recording);
  ReadNumber(reader.Child("rest_s"), kPositive, &plan->rest_s);
  ReadNumber(reader.Child("turn_s"),
             {kPositive.lowest, 300.0, "up to 300 s, the longest turn that calibration uses"},
             &plan->turn_s);
  ReadNumber(reader.Child("turn_sigma_deg"), kNotNegative, &plan->turn_sigma_deg);
  if (int seed = 0; ReadCount(reader.Child("seed"),
                              {0, std::numeric_limits<int>::max(), "a whole number from zero"},
                              &seed)) {
    plan->seed = static_cast<std::uint64_t>(seed);
  }
  ReadNominal(reader.Child("nominal"), plan);
  reader.RejectUnknown();
}

}  // namespace truetriad

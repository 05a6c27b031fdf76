// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "config/experiment_draft.h"
#include "model/attitude_sets.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace {

constexpr NamedValues<PlanCriterion, 2> kCriteria = {{
    {PlanCriterion::kDeterminant, "D"},
    {PlanCriterion::kVariances, "A"},
}};
constexpr NamedValues<bool, 2> kPlanStarts = {{{false, "nothing"}, {true, "recording"}}};
constexpr Range kPoses{1, 1000, "1 to 1000 poses"};
/// The number of attitudes of a spread grid: fewer leave gaps, and planning with more takes
/// minutes.
constexpr Range kSpread{24, 5000, "24 to 5000 attitudes"};

MapWord GridWord(std::string_view word, PlanGrid* grid, std::vector<Eigen::Quaterniond> (*of)()) {
  return {word, false, [grid, of] {
            grid->attitudes = of();
            grid->continuous = false;
          }};
}

void NominalSensorFields(auto& visit, Triad triad, NominalSensor* nominal) {
  visit("unit", nominal->unit, ReadingsUnit{triad});
  if (double gain = 0.0; visit.IsNumber("sensitivity")) {
    if (visit("sensitivity", gain, kPositive)) {
      nominal->sensitivity = gain * Eigen::Matrix3d::Identity();
    }
  } else if (visit("sensitivity", nominal->sensitivity, kNumbers)) {
    visit.Expect(std::abs(nominal->sensitivity->determinant()) > 0.0,
                 "the matrix is singular; expected raw readings per true unit",
                 "sensitivity");
  }
  visit("bias", nominal->bias, kNumbers);
}

void NominalFields(auto& visit, PlanConfig* plan) {
  for (const Triad triad : kTriads) {
    visit.Map(TriadName(triad),
              [&](auto& sensor) { NominalSensorFields(sensor, triad, &plan->nominal[triad]); });
  }
  visit("strength_ut", plan->options.nominal_field_ut, kPositive);
  visit(InDegrees("dip_deg"), plan->options.nominal_dip_rad, kDipDeg);
}

}  // namespace

void PlanFields(auto& visit, PlanConfig* plan) {
  PlanOptions& options = plan->options;
  PlanGrid* const grid = &options.grid;
  visit("poses", options.poses, kPoses);
  visit("wanted", options.wanted, MapOf{kPositive});
  visit("max_poses", options.max_poses, kPoses);
  const auto rotations = [&](auto& in) {
    in.Require("spread");
    int count = 0;
    grid->continuous = in("spread", count, kSpread);
    if (grid->continuous) grid->attitudes = SpreadAttitudes(count);
  };
  visit.Map("rotations",
            rotations,
            {.words = {GridWord("hand", grid, HandAttitudes),
                       GridWord("cube-24", grid, CubeAttitudes),
                       GridWord("six-face", grid, SixFaceAttitudes)}});
  std::vector<double>& temperatures = grid->temperatures_degc;
  visit("temperatures_degc", temperatures, ListOf{kTemperatureDegc});
  std::sort(temperatures.begin(), temperatures.end());
  visit.Expect(std::adjacent_find(temperatures.begin(), temperatures.end()) == temperatures.end(),
               "a temperature is listed twice",
               "temperatures_degc");
  visit("criterion", options.criterion, kCriteria);
  visit("program", plan->program, kAnyText);
  visit("random", options.random_draws, Range{0, 10000, "0 to 10000 draws"});
  visit("start", plan->from_recording, kPlanStarts);
  visit("rest_s", options.rest_s, kPositive);
  visit(
      "turn_s",
      options.turn_s,
      Range{kPositive.lowest, 300.0, "a duration up to 300 s (calibration uses no longer turns)"});
  visit(InDegrees("turn_sigma_deg"), options.turn_sigma_rad, kNotNegative);
  visit("seed", options.seed, Seed());
  visit.Map("nominal", [&](auto& nominal) { NominalFields(nominal, plan); });
}
template void PlanFields(FieldReader&, PlanConfig*);
template void PlanFields(FieldSchema&, PlanConfig*);

}  // namespace truetriad

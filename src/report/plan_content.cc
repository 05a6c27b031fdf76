// SPDX-License-Identifier: Apache-2.0
#include "report/plan_content.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "model/attitude_sets.h"
#include "report/format.h"

namespace truetriad {
namespace {

/// "magnetometer.misalignment_rad.xy" -> "magnetometer misalignment xy",
/// "accelerometer.thermal.bias.2.x" -> "accelerometer bias τ^2 x".
std::string Spoken(std::string name) {
  for (const auto& [from, to] : {std::pair(".thermal.bias.", ".bias.τ^"),
                                 std::pair(".thermal.sensitivity.", ".sensitivity.τ^"),
                                 std::pair(".thermal.rate.", ".bias.rate.")}) {
    if (const std::size_t at = name.find(from); at != std::string::npos) {
      name.replace(at, std::string_view(from).size(), to);
    }
  }
  for (const char* unit : {"_rad", "_ut", "_mps2", "_error"}) {
    if (const std::size_t at = name.find(unit); at != std::string::npos) {
      name.erase(at, std::string(unit).size());
    }
  }
  std::replace(name.begin(), name.end(), '.', ' ');
  return name;
}

/// σ as people judge it: shares in per cent, angles in milliradians.
std::string SigmaText(double sigma, const std::string& unit) {
  if (!std::isfinite(sigma)) return "unobservable";
  if (unit.empty()) return Significant(100.0 * sigma, 3);
  if (unit == "rad") return Significant(1000.0 * sigma, 3);
  return Significant(sigma, 3);
}

std::string ShownUnit(const std::string& unit) {
  if (unit.empty()) return "%";
  return unit == "rad" ? "mrad" : DisplayUnit(unit);
}

std::string UnitOf(const Plan& plan, const std::string& group) {
  for (const PlannedSigma& sigma : plan.sigmas) {
    if (sigma.group == group) return sigma.unit;
  }
  return "";
}

bool HasTemperatures(const Plan& plan) {
  return std::any_of(plan.program.poses.begin(),
                     plan.program.poses.end(),
                     [](const ProgramPose& pose) { return pose.temperature_degc.has_value(); });
}

Table WantedTable(const Plan& plan) {
  Table table{
      {"wanted", "result", "at most", "reached", "unit", "poses for this alone"}, "llrrlr", {}};
  for (const WantedSigma& item : plan.wanted) {
    const std::string unit = UnitOf(plan, item.group);
    table.rows.push_back({Spoken(item.group),
                          item.met ? "pass" : "FAIL",
                          SigmaText(item.wanted, unit),
                          SigmaText(item.reached, unit),
                          ShownUnit(unit),
                          item.poses_needed ? std::to_string(*item.poses_needed) : "–"});
  }
  return table;
}

Table SigmaTable(const Plan& plan) {
  Table table{{"σ of", "before", "after", "unit"}, "lrrl", {}};
  if (plan.measured_poses == 0) table = {{"σ of", "predicted", "unit"}, "lrl", {}};
  for (const PlannedSigma& sigma : plan.sigmas) {
    std::vector<std::string> row = {Spoken(sigma.name)};
    if (plan.measured_poses > 0) row.push_back(SigmaText(sigma.before, sigma.unit));
    row.push_back(SigmaText(sigma.after, sigma.unit));
    row.push_back(ShownUnit(sigma.unit));
    table.rows.push_back(row);
  }
  return table;
}

std::vector<Block> NoiseBlocks(const Plan& plan) {
  Table table{{"σ of a pose's mean", "x", "y", "z", "unit", ""}, "lrrrll", {}};
  for (const PlannedNoise& planned : plan.noise) {
    const std::string sensor(TriadName(planned.triad));
    const TriadNoise& noise = planned.noise;
    table.rows.push_back({sensor,
                          Significant(noise.sigma.x(), 3),
                          Significant(noise.sigma.y(), 3),
                          Significant(noise.sigma.z(), 3),
                          DisplayUnit(planned.unit),
                          std::string(NoiseSourceWords(noise.source))});
    if (!(noise.excess_sigma > 0.0)) continue;
    const std::string excess = Significant(noise.excess_sigma, 3);
    table.rows.push_back({sensor + ", plus pose-to-pose noise",
                          excess,
                          excess,
                          excess,
                          TruthUnit(planned.triad),
                          ""});
  }
  return {"The σ above assume this noise.", table};
}

std::string RandomText(const Plan& plan) {
  const RandomComparison& random = *plan.random;
  const std::string count = std::to_string(plan.program.poses.size());
  std::string text =
      "σ of " + count + " random poses is " + Significant(random.gain, 3) +
      " times as large (geometric mean over all " + std::to_string(plan.sigmas.size()) +
      " quantities; median of " + std::to_string(random.draws) + " draws, half of them between " +
      Significant(random.gain_low, 3) + " and " + Significant(random.gain_high, 3) + ").";
  if (random.equal_poses) {
    text += " These poses are worth " + std::to_string(*random.equal_poses) + " random ones.";
  }
  return text;
}

}  // namespace

Headline HeadlineOf(const Plan& plan) {
  Headline headline;
  const std::size_t count = plan.program.poses.size();
  const std::string poses =
      std::to_string(count) + (count == 1 ? " pose" : " poses") +
      (plan.measured_poses > 0
           ? " in addition to the " + std::to_string(plan.measured_poses) + " measured ones"
           : "");
  // The verb after it, for one pose or for many.
  const auto does = [&](const std::string& plural, const std::string& singular) {
    return poses + ' ' + (count == 1 ? singular : plural);
  };
  if (!plan.determined) {
    headline.text = "NOT ENOUGH";
    headline.explanation = does("do", "does") + " not make every enabled parameter observable.";
  } else if (!plan.rehearsed) {
    headline.text = "CANNOT BE CALIBRATED";
    headline.explanation =
        does("have", "has") + " enough information, but the calibration finds no start values.";
  } else if (!plan.IsMet()) {
    headline.text = "NOT AS GOOD AS WANTED";
    headline.explanation = does("do", "does") + " not reach every wanted σ.";
  } else {
    headline.grade = Grade::kGood;
    headline.text = plan.wanted.empty() ? "GOOD PLAN" : "GOOD PLAN, as wanted";
    headline.explanation = plan.wanted.empty()
                               ? does("determine", "determines") + " every parameter."
                               : does("reach", "reaches") + " every wanted σ.";
  }
  return headline;
}

std::string LabelOf(const ProgramPose& pose) {
  return pose.label.empty() ? AttitudeInWords(pose.world_from_body) : pose.label;
}

std::string RestText(const Plan& plan) {
  if (plan.rest_s > 0.0) {
    return "Let the unit rest for " + Significant(plan.rest_s, 3) + " s in each pose.";
  }
  return "Let the unit rest in each pose until its mean has the noise assumed below; state "
         "plan.rest_s to get a time.";
}

std::string PurposeText(const Plan& plan, std::size_t k) {
  const PosePurpose& purpose = plan.purposes[k];
  // Where something is unobservable anyway, no pose can be told to be idle.
  if (purpose.name.empty()) return plan.determined ? "nothing: the other poses cover it" : "–";
  // What belongs together does not break.
  return Spoken(purpose.name) + ", " +
         (std::isfinite(purpose.sigma_ratio) ? "σ\u00a0×\u00a0" + Fixed(purpose.sigma_ratio, 2)
                                             : "unobservable");
}

Table ProgramTable(const Plan& plan) {
  const bool temperatures = HasTemperatures(plan);
  Table table{{"pose", "attitude", "most affected if skipped"}, "rll", {}};
  if (temperatures) table = {{"pose", "attitude", "degC", "most affected if skipped"}, "rlrl", {}};
  for (std::size_t k = 0; k < plan.program.poses.size(); ++k) {
    const ProgramPose& pose = plan.program.poses[k];
    std::vector<std::string> row = {std::to_string(k + 1), LabelOf(pose)};
    if (temperatures) {
      row.push_back(pose.temperature_degc ? Significant(*pose.temperature_degc, 4) : "");
    }
    row.push_back(PurposeText(plan, k));
    table.rows.push_back(row);
  }
  return table;
}

std::vector<PageSection> SectionsOf(const Plan& plan) {
  std::vector<PageSection> sections;
  if (!plan.wanted.empty()) sections.push_back({"Wanted", {WantedTable(plan)}});
  if (!plan.weak_directions.empty()) {
    PageSection section{"Weakly observable with these poses", {}};
    for (const WeakDirection& weak : plan.weak_directions) {
      section.blocks.emplace_back(
          Bullet{weak.description + (weak.advice.empty() ? "" : ": " + weak.advice)});
    }
    sections.push_back(section);
  }
  if (!plan.messages.empty()) {
    PageSection section{"Messages", {}};
    for (const std::string& message : plan.messages) section.blocks.emplace_back(Bullet{message});
    sections.push_back(section);
  }
  sections.push_back({"Predicted uncertainty, one sigma", {SigmaTable(plan)}});
  sections.push_back({"Assumed noise", NoiseBlocks(plan)});
  if (plan.random && std::isfinite(plan.random->gain)) {
    sections.push_back({"Compared with random poses", {RandomText(plan)}});
  }
  return sections;
}

}  // namespace truetriad

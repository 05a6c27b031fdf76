// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/messages.h"
#include "verdict/checks/check.h"

namespace truetriad {

// Refuses if over half of a sensor's poses were rejected: the sensor's stated noise, or the model,
// then does not fit the poses. Over a quarter is enough if the other poses do not determine the
// parameters.
Findings CheckOutliers(const SettledRun& run, const SolvedRun& solved) {
  const bool determined = solved.determined && solved.system.rank() == solved.system.size();
  const double most = determined ? 0.5 : 0.25;
  std::size_t tests = run.graph.increments.size();
  for (const PoseNode& node : run.graph.nodes) tests += node.observations.size();
  for (const Triad triad : kTriads) {
    if (!run.options.triads[triad].enabled) continue;
    const Eigen::Matrix3d C = run.graph.sensitivity(triad).inverse();
    int rejected = 0, all = 0;
    double variance = 0.0;
    for (const PoseNode& node : run.graph.nodes) {
      for (const Observation& seen : node.observations) {
        if (seen.triad != triad || node.role != PoseRole::kRest) continue;
        ++all;
        rejected += seen.rejected ? 1 : 0;
        variance += (C * seen.variance * C.transpose()).trace() / 3.0;
      }
    }
    if (!(rejected > most * all)) continue;
    const std::string name(TriadName(triad));
    const std::string unit(TruthUnitName(triad));
    const double sigma = std::sqrt(variance / all);
    const bool is_estimated =
        std::find(run.noise.estimated.begin(), run.noise.estimated.end(), PoseNoise(triad)) !=
        run.noise.estimated.end();
    return {Finding(FindingCode::kTooManyOutliers,
                    name + ": " + std::to_string(rejected) + " of " + std::to_string(all) +
                        " poses were left out, with errors above " +
                        Format("%.1f times the σ", RejectedFrom(tests)) +
                        Format(" of %.2g ", sigma) + unit +
                        "; these are too many to be outliers: " +
                        (is_estimated ? "the readings do not fit the model"
                                      : "the poses scatter by more than that σ"),
                    is_estimated ? ""
                                 : "have it estimated (`sensors: { " + name +
                                       ": { noise: { excess: estimate } } }`), or state a larger "
                                       "noise")
                .About(triad)
                .With("outliers", rejected)
                .With("poses", all)
                .With("noise", sigma, unit)};
  }
  return {};
}

// A single outlier may occur by chance. Several have a cause that may also affect other poses.
Findings CheckRejectedPoses(const SettledRun&, const SolvedRun& solved) {
  // If outliers exceed this share, one pose in twenty, they are a warning.
  constexpr double kMuchShare = 0.05;
  // Chosen for a readable message.
  constexpr std::size_t kNamed = 8;
  const auto poses = static_cast<double>(solved.stated.quality.poses);
  Findings findings;
  for (const Triad triad : kTriads) {
    std::vector<std::string> numbers;
    for (const RejectedPose& rejected : solved.stated.quality.rests.rejected_poses) {
      if (rejected.triad == triad) numbers.push_back(std::to_string(rejected.pose));
    }
    if (numbers.empty()) continue;
    const std::size_t count = numbers.size();
    if (count > kNamed) {
      numbers.resize(kNamed);
      numbers.push_back(std::to_string(count - kNamed) + " more");
    }
    const bool is_turns = triad == Triad::kGyroscope;
    Finding finding(FindingCode::kRejectedPoses,
                    std::string(TriadName(triad)) + (is_turns ? ": the turns into " : ": ") +
                        (count == 1 ? "pose " : "poses ") + Listed(numbers) +
                        (count == 1 && !is_turns ? " disagrees" : " disagree") +
                        " with all others and " + (count == 1 && !is_turns ? "is" : "are") +
                        " left out");
    const bool is_much = count > 1 && static_cast<double>(count) > kMuchShare * poses;
    finding.As(is_much ? Severity::kWarning : Severity::kNote);
    findings.push_back(finding.About(triad).With("poses", static_cast<double>(count)));
  }
  return findings;
}

}  // namespace truetriad

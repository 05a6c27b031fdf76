// SPDX-License-Identifier: Apache-2.0
#include "truetriad/planning/plan.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "math/random.h"
#include "model/attitude_sets.h"
#include "planning/plan_problem.h"
#include "solve/reduced_system.h"
#include "verdict/observability.h"

namespace truetriad {
namespace {

// Chosen: random programs are at most this many times as long as the planned one.
constexpr int kRandomStretch = 3;
// With at most this tilt, rad (11 deg), a pose counts as standing on a face of a block.
constexpr double kLargestFaceTilt = 0.2;

// The logarithm of the geometric mean of σ; infinite if a quantity is not determined.
double MeanLog(const Eigen::VectorXd& sigmas) { return sigmas.array().log().mean(); }

RandomComparison CompareWithRandom(const PlanProblem& problem,
                                   const PlanOptions& options,
                                   const Plan& plan,
                                   const Eigen::VectorXd& planned) {
  const std::size_t count = plan.program.poses.size();
  const std::size_t longest = kRandomStretch * count;
  // A six-face block only stands on its faces.
  const bool from_grid = options.calibrate.attitudes.kind == AttitudeKind::kSixFace;
  const std::vector<Eigen::Quaterniond> faces = SixFaceAttitudes();
  Random random(options.seed);
  // gains[n]: for each random draw of n poses, its geometric mean σ divided by the plan's.
  std::vector<std::vector<double>> gains(longest + 1);
  for (int draw = 0; draw < options.random_draws; ++draw) {
    std::vector<ProgramPose> poses(longest);
    for (ProgramPose& pose : poses) {
      pose.world_from_body =
          from_grid ? faces[static_cast<std::size_t>(random.Below(static_cast<int>(faces.size())))]
                    : random.Rotation();
      pose.temperature_degc =
          plan.program.poses[static_cast<std::size_t>(random.Below(static_cast<int>(count)))]
              .temperature_degc;
    }
    const std::vector<InformationRows> rows = problem.Rows(poses);
    Eigen::MatrixXd information = problem.known();
    for (std::size_t n = 1; n <= longest; ++n) {
      information.noalias() += rows[n - 1].transpose() * rows[n - 1];
      if (n < count) continue;
      gains[n].push_back(std::exp(MeanLog(problem.Sigmas(information)) - MeanLog(planned)));
    }
  }
  // The quantile `share` of the gains over draws of n poses.
  const auto gain_at = [&gains](std::size_t n, double share) {
    std::vector<double>& sorted = gains[n];
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
  };
  RandomComparison comparison;
  comparison.draws = options.random_draws;
  comparison.gain = gain_at(count, 0.5);
  comparison.gain_low = gain_at(count, 0.25);
  comparison.gain_high = gain_at(count, 0.75);
  for (std::size_t n = count; n <= longest && !comparison.equal_poses; ++n) {
    if (gain_at(n, 0.5) <= 1.0) comparison.equal_poses = static_cast<int>(n);
  }
  return comparison;
}

// The purpose of each pose: the quantity whose σ grows most if the pose is left out. The turns
// before and after the pose then become one turn.
std::vector<PosePurpose> PurposesOf(const PlanProblem& problem,
                                    const std::vector<ProgramPose>& poses,
                                    const Eigen::VectorXd& sigmas) {
  std::vector<PosePurpose> purposes;
  for (std::size_t left_out = 0; left_out < poses.size(); ++left_out) {
    std::vector<ProgramPose> others = poses;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const Eigen::VectorXd without = problem.Sigmas(problem.Information(others));
    PosePurpose& purpose = purposes.emplace_back();
    for (Eigen::Index q = 0; q < sigmas.size(); ++q) {
      if (!std::isfinite(sigmas[q])) continue;
      const double ratio = without[q] / sigmas[q];
      if (ratio <= purpose.sigma_ratio) continue;
      purpose.sigma_ratio = ratio;
      purpose.name = problem.quantities()[static_cast<std::size_t>(q)].name;
    }
  }
  return purposes;
}

// Labels each pose in words for the operator, without the heading if no sensor measures it.
void Label(bool has_heading, std::vector<ProgramPose>* poses) {
  for (ProgramPose& pose : *poses) {
    pose.label = AttitudeInWords(pose.world_from_body);
    if (!has_heading) pose.label.erase(pose.label.rfind(", "));
  }
}

// A condition on the options, with the key and the message of the error if it does not hold.
struct Rule {
  bool holds;
  const char* key;
  std::string problem;
};

Status AllHold(const std::vector<Rule>& rules) {
  std::string problems;
  const char* key = nullptr;
  for (const Rule& rule : rules) {
    if (rule.holds) continue;
    if (key == nullptr) key = rule.key;
    problems += (problems.empty() ? "" : "\n") + rule.problem;
  }
  if (key == nullptr) return {};
  return Error(ErrorCode::kInvalidExperiment, problems).About(key);
}

// Whether a six-face block stands on a face in all poses from which the plan may choose.
bool StandsOnFaces(const PlanOptions& options) {
  const auto stands = [](const Eigen::Quaterniond& world_from_body) {
    const Eigen::Vector3d up = world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
    return up.cwiseAbs().maxCoeff() > std::cos(kLargestFaceTilt);
  };
  bool all = !options.grid.continuous;
  for (const Eigen::Quaterniond& attitude : options.grid.attitudes) all = all && stands(attitude);
  if (!options.program) return all;
  for (const ProgramPose& pose : options.program->poses) all = all && stands(pose.world_from_body);
  return all;
}

Status CheckWanted(const PlanOptions& options, const PlanProblem& problem) {
  std::set<std::string> groups;
  for (const PlanQuantity& quantity : problem.quantities()) groups.insert(quantity.group);
  for (const auto& [name, sigma] : options.wanted) {
    if (groups.contains(name)) continue;
    std::string known;
    for (const std::string& group : groups) known += (known.empty() ? "" : ", ") + group;
    return Error(ErrorCode::kUnknownName,
                 "wanted `" + name + "` is not a quantity of this plan; expected one of " + known)
        .About("plan.wanted." + name);
  }
  return {};
}

// Compares the wanted σ with the planned ones.
std::vector<WantedSigma> WantedOf(const PlanProblem& problem,
                                  const PlanOptions& options,
                                  const Plan& plan) {
  std::vector<WantedSigma> wanted;
  for (const auto& [name, sigma] : options.wanted) {
    WantedSigma& item = wanted.emplace_back();
    item.group = name;
    item.wanted = sigma;
    for (const PlannedSigma& planned : plan.sigmas) {
      if (planned.group == name) item.reached = std::max(item.reached, planned.after);
    }
    item.met = item.reached <= kReached * sigma;
    if (options.program) continue;
    if (!problem.has_gyroscope()) item.poses_needed = FewestPoses(problem, options, name);
    if (!item.met) continue;
    // FewestPoses does not try all programs. If the planned program reaches this σ, its number of
    // poses suffices and may be smaller.
    const auto taken = static_cast<int>(plan.program.poses.size());
    item.poses_needed = std::min(item.poses_needed.value_or(taken), taken);
  }
  return wanted;
}

}  // namespace

bool Plan::IsMet() const {
  return determined && rehearsed &&
         std::all_of(wanted.begin(), wanted.end(), [](const auto& item) { return item.met; });
}

Status PlanOptions::Validate() const {
  const auto is = [](const char* name, auto value) {
    return std::string(name) + " = " + std::to_string(value) + " is ";
  };
  std::vector<Rule> rules = {
      {poses >= 0, "plan.poses", is("poses", poses) + "below zero"},
      {max_poses >= 1, "plan.max_poses", is("max_poses", max_poses) + "below one"},
      {poses <= max_poses || program,
       "plan.poses",
       is("poses", poses) + "more than max_poses = " + std::to_string(max_poses)},
      {rest_s >= 0.0, "plan.rest_s", is("rest_s", rest_s) + "below zero"},
      {random_draws >= 0, "plan.random", is("random", random_draws) + "below zero"},
      {program || poses > 0 || !wanted.empty(),
       "plan",
       "the number of poses is open; give `poses`, `wanted` sigmas, or a program to evaluate"},
      {program || !grid.attitudes.empty(), "plan.rotations", "the grid of rotations is empty"},
      {!program || !program->poses.empty(), "plan.program", "the program has no poses"},
      {!calibrate.triads[Triad::kGyroscope].enabled ||
           calibrate.triads[Triad::kAccelerometer].enabled,
       "sensors.gyroscope",
       "planning turns for the gyroscope needs the accelerometer; enable it too (for a gyroscope "
       "alone, state turntable rates instead of planning)"},
      {turn_s > 0.0, "plan.turn_s", is("turn_s", turn_s) + "not above zero"},
      {turn_sigma_rad >= 0.0, "plan.turn_sigma_deg", "turn_sigma_deg is below zero"},
      {!calibrate.HasChoice(),
       "sensors",
       "`auto` chooses the model from the readings to calibrate, which a plan does not have; state "
       "the models and terms to plan for"},
      {calibrate.attitudes.kind != AttitudeKind::kSixFace || StandsOnFaces(*this),
       "plan",
       "a six-face block rests on its faces: plan with `rotations: six-face` or cube-24, and give "
       "no program with other poses"},
      {!calibrate.HasThermal() || program || !grid.temperatures_degc.empty(),
       "plan.temperatures_degc",
       "`thermal:` terms are enabled, but no chamber temperatures are stated to plan for; state "
       "them, as in `plan: { temperatures_degc: [-20, 0, 25, 45, 65] }`"}};
  for (const auto& [name, sigma] : wanted) {
    rules.push_back(
        {sigma > 0.0, "plan.wanted", is(("wanted " + name).c_str(), sigma) + "not positive"});
  }
  for (const double degc : grid.temperatures_degc) {
    rules.push_back({std::isfinite(degc),
                     "plan.temperatures_degc",
                     "chamber temperature " + std::to_string(degc) + " is not a number"});
  }
  TRUETRIAD_RETURN_IF_ERROR(AllHold(rules));
  for (std::size_t k = 0; program && calibrate.HasThermal() && k < program->poses.size(); ++k) {
    if (program->poses[k].temperature_degc) continue;
    return Error(ErrorCode::kMissingTemperature,
                 "pose " + std::to_string(k + 1) +
                     " of the program has no temperature, but `thermal:` terms need one; give "
                     "each pose a `temperature_degc`");
  }
  return calibrate.Validate();
}

Result<Plan> MakePlan(const PoseSet& measured, const PlanOptions& asked) {
  TRUETRIAD_RETURN_IF_ERROR(asked.Validate());
  // A plan ignores the Earth's rate, which is known beforehand and does not noticeably lower any σ.
  PlanOptions options = asked;
  options.calibrate.reference.earth_rate.reset();
  TRUETRIAD_ASSIGN_OR_RETURN(const PlanProblem problem, PlanProblem::Create(measured, options));
  TRUETRIAD_RETURN_IF_ERROR(CheckWanted(options, problem));

  Plan plan;
  plan.messages = problem.messages();
  plan.measured_poses = static_cast<int>(measured.poses.size());
  if (options.program) {
    plan.program = *options.program;
  } else {
    TRUETRIAD_ASSIGN_OR_RETURN(plan.program.poses, FindPoses(measured, options, problem));
    // If there are turns, the operator needs headings even if no sensor measures them.
    Label(problem.has_heading() || problem.has_gyroscope(), &plan.program.poses);
  }

  const Eigen::VectorXd before = problem.Sigmas(problem.known());
  const Eigen::VectorXd after = problem.Sigmas(problem.Information(plan.program.poses));
  for (std::size_t q = 0; q < problem.quantities().size(); ++q) {
    const PlanQuantity& quantity = problem.quantities()[q];
    const auto at = static_cast<Eigen::Index>(q);
    plan.sigmas.push_back({quantity.name, quantity.group, quantity.unit, before[at], after[at]});
  }
  plan.wanted = WantedOf(problem, options, plan);
  plan.purposes = PurposesOf(problem, plan.program.poses, after);
  plan.rest_s = problem.RestSeconds();
  plan.noise = problem.Noise(plan.program.poses);

  const PoseGraph graph = problem.GraphWith(plan.program.poses);
  const ReducedSystem system(graph);
  Observability observability =
      AnalyseObservability(graph, system.shared(), options.calibrate.observable_sigma);
  plan.determined = observability.determined && system.rank() == system.size();
  if (plan.determined) {
    const Status rehearsal = problem.Rehearse(plan.program.poses);
    plan.rehearsed = static_cast<bool>(rehearsal);
    if (!rehearsal) plan.messages.push_back("the rehearsal failed: " + rehearsal.error().message);
  }
  plan.weak_directions = std::move(observability.weak_directions);
  plan.covariance = problem.Present(system.covariance()).covariance;
  // If a σ is infinite, the plan cannot be compared.
  if (options.random_draws > 0 && after.allFinite() && !problem.has_gyroscope()) {
    plan.random = CompareWithRandom(problem, options, plan, after);
  }
  return plan;
}

}  // namespace truetriad

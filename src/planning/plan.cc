// SPDX-License-Identifier: Apache-2.0
#include "truetriad/planning/plan.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "math/distributions.h"
#include "math/random.h"
#include "model/attitude_sets.h"
#include "planning/plan_problem.h"
#include "planning/plan_search.h"
#include "planning/pose_order.h"
#include "solve/reduced_system.h"
#include "start/start.h"
#include "verdict/observability.h"

namespace truetriad {
namespace {

// Random programs are tried up to this many times as long.
constexpr int kRandomStretch = 3;
// A block stands on its faces: a pose further from one is no pose of a six-face program.
constexpr double kLargestFaceTilt = 0.2;

double Quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// Log of the geometric mean; infinite where one quantity is not determined.
double MeanLog(const Eigen::VectorXd& sigmas) { return sigmas.array().log().mean(); }

RandomComparison CompareWithRandom(const PlanProblem& problem,
                                   const PlanOptions& options,
                                   const Plan& plan,
                                   const Eigen::VectorXd& planned) {
  const std::size_t count = plan.program.poses.size();
  const std::size_t longest = kRandomStretch * count;
  // A block has no other poses than its faces.
  const bool from_grid = options.calibrate.attitudes.kind == AttitudeKind::kSixFace;
  const std::vector<Eigen::Quaterniond> faces = SixFaceAttitudes();
  Random random(options.seed);
  // Gains of each draw when it has 1, 2, … poses more than are measured.
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
  RandomComparison comparison;
  comparison.draws = options.random_draws;
  comparison.gain = Quantile(gains[count], 0.5);
  comparison.gain_low = Quantile(gains[count], 0.25);
  comparison.gain_high = Quantile(gains[count], 0.75);
  for (std::size_t n = count; n <= longest; ++n) {
    if (Quantile(gains[n], 0.5) > 1.0) continue;
    comparison.equal_poses = static_cast<int>(n);
    break;
  }
  return comparison;
}

PosePurpose PurposeOf(const PlanProblem& problem,
                      const Eigen::VectorXd& without,
                      const Eigen::VectorXd& sigmas) {
  PosePurpose purpose;
  for (Eigen::Index q = 0; q < sigmas.size(); ++q) {
    if (!std::isfinite(sigmas[q])) continue;
    const double ratio = without[q] / sigmas[q];
    if (ratio <= purpose.sigma_ratio) continue;
    purpose.sigma_ratio = ratio;
    purpose.name = problem.quantities()[static_cast<std::size_t>(q)].name;
  }
  return purpose;
}

std::vector<PosePurpose> PurposesOf(const PlanProblem& problem,
                                    const std::vector<InformationRows>& rows,
                                    const Eigen::VectorXd& sigmas) {
  std::vector<PosePurpose> purposes;
  for (std::size_t left_out = 0; left_out < rows.size(); ++left_out) {
    Eigen::MatrixXd information = problem.known();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (k != left_out) information.noalias() += rows[k].transpose() * rows[k];
    }
    purposes.push_back(PurposeOf(problem, problem.Sigmas(information), sigmas));
  }
  return purposes;
}

// The words that an operator goes by; a heading that nobody sees is not one of them.
void Label(bool has_heading, std::vector<ProgramPose>* poses) {
  for (ProgramPose& pose : *poses) {
    pose.label = AttitudeInWords(pose.world_from_body);
    if (!has_heading) pose.label.erase(pose.label.rfind(", "));
  }
}

Status CheckFaces(const PlanOptions& options) {
  if (options.calibrate.attitudes.kind != AttitudeKind::kSixFace) return {};
  const auto stands = [](const Eigen::Quaterniond& world_from_body) {
    const Eigen::Vector3d up = world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
    return up.cwiseAbs().maxCoeff() > std::cos(kLargestFaceTilt);
  };
  bool all = !options.grid.continuous;
  for (const Eigen::Quaterniond& attitude : options.grid.attitudes) all = all && stands(attitude);
  if (options.program) {
    for (const ProgramPose& pose : options.program->poses) {
      all = all && stands(pose.world_from_body);
    }
  }
  if (all) return {};
  return Error(ErrorCode::kInvalidExperiment,
               "a six-face block rests on its faces: plan with `rotations: six-face` or cube-24, "
               "and give "
               "no program with other poses")
      .About("plan");
}

// Temperature terms are planned for at stated temperatures.
Status CheckTemperatures(const PlanOptions& options) {
  if (!options.calibrate.HasThermal()) return {};
  if (!options.program) {
    if (!options.grid.temperatures_degc.empty()) return {};
    return Error(ErrorCode::kInvalidExperiment,
                 "`thermal:` terms are enabled, but no chamber temperatures are stated to plan "
                 "for; state "
                 "them, as in `plan: { temperatures_degc: [-20, 0, 25, 45, 65] }`")
        .About("plan.temperatures_degc");
  }
  for (std::size_t k = 0; k < options.program->poses.size(); ++k) {
    if (options.program->poses[k].temperature_degc) continue;
    return Error(ErrorCode::kMissingTemperature,
                 "pose " + std::to_string(k + 1) +
                     " of the program has no temperature, but `thermal:` terms need one; give "
                     "each pose a `temperature_degc`");
  }
  return {};
}

// σ wanted of the gyroscope, or of the other sensors.
std::map<std::string, double> WantedOf(const PlanOptions& options, bool of_gyroscope) {
  std::map<std::string, double> wanted;
  for (const auto& [name, sigma] : options.wanted) {
    if (name.starts_with("gyroscope.") == of_gyroscope) wanted[name] = sigma;
  }
  return wanted;
}

// Largest σ over wanted σ.
double WorstOf(const PlanProblem& problem,
               const std::map<std::string, double>& wanted,
               const Eigen::VectorXd& sigmas) {
  double worst = 0.0;
  for (std::size_t q = 0; q < problem.quantities().size(); ++q) {
    const auto found = wanted.find(problem.quantities()[q].group);
    if (found == wanted.end()) continue;
    worst = std::max(worst, sigmas[static_cast<Eigen::Index>(q)] / found->second);
  }
  return worst;
}

// A gyroscope sees turns, whose worth depends on what comes before them: poses are found for the
// sensors that they show, put into the order that shows the gyroscope best, and more of them are
// taken until that is enough.
Result<std::vector<ProgramPose>> FindPosesForGyroscope(const PoseSet& measured,
                                                       const PlanOptions& options,
                                                       const PlanProblem& problem) {
  // An eighth more poses each round: ten rounds from the least program to three times as many.
  constexpr int kShareMore = 8;
  const std::map<std::string, double> wanted = WantedOf(options, true);
  PlanOptions without = options;
  without.calibrate.triads[Triad::kGyroscope].enabled = false;
  without.wanted = WantedOf(options, false);
  TRUETRIAD_ASSIGN_OR_RETURN(const PlanProblem others, PlanProblem::Create(measured, without));
  if (without.poses == 0 && without.wanted.empty()) {
    std::vector<ProgramPose> least(1);
    while (!CheckPoseCounts(others.ExactReadings(least), others.options())) {
      least.push_back(least.front());
    }
    without.poses = std::min(static_cast<int>(least.size()), options.max_poses);
  }
  while (true) {
    PlanSearch search(others, without);
    std::vector<ProgramPose> poses =
        problem.OrderedForGyroscope(OrderForOperator(search.Find(), others.has_heading()));
    const auto count = static_cast<int>(poses.size());
    if (options.poses > 0 || count >= options.max_poses ||
        WorstOf(problem, wanted, problem.Sigmas(problem.Information(poses))) <= kReached) {
      return poses;
    }
    without.poses = std::min(count + 1 + count / kShareMore, options.max_poses);
  }
}

// What each pose of a program with turns is there for: without it the turns on both sides are one.
std::vector<PosePurpose> PurposesWithTurns(const PlanProblem& problem,
                                           const std::vector<ProgramPose>& poses,
                                           const Eigen::VectorXd& sigmas) {
  std::vector<PosePurpose> purposes;
  for (std::size_t left_out = 0; left_out < poses.size(); ++left_out) {
    std::vector<ProgramPose> others = poses;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    purposes.push_back(PurposeOf(problem, problem.Sigmas(problem.Information(others)), sigmas));
  }
  return purposes;
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

// How the wanted σ are met by the σ planned. `search`: absent where the poses were not searched
// for.
std::vector<WantedSigma> WantedOf(const PlanOptions& options,
                                  const Plan& plan,
                                  std::optional<PlanSearch>* search) {
  std::vector<WantedSigma> wanted;
  for (const auto& [name, sigma] : options.wanted) {
    WantedSigma item{name, sigma, 0.0, false, std::nullopt};
    for (const PlannedSigma& planned : plan.sigmas) {
      if (planned.group == name) item.reached = std::max(item.reached, planned.after);
    }
    item.met = item.reached <= kReached * sigma;
    if (!options.program && *search) item.poses_needed = (*search)->FewestFor(name);
    if (!options.program && item.met) {
      // The search is not exhaustive: what the whole program reaches, no more poses are needed for.
      const auto taken = static_cast<int>(plan.program.poses.size());
      item.poses_needed = std::min(item.poses_needed.value_or(taken), taken);
    }
    wanted.push_back(item);
  }
  return wanted;
}

}  // namespace

bool Plan::IsMet() const {
  return determined && rehearsed &&
         std::all_of(wanted.begin(), wanted.end(), [](const auto& item) { return item.met; });
}

Status PlanOptions::Validate() const {
  std::string problems;
  std::string key = "plan";
  const auto expect = [&](bool good, const char* about, const std::string& problem) {
    if (good) return;
    if (problems.empty()) key = about;
    problems += (problems.empty() ? "" : "\n") + problem;
  };
  expect(poses >= 0, "plan.poses", "poses = " + std::to_string(poses) + " is below zero");
  expect(max_poses >= 1,
         "plan.max_poses",
         "max_poses = " + std::to_string(max_poses) + " is below one");
  expect(poses <= max_poses || program,
         "plan.poses",
         "poses = " + std::to_string(poses) +
             " is more than max_poses = " + std::to_string(max_poses));
  expect(rest_s >= 0.0, "plan.rest_s", "rest_s = " + std::to_string(rest_s) + " is below zero");
  expect(random_draws >= 0,
         "plan.random",
         "random = " + std::to_string(random_draws) + " is below zero");
  for (const auto& [name, sigma] : wanted) {
    expect(sigma > 0.0,
           "plan.wanted",
           "wanted " + name + " = " + std::to_string(sigma) + " is not positive");
  }
  expect(program || poses > 0 || !wanted.empty(),
         "plan",
         "the number of poses is open; give `poses`, `wanted` sigmas, or a program to evaluate");
  expect(program || !grid.attitudes.empty(), "plan.rotations", "the grid of rotations is empty");
  for (const double temperature : grid.temperatures_degc) {
    expect(std::isfinite(temperature),
           "plan.temperatures_degc",
           "chamber temperature " + std::to_string(temperature) + " is not a number");
  }
  expect(!program || !program->poses.empty(), "plan.program", "the program has no poses");
  expect(!calibrate.triads[Triad::kGyroscope].enabled ||
             calibrate.triads[Triad::kAccelerometer].enabled,
         "sensors.gyroscope",
         "planning turns for the gyroscope needs the accelerometer; enable it too (for a gyroscope "
         "alone, state turntable rates instead of planning)");
  expect(turn_s > 0.0, "plan.turn_s", "turn_s = " + std::to_string(turn_s) + " is not above zero");
  expect(turn_sigma_rad >= 0.0, "plan.turn_sigma_deg", "turn_sigma_deg is below zero");
  expect(!calibrate.HasChoice(),
         "sensors",
         "`auto` chooses a model from readings, and there are none yet; name the models and terms "
         "to plan for");
  if (!problems.empty()) return Error(ErrorCode::kInvalidExperiment, problems).About(key);
  return calibrate.Validate();
}

Result<Plan> MakePlan(const PoseSet& measured, const PlanOptions& asked) {
  TRUETRIAD_RETURN_IF_ERROR(asked.Validate());
  TRUETRIAD_RETURN_IF_ERROR(CheckFaces(asked));
  TRUETRIAD_RETURN_IF_ERROR(CheckTemperatures(asked));
  // The Earth stands still: its rate, known beforehand, takes no σ away that matters here.
  PlanOptions options = asked;
  options.calibrate.reference.earth_rate.reset();
  TRUETRIAD_ASSIGN_OR_RETURN(const PlanProblem problem, PlanProblem::Create(measured, options));
  const bool has_turns = problem.has_gyroscope();
  TRUETRIAD_RETURN_IF_ERROR(CheckWanted(options, problem));

  Plan plan;
  plan.messages = problem.messages();
  plan.measured_poses = static_cast<int>(measured.poses.size());
  std::optional<PlanSearch> search;
  if (!has_turns) search.emplace(problem, options);
  if (options.program) {
    plan.program = *options.program;
  } else if (has_turns) {
    TRUETRIAD_ASSIGN_OR_RETURN(auto poses, FindPosesForGyroscope(measured, options, problem));
    plan.program.poses = std::move(poses);
    // A turn has a heading even where none is seen.
    Label(true, &plan.program.poses);
  } else {
    plan.program.poses = OrderForOperator(search->Find(), problem.has_heading());
    Label(problem.has_heading(), &plan.program.poses);
  }

  const Eigen::VectorXd before = problem.Sigmas(problem.known());
  const Eigen::VectorXd after = problem.Sigmas(problem.Information(plan.program.poses));
  for (std::size_t q = 0; q < problem.quantities().size(); ++q) {
    const PlanQuantity& quantity = problem.quantities()[q];
    const auto at = static_cast<Eigen::Index>(q);
    plan.sigmas.push_back({quantity.name, quantity.group, quantity.unit, before[at], after[at]});
  }
  plan.wanted = WantedOf(options, plan, &search);
  plan.purposes = has_turns ? PurposesWithTurns(problem, plan.program.poses, after)
                            : PurposesOf(problem, problem.Rows(plan.program.poses), after);
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
  // Against a σ that is infinite everything is better.
  if (options.random_draws > 0 && after.allFinite() && !has_turns) {
    plan.random = CompareWithRandom(problem, options, plan, after);
  }
  return plan;
}

}  // namespace truetriad

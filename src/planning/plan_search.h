// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "planning/exchange.h"
#include "planning/plan_problem.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

// Looks for the program: greedily, by exchange over the grid, off the grid where that is allowed,
// from several starts; the number of poses by bisection where σ are wanted.
class PlanSearch {
 public:
  // Both are kept by reference.
  PlanSearch(const PlanProblem& problem, const PlanOptions& options);

  // The program that the options ask for, in no order.
  std::vector<ProgramPose> Find() const;

  // Poses that would do if σ of this group were all that is wanted; unset: more than max_poses.
  std::optional<int> FewestFor(const std::string& group) const;

 private:
  using Wanted = std::map<std::string, double>;

  struct Program {
    std::vector<ProgramPose> poses;
    std::vector<InformationRows> rows;
    Eigen::MatrixXd weights;  // of the cost that it is best by
    double score = 0.0;       // less is better
  };

  std::size_t LeastCount() const;
  // Programs of `count` poses of the grid, from as many starts, best first.
  std::vector<Program> Programs(std::size_t count, const Wanted& wanted, int starts) const;
  // From all starts and refined, best first.
  std::vector<Program> BestPrograms(std::size_t count) const;
  Program ProgramFrom(Design design, const Wanted& wanted) const;
  // The fewest poses whose score is at most 1; unset: more than max_poses.
  std::optional<std::size_t> Fewest(const Wanted& wanted) const;
  static void SortByScore(std::vector<Program>* programs);
  // Off the grid.
  Program Refined(Program program) const;

  Eigen::MatrixXd Information(const Program& program, bool regularised) const;
  // A-weights of quantities: tr(W P) = sum of factors * (σ / targets)^2.
  Eigen::MatrixXd Weights(const Eigen::VectorXd& factors) const;
  // What each σ is to be, whether somebody wants it or only the verdict does.
  Eigen::VectorXd Targets(const Wanted& wanted) const;
  double Score(const Program& program, const Wanted& wanted) const;

  const PlanProblem& problem_;
  const PlanOptions& options_;
  std::vector<ProgramPose> candidates_;
  Candidates rows_;
  Eigen::MatrixXd base_;
};

}  // namespace truetriad

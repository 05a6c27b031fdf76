// SPDX-License-Identifier: Apache-2.0
#include "motion/solver.h"

#include <vector>

#include "solve/shared_problem.h"

namespace truetriad {
namespace {

constexpr int kMaxIterations = 50;

// The attitudes of a chain eliminated.
class MotionElimination final : public EliminatedProblem {
 public:
  MotionElimination(const SharedLayout& layout, MotionChain* chain)
      : layout_(layout), chain_(*chain) {}

  void Linearise(const Eigen::VectorXd& shared) override {
    if (is_linearised_) chain_.SetAttitudes(AttitudesAt(shared));
    at_ = shared;
    chain_.Linearise(at_.data());
    is_linearised_ = true;
  }

  double CostAt(const Eigen::VectorXd& shared) const override {
    return chain_.CostAt(shared.data(), is_linearised_ ? AttitudesAt(shared) : chain_.attitudes());
  }

  double cost() const override { return chain_.cost(); }
  const Eigen::VectorXd& gradient() const override { return chain_.gradient(); }
  const Eigen::MatrixXd& information() const override { return chain_.information(); }

 private:
  // The attitudes that the last linearisation gives at other shared parameters.
  std::vector<Eigen::Quaterniond> AttitudesAt(const Eigen::VectorXd& shared) const {
    return chain_.AttitudesAfter(layout_.basis.transpose() * (shared - at_));
  }

  const SharedLayout& layout_;
  MotionChain& chain_;
  bool is_linearised_ = false;
  Eigen::VectorXd at_;
};

}  // namespace

SolveOutcome SolveMotion(MotionChain* chain, PoseGraph* graph, double tolerance) {
  MotionElimination problem(graph->layout, chain);
  return SolveEliminated(graph->layout, tolerance, kMaxIterations, &problem, &graph->shared);
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

// Exact optimal design: which poses, of a list of candidates, say most about the parameters.
// Fedorov, Theory of Optimal Experiments, 1972; Atkinson, Donev and Tobias 2007, ch. 12.

// What one pose says: its information is rows^T rows.
using InformationRows = Eigen::MatrixXd;

// Candidates in one matrix, so that all of them are tried by one product.
class Candidates {
 public:
  explicit Candidates(const std::vector<InformationRows>& poses);

  std::size_t size() const { return first_.size() - 1; }
  auto rows(std::size_t candidate) const {
    return stacked_.middleRows(first_[candidate], first_[candidate + 1] - first_[candidate]);
  }
  const auto& stacked() const { return stacked_; }
  Eigen::Index first(std::size_t candidate) const { return first_[candidate]; }

 private:
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> stacked_;
  std::vector<Eigen::Index> first_;  // row of each candidate, and the end
};

// How good a design with information M (positive definite) is; less is better.
//
//   weights empty   D: -log det M
//   else            A: tr(weights M^-1), a weighted sum of variances
double DesignCost(const Eigen::MatrixXd& information, const Eigen::MatrixXd& weights);

// A design with room for one more pose.
class Vacancy {
 public:
  Vacancy(const Eigen::MatrixXd& information, const Eigen::MatrixXd& weights);

  // By how much the cost falls when a pose is added. With P = M^-1:
  //   D: log det(I + B P B^T)      A: tr((I + B P B^T)^-1 B P W P B^T)
  double Gain(const InformationRows& rows) const;

  // The candidate of most gain, and that gain.
  struct Choice {
    std::size_t candidate = 0;
    double gain = -1.0;
  };
  Choice Best(const Candidates& candidates) const;

 private:
  Eigen::MatrixXd covariance_;  // P
  Eigen::MatrixXd weighted_;    // P W P; empty for D
};

// Places in `candidates`; one may stand there several times.
using Design = std::vector<std::size_t>;

// `base` and all that the design says.
Eigen::MatrixXd DesignInformation(const Eigen::MatrixXd& base,
                                  const Candidates& candidates,
                                  const Design& design);

// Adds the best candidate, `count` times. `base` is positive definite.
Design GreedyDesign(const Eigen::MatrixXd& base,
                    const Candidates& candidates,
                    const Eigen::MatrixXd& weights,
                    std::size_t count);

// Exchanges each pose for the best candidate until no exchange lowers the cost.
void ExchangeUntilSettled(const Eigen::MatrixXd& base,
                          const Candidates& candidates,
                          const Eigen::MatrixXd& weights,
                          Design* design);

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "problem/parameters.h"

namespace truetriad {

// Information and gradient of terms h that the model does not have, given the solution's own
// coordinates b at their best; left_out_terms.h.
struct Conditional {
  Eigen::MatrixXd information;  // I
  Eigen::VectorXd gradient;     // u
  Eigen::MatrixXd gain;         // M_bb^-1 M_bh
  Eigen::VectorXd full;         // of each entry if all else were known
};
std::optional<Conditional> ConditionOn(const Eigen::MatrixXd& information,
                                       const Eigen::VectorXd& gradient,
                                       const std::vector<Eigen::Index>& base,
                                       const std::vector<Eigen::Index>& extra);

// The test of the entries `at` of what is left.
struct ScoreTest {
  double chi2 = 0.0;
  int rank = 0;
};

// What is left of the terms' score beside those that were allowed for and taken in. Entries are
// those of the terms, in the order of `extra`.
class TermSearch {
 public:
  explicit TermSearch(Conditional given);

  // Entries that are zero but for a σ each, known beforehand. With L = diag(1 / σ^2) of them and
  // A = I + L the readings leave A^-1, and h = -A^-1 u of it shifts the solution. What is left to
  // tests is what they have beyond that: of these entries (I^-1 + L^-1)^-1.
  void AllowFor(const std::vector<Eigen::Index>& at, const Eigen::VectorXd& sigmas);
  // V of some that were allowed for, with the square of what they shift the solution by.
  Eigen::MatrixXd CovarianceBy(const std::vector<Eigen::Index>& at) const;

  ScoreTest Test(const std::vector<Eigen::Index>& at) const;

  // By how many σ some parameter moves at most when h moves by one of its own: h^T I h = 1. Of
  // those that were allowed for it is what readings and σ together leave of h that moves.
  std::optional<double> KappaOf(const std::vector<Eigen::Index>& at,
                                const SharedLayout& layout,
                                const Eigen::ArrayXd& variances) const;

  // |h| of them.
  double SizeOf(const std::vector<Eigen::Index>& at) const;

  // The others are tested beside it from now on. Of its directions those are taken in that show:
  // what does not would only add what it is unknown by. Returns how they move the solution.
  Eigen::VectorXd TakeIn(const std::vector<Eigen::Index>& at);

  // d d^T + V of all that was allowed for and taken in.
  Eigen::MatrixXd Covariance() const;
  bool is_empty() const { return taken_.cols() == 0; }

 private:
  struct Directions {
    Eigen::MatrixXd shown, hidden;  // one a column
  };

  std::vector<Eigen::Index> SeenOf(const std::vector<Eigen::Index>& at) const;
  Directions DirectionsOf(const std::vector<Eigen::Index>& at) const;
  void Append(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& prior);
  // What the others are left with beside `directions`, known beforehand to `prior`. Returns the
  // sizes that the readings give them.
  Eigen::VectorXd SetAside(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& prior);
  // Where entries stand among those allowed for; empty unless all do.
  std::vector<Eigen::Index> AllowedOf(const std::vector<Eigen::Index>& at) const;

  Conditional given_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd taken_;  // a direction a column
  Eigen::MatrixXd prior_;  // information about their sizes that the readings do not give
  std::vector<Eigen::Index> allowed_;
  Eigen::MatrixXd allowed_covariance_;  // A^-1
  Eigen::VectorXd allowed_sizes_;       // -h
};

}  // namespace truetriad

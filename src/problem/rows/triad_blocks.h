// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "problem/parameters.h"
#include "problem/rows/row.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// The model of one triad at one pose as a sum over parameter blocks: each block, times its factor
// of temperature, temperature rate or session at that pose, adds to the bias, the sensitivity or a
// higher term. Blocks of terms that the model lacks are left out.
//
//   bias (3), sensitivity (9, column by column), thermal bias and rate terms (3 each), thermal
//   sensitivity (9 each), sessions' biases (3 each), axis terms (3 each)
class TriadBlocks {
 public:
  TriadBlocks(const SharedLayout& layout, Triad triad, const ThermalFactors& factors);

  std::vector<SharedBlock> blocks() const;
  std::size_t count() const { return terms_.size(); }

  // The model at the given values of the blocks, which are in the order of the blocks.
  template <typename T>
  TriadModel<T> ModelAt(T const* const* values) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Matrix3 = Eigen::Matrix<T, 3, 3>;
    TriadModel<T> model{Eigen::Map<const Matrix3>(values[1]), Eigen::Map<const Vector3>(values[0])};
    for (std::size_t i = 2; i < terms_.size(); ++i) {
      switch (terms_[i].part) {
        case Part::kBias:
          model.bias += T(terms_[i].factor) * Eigen::Map<const Vector3>(values[i]);
          break;
        case Part::kSensitivity:
          model.sensitivity += T(terms_[i].factor) * Eigen::Map<const Matrix3>(values[i]);
          break;
        case Part::kAxisTerm:
          model.axis_terms[terms_[i].axis_term] = Eigen::Map<const Vector3>(values[i]);
          break;
      }
    }
    return model;
  }

  // Derivatives of model.RawFromTruth(field) by the blocks; a jacobians[i] that is null is not
  // computed.
  void SetFieldJacobians(const TriadModel<double>& model,
                         const Eigen::Vector3d& field,
                         double** jacobians) const;

  // Derivatives of any three rows by the blocks, from their derivatives by the parts of the model.
  struct ByParts {
    Eigen::Matrix3d bias;
    Eigen::Matrix<double, 3, 9> sensitivity;
    PerAxisTerm<Eigen::Matrix3d> axis_terms;  // of the terms in the blocks
  };
  void SetJacobians(const ByParts& by, double** jacobians) const;

 private:
  enum class Part { kBias, kSensitivity, kAxisTerm };
  struct Term {
    int offset = 0;
    Part part = Part::kBias;
    double factor = 1.0;
    AxisTerm axis_term = {};
  };

  std::vector<Term> terms_;
};

// d (M v) / d M, with M column by column; the Jacobian is row-major.
void SetMatrixTimesVector(const Eigen::Vector3d& vector, double* jacobian);

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/triad_model.h"

#include <gtest/gtest.h>

namespace truetriad {
namespace {

TEST(TriadModel, CorrectionUndoesSensitivity) {
  TriadModel<double> model;
  model.sensitivity << 414.0, 3.0, -7.0, 1.0, -412.0, 2.0, 9.0, -4.0, 415.0;  // mirrored, in counts
  model.bias << 33124.0, -33275.0, 1e-3;
  const Eigen::Vector3d truth(9.8, -0.01, 3.0);
  const Eigen::Vector3d round_trip = model.TruthFromRaw(model.RawFromTruth(truth));
  // Rounding of raw (3e4 * 2^-52) divided by the gain, times the condition number (~1).
  EXPECT_LT((round_trip - truth).norm(), 1e-13);
}

TEST(TriadModel, TakesAnyScalar) {
  TriadModel<float> model;
  model.bias << 1.0F, 2.0F, 3.0F;
  EXPECT_EQ(model.RawFromTruth(Eigen::Vector3f::Zero()), model.bias);
}

}  // namespace
}  // namespace truetriad

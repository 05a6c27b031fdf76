// SPDX-License-Identifier: Apache-2.0
#include "init/frame_alignment.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/finding_matchers.h"

namespace truetriad {
namespace frame_alignment_test {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double Normal() { return normal_(engine_); }
  double Uniform(double low, double high) { return low + (high - low) * uniform_(engine_); }
  Vector3d NormalVector() { return {Normal(), Normal(), Normal()}; }
  Matrix3d Rotation() {
    return Quaterniond(Normal(), Normal(), Normal(), Normal()).normalized().toRotationMatrix();
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

struct Problem {
  std::vector<Vector3d> up;
  std::vector<Vector3d> field;
};

Problem MakeProblem(
    const Matrix3d& rotation, double dip_rad, int poses, double sigma_rad, Random* random) {
  Problem problem;
  const Vector3d field_in_world(std::cos(dip_rad), 0.0, -std::sin(dip_rad));
  for (int k = 0; k < poses; ++k) {
    const Matrix3d body_from_world = random->Rotation();
    problem.up.push_back(
        (body_from_world.col(2) + sigma_rad * random->NormalVector()).normalized());
    problem.field.push_back((rotation.transpose() * body_from_world * field_in_world +
                             sigma_rad * random->NormalVector())
                                .normalized());
  }
  return problem;
}

double AngleBetween(const Matrix3d& a, const Matrix3d& b) {
  return AngleAxisd(Matrix3d(a.transpose() * b)).angle();
}

double Rms(const Problem& problem, const Matrix3d& rotation) {
  Eigen::VectorXd cosines(static_cast<Eigen::Index>(problem.up.size()));
  for (std::size_t k = 0; k < problem.up.size(); ++k) {
    cosines(static_cast<Eigen::Index>(k)) = problem.up[k].dot(rotation * problem.field[k]);
  }
  return std::sqrt((cosines.array() - cosines.mean()).square().mean());
}

TEST(AlignFrames, IsExactWithoutNoiseAtEveryDip) {
  Random random(1);
  for (const double dip_deg : {-85.0, -60.0, -5.0, 0.0, 1.0, 45.0, 85.0}) {
    for (const int determinant : {1, -1}) {
      const Matrix3d rotation = determinant * random.Rotation();
      const Problem problem = MakeProblem(rotation, dip_deg * kDegree, 12, 0.0, &random);
      const double cosine = -std::sin(dip_deg * kDegree);
      for (const double* known : {static_cast<const double*>(nullptr), &cosine}) {
        const auto alignments = AlignFrames(problem.up, problem.field, determinant, known);
        ASSERT_TRUE(alignments) << dip_deg;
        // Rounding, 1e-16, over the curvature at 85 degrees, cos^2 of which is 0.008, and over the
        // few poses.
        EXPECT_LT(AngleBetween(alignments->front().rotation, rotation), 1e-11) << dip_deg;
        EXPECT_NEAR(alignments->front().cosine, cosine, 1e-12) << dip_deg;
        EXPECT_LT(alignments->front().rms, 1e-11) << dip_deg;
      }
    }
  }
}

TEST(AlignFrames, SolvesPermutedAndMirroredAxes) {
  Random random(2);
  Matrix3d permuted;
  permuted << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  for (const Matrix3d& map : {permuted, Matrix3d(-permuted)}) {
    const int determinant = map.determinant() > 0.0 ? 1 : -1;
    const Problem problem = MakeProblem(map, 60.0 * kDegree, 12, 1e-3, &random);
    const auto alignments = AlignFrames(problem.up, problem.field, determinant);
    ASSERT_TRUE(alignments);
    EXPECT_LT(AngleBetween(alignments->front().rotation, map), 0.01);  // noise times a few
    EXPECT_NEAR(alignments->front().cosine, -std::sin(60.0 * kDegree), 0.01);
    EXPECT_NEAR(alignments->front().rotation.determinant(), determinant, 1e-12);
  }
}

TEST(AlignFrames, MirrorImageExplainsTheSameDataWithTheOtherSign) {
  Random random(3);
  const Problem problem = MakeProblem(random.Rotation(), 50.0 * kDegree, 12, 1e-3, &random);
  const FrameAlignment right = AlignFrames(problem.up, problem.field, 1).value().front();
  const FrameAlignment left = AlignFrames(problem.up, problem.field, -1).value().front();
  EXPECT_TRUE(left.rotation.isApprox(-right.rotation, 1e-9));
  EXPECT_NEAR(left.cosine, -right.cosine, 1e-9);
  EXPECT_NEAR(left.rms, right.rms, 1e-12);
}

TEST(AlignFrames, TruthIsTheBestCandidateInTenThousandProblems) {
  Random random(4);
  int missed = 0;
  for (int run = 0; run < 10000; ++run) {
    const int determinant = run % 2 == 0 ? 1 : -1;
    const Matrix3d rotation = determinant * random.Rotation();
    const double dip_rad = random.Uniform(-85.0, 85.0) * kDegree;
    const int poses = 12 + run % 13;
    const double sigma_rad = 1e-3;
    const Problem problem = MakeProblem(rotation, dip_rad, poses, sigma_rad, &random);
    const auto alignments = AlignFrames(problem.up, problem.field, determinant);
    ASSERT_TRUE(alignments) << "run " << run << ": " << alignments.error().message;
    // The data have the derivative cos(dip); two noises; 10 for 12 unlucky poses and five sigma.
    const double tolerance = 10.0 * std::numbers::sqrt2 * sigma_rad / std::cos(dip_rad);
    EXPECT_LE(alignments->front().rms, Rms(problem, rotation) + 1e-12) << "run " << run;
    if (AngleBetween(alignments->front().rotation, rotation) > tolerance) ++missed;
  }
  EXPECT_EQ(missed, 0);
}

TEST(AlignFrames, TenPosesAndFewerListTheTruthAmongTheCandidates) {
  // Below nine pairs the homogeneous equations are short of rank and the signed axis maps carry it;
  // four pairs for four unknowns have several exact solutions.
  Random random(5);
  int missed = 0;
  for (int run = 0; run < 500; ++run) {
    const Matrix3d rotation = random.Rotation();
    const Problem problem = MakeProblem(rotation, 60.0 * kDegree, 6 + run % 5, 0.0, &random);
    const auto alignments = AlignFrames(problem.up, problem.field, 1);
    if (!alignments) {
      ++missed;
      continue;
    }
    bool found = false;
    for (const FrameAlignment& alignment : *alignments) {
      found |= AngleBetween(alignment.rotation, rotation) < 1e-4;
    }
    if (!found) ++missed;
  }
  EXPECT_EQ(missed, 0);
}

TEST(AlignFrames, RefusesWhatDoesNotDetermineTheRotation) {
  Random random(6);
  const Problem problem = MakeProblem(Matrix3d::Identity(), 1.0, 12, 0.0, &random);
  const auto few = AlignFrames({problem.up.begin(), problem.up.begin() + 3},
                               {problem.field.begin(), problem.field.begin() + 3},
                               1);
  ASSERT_FALSE(few);
  EXPECT_EQ(few.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(few.error().message, HasSubstr("3 poses"));
  // Always the same side up: a turn about up changes nothing.
  const std::vector<Vector3d> same_up(12, Vector3d(0.6, 0.0, 0.8));
  Problem spin;
  for (int k = 0; k < 12; ++k) {
    spin.field.push_back(AngleAxisd(0.5 * k, same_up[0]) * Vector3d(0.0, 1.0, 0.0));
  }
  const auto alignments = AlignFrames(same_up, spin.field, 1);
  ASSERT_FALSE(alignments);
  EXPECT_EQ(alignments.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(RefusalOf(alignments.error()), HasCode(FindingCode::kAlignmentUndetermined));
}

TEST(TriadAttitude, IsExactForTheFirstVectorAndLeavesTheErrorToTheSecond) {
  const Vector3d up(0.0, 0.0, 1.0);
  const Vector3d field(0.5, 0.0, -0.866);
  const Matrix3d world_from_body =
      AngleAxisd(2.0, Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  const Vector3d up_in_body = world_from_body.transpose() * up;
  const Vector3d field_in_body = world_from_body.transpose() * field;
  const Matrix3d exact = TriadAttitude(up, field, up_in_body, field_in_body).toRotationMatrix();
  EXPECT_LT((exact - world_from_body).norm(), 1e-14);
  // Tilted towards up, and of another length: neither matters.
  const Matrix3d disturbed =
      TriadAttitude(up, field, 9.8 * up_in_body, 45.0 * (field_in_body + 0.3 * up_in_body))
          .toRotationMatrix();
  EXPECT_LT((disturbed - world_from_body).norm(), 1e-14);
  // Off sideways: up stays exact.
  const Matrix3d turned =
      TriadAttitude(up, field, up_in_body, field_in_body + Vector3d(0.1, 0.1, -0.1))
          .toRotationMatrix();
  EXPECT_LT((turned * up_in_body - up).norm(), 1e-14);
}

TEST(TriadAttitude, ParallelVectorsLeaveSomeRotationThatFitsTheFirst) {
  const Vector3d up(0.0, 0.0, 1.0);
  const Vector3d up_in_body(0.6, 0.0, -0.8);
  const Quaterniond attitude = TriadAttitude(up, -up, up_in_body, -up_in_body);
  EXPECT_NEAR(attitude.norm(), 1.0, 1e-14);
  EXPECT_LT((attitude * up_in_body - up).norm(), 1e-14);
}

}  // namespace frame_alignment_test
}  // namespace truetriad

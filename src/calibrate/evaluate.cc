// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "base/named_values.h"
#include "calibrate/evaluated_poses.h"
#include "calibrate/reading_units.h"
#include "math/distributions.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Restates the calibration for the units of the poses' readings. Error: counts of unknown size, no
// sensor in common.
Result<Calibration> ForReadingsOf(const PoseSet& poses,
                                  const CountSizes& si_per_count,
                                  Calibration calibration) {
  bool any = false;
  for (const StreamSummary& stream : poses.streams) {
    if (!calibration.sensors[stream.triad]) continue;
    any = true;
    const Status taken =
        TakeReadingsIn(stream.triad, stream.unit, si_per_count[stream.triad], &calibration);
    if (!taken) return Error(taken.error().code, {poses.source}, taken.error().message);
  }
  if (!any) {
    return Error(ErrorCode::kMissingSensor,
                 {poses.source},
                 "holds none of the sensors that the calibration covers");
  }
  return calibration;
}

// Length of the vector that a sensor measures at rest; zero for a gyroscope or an unstated field.
double StrengthOf(Triad triad, const ReferenceValues& reference) {
  switch (triad) {
    case Triad::kAccelerometer:
      return reference.gravity_mps2;
    case Triad::kMagnetometer:
      return reference.field_ut.value_or(0.0);
    case Triad::kGyroscope:
      break;
  }
  return 0.0;
}

// Sums up the errors e of one sensor for their joint χ², e^T (N + J Σ J^T)^-1 e: N is the
// covariance of their noise, Σ that of the parameters, and J the derivatives of e by the
// parameters. All poses share the error of a parameter, so that this error explains no scatter from
// pose to pose.
class JointErrors {
 public:
  void Add(const Eigen::VectorXd& error,
           const Eigen::MatrixXd& noise,
           const Eigen::MatrixXd& by_parameters) {
    const Eigen::LLT<Eigen::MatrixXd> root(noise);
    if (root.info() != Eigen::Success) {
      is_noisy_ = false;
      return;
    }
    const Eigen::VectorXd white = root.matrixL().solve(error);
    const Eigen::MatrixXd jacobian = root.matrixL().solve(by_parameters);
    if (count_ == 0) {
      information_ = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
      gradient_ = Eigen::VectorXd::Zero(jacobian.cols());
    }
    information_.noalias() += jacobian.transpose() * jacobian;
    gradient_.noalias() += jacobian.transpose() * white;
    chi2_ += white.squaredNorm();
    count_ += error.size();
  }

  // RMS of the whitened errors: 1 if they are as predicted. `free`: number of parameters that are
  // fitted to the errors. Unset if a reading has no noise or no degree of freedom is left.
  std::optional<double> Rms(const Eigen::MatrixXd& covariance, Eigen::Index free = 0) const {
    if (count_ <= free || !is_noisy_) return std::nullopt;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(covariance);
    const Eigen::MatrixXd root =
        parts.eigenvectors() * parts.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    Eigen::MatrixXd whole = root.transpose() * information_ * root;
    whole.diagonal().array() += 1.0;
    const Eigen::VectorXd pull = root.transpose() * gradient_;
    const double chi2 = chi2_ - pull.dot(whole.llt().solve(pull));
    return std::sqrt(std::max(chi2, 0.0) / static_cast<double>(count_ - free));
  }

 private:
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  double chi2_ = 0.0;
  Eigen::Index count_ = 0;
  bool is_noisy_ = true;
};

// Sums over the poses of one sensor.
struct ErrorSums {
  double squares = 0.0;
  double squares_before = 0.0;
  double expected = 0.0;
  int count = 0;
  JointErrors joint;
};

// Adds one reading to the sums of its sensor.
PoseResidual AddReading(const Calibration& calibration,
                        const StaticPose& pose,
                        const StreamSummary& stream,
                        const EvaluatedReading& reading,
                        ErrorSums* sums) {
  const double strength = StrengthOf(stream.triad, calibration.reference);
  PoseResidual residual;
  residual.pose = pose.number;
  residual.triad = stream.triad;
  residual.direction = reading.truth.normalized();
  residual.norm_error = reading.truth.norm() - strength;
  residual.norm_error_before =
      stream.unit.is_counts
          ? kUnknown
          : pose.triads[stream.triad]->mean_raw.norm() * stream.unit.truth_per_raw - strength;
  residual.residual = residual.norm_error * residual.direction;
  const Eigen::Matrix3d covariance = reading.Covariance(calibration);
  // If the rate is near zero, the errors of all three axes contribute to its norm.
  const double variance = stream.triad == Triad::kGyroscope
                              ? covariance.trace()
                              : residual.direction.dot(covariance * residual.direction);
  residual.normalized = std::abs(residual.norm_error) / std::sqrt(variance);
  if (stream.triad == Triad::kGyroscope) {
    sums->joint.Add(reading.truth, reading.noise, reading.by_parameters);
  } else {
    const Eigen::RowVector3d along = residual.direction.transpose();
    sums->joint.Add(Eigen::VectorXd::Constant(1, residual.norm_error),
                    along * reading.noise * residual.direction,
                    along * reading.by_parameters);
  }
  sums->squares += residual.norm_error * residual.norm_error;
  sums->squares_before += residual.norm_error_before * residual.norm_error_before;
  sums->expected += variance;
  ++sums->count;
  return residual;
}

// The cosine of the angle between gravity and field at the poses, which no attitude changes. Its
// mean is a further parameter, about which nothing is known beforehand.
class ConstantAngle {
 public:
  void Add(const Calibration& calibration,
           const EvaluatedReading& force,
           const EvaluatedReading& field) {
    const double lengths[] = {force.truth.norm(), field.truth.norm()};
    if (!(lengths[0] > 0.0) || !(lengths[1] > 0.0)) return;
    const Eigen::Vector3d up = force.truth / lengths[0], north = field.truth / lengths[1];
    const double cosine = up.dot(north);
    const Eigen::RowVector3d by_force = (north - cosine * up).transpose() / lengths[0];
    const Eigen::RowVector3d by_field = (up - cosine * north).transpose() / lengths[1];
    Eigen::MatrixXd by_parameters(1, force.by_parameters.cols() + 1);
    by_parameters << by_force * force.by_parameters + by_field * field.by_parameters, 1.0;
    const Eigen::MatrixXd noise = by_force * force.noise * by_force.transpose() +
                                  by_field * field.noise * by_field.transpose();
    const auto of_calibration = by_parameters.leftCols(force.by_parameters.cols());
    const double variance =
        noise(0, 0) +
        (of_calibration * calibration.covariance.matrix * of_calibration.transpose()).value();
    const double sine_square = std::max(1.0 - cosine * cosine, kLeastSineSquare);
    predicted_.push_back(variance / sine_square);
    angles_rad_.push_back(std::atan2(up.cross(north).norm(), cosine));
    errors_.Add(Eigen::VectorXd::Constant(1, cosine), noise, by_parameters);
  }

  void State(const Calibration& calibration, EvaluationSummary* summary) const {
    if (angles_rad_.size() < 2) return;
    const Eigen::Map<const Eigen::ArrayXd> angles(angles_rad_.data(),
                                                  static_cast<Eigen::Index>(angles_rad_.size()));
    const Eigen::Map<const Eigen::ArrayXd> predicted(predicted_.data(), angles.size());
    summary->angles_rad = angles_rad_;
    summary->angle_std_deg = std::sqrt((angles - angles.mean()).square().mean()) / kRadPerDeg;
    summary->predicted_angle_std_deg = std::sqrt(predicted.mean()) / kRadPerDeg;
    const Eigen::Index size = calibration.covariance.matrix.rows();
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size + 1, size + 1);
    covariance.topLeftCorner(size, size) = calibration.covariance.matrix;
    // The prior variance of the mean cosine: σ = 10, ten times the largest cosine.
    covariance(size, size) = 100.0;
    summary->angle_ratio = errors_.Rms(covariance, 1);
  }

 private:
  // sin² of 0.6 deg. If gravity and field are closer to parallel, as near a magnetic pole, the
  // cosine hardly determines the angle.
  static constexpr double kLeastSineSquare = 1e-4;
  JointErrors errors_;
  std::vector<double> angles_rad_, predicted_;  // predicted variances, rad^2
};

// Whether the mean norm error has a meaning. It has none if the field strength is not stated, or if
// the bias at the reference temperature is only assumed, as in a sweep without a static
// calibration.
bool HasReference(const Calibration& calibration, Triad triad) {
  if (triad == Triad::kGyroscope) return true;
  if (triad == Triad::kMagnetometer && !calibration.reference.field_ut) return false;
  return calibration.mode != Mode::kSweep || !calibration.sensors[triad]->bias_sigma.isZero(0.0);
}

// Subtracts the mean norm error from the residuals of one sensor and from the sensor's sums.
void TakeMeanOut(Triad triad, std::vector<PoseResidual>* residuals, ErrorSums* sums) {
  double mean = 0.0;
  for (const PoseResidual& residual : *residuals) {
    if (residual.triad == triad) mean += residual.norm_error / sums->count;
  }
  sums->squares = 0.0;
  sums->squares_before = kUnknown;
  for (PoseResidual& residual : *residuals) {
    if (residual.triad != triad) continue;
    const double size = std::abs(residual.norm_error);
    residual.norm_error -= mean;
    residual.residual = residual.norm_error * residual.direction;
    if (size > 0.0) residual.normalized *= std::abs(residual.norm_error) / size;
    sums->squares += residual.norm_error * residual.norm_error;
  }
}

// The RMS of `count` errors over the predicted RMS.
struct ErrorRatio {
  double ratio = 0.0;
  double count = 0.0;
  double noise_dof = 0.0;  // of the noise estimate; zero: the noise was stated

  // The F test allows for chance: the errors may be few, or the noise may have been estimated from
  // few residuals.
  bool IsTooLarge() const {
    // The degrees of freedom of a stated noise, which is exact. With so many, F equals χ² / count.
    constexpr double kStated = 1e6;
    if (!(ratio > kExpectedErrorRatio)) return false;
    if (count < 1.0) return true;
    const double dof = noise_dof > 0.0 ? std::min(noise_dof, kStated) : kStated;
    return FisherUpper(ratio * ratio, count, dof) < kByChance;
  }
};

std::vector<ErrorRatio> ErrorRatios(const EvaluationSummary& evaluation) {
  std::vector<ErrorRatio> ratios;
  const PerTriad<double>& noise_dof = evaluation.noise_dof;
  for (const Triad triad : kTriads) {
    if (!evaluation.error_ratio[triad]) continue;
    const auto poses =
        std::count_if(evaluation.pose_residuals.begin(),
                      evaluation.pose_residuals.end(),
                      [triad](const PoseResidual& residual) { return residual.triad == triad; });
    const double axes = triad == Triad::kGyroscope ? 3.0 : 1.0;
    ratios.push_back(
        {*evaluation.error_ratio[triad], axes * static_cast<double>(poses), noise_dof[triad]});
  }
  if (evaluation.angle_ratio) {
    const double dofs[] = {noise_dof[Triad::kAccelerometer], noise_dof[Triad::kMagnetometer]};
    // The estimated noise counts; if both are estimated, the one with fewer degrees of freedom.
    const double dof =
        dofs[0] > 0.0 && dofs[1] > 0.0 ? std::min(dofs[0], dofs[1]) : std::max(dofs[0], dofs[1]);
    ratios.push_back(
        {*evaluation.angle_ratio, static_cast<double>(evaluation.angles_rad.size()) - 1.0, dof});
  }
  if (const auto& turns = evaluation.turns; turns && turns->predicted_rms_rad > 0.0) {
    // Each turn error has two components, across gravity.
    ratios.push_back({turns->rms_rad / turns->predicted_rms_rad,
                      2.0 * turns->count,
                      noise_dof[Triad::kGyroscope]});
  }
  return ratios;
}

// States one triad's errors by its sums.
void StateSums(const Calibration& calibration,
               Triad triad,
               ErrorSums* sum,
               EvaluationSummary* summary) {
  if (sum->count == 0) {
    if (calibration.sensors[triad]) summary->not_tested.push_back(triad);
    return;
  }
  const double dof = calibration.sensors[triad]->noise.excess_dof;
  if (std::isfinite(dof)) summary->noise_dof[triad] = dof;
  summary->about_mean[triad] = !HasReference(calibration, triad);
  if (summary->about_mean[triad]) TakeMeanOut(triad, &summary->pose_residuals, sum);
  summary->norm_rms[triad] = std::sqrt(sum->squares / sum->count);
  summary->predicted_rms[triad] = std::sqrt(sum->expected / sum->count);
  summary->error_ratio[triad] = sum->joint.Rms(calibration.covariance.matrix);
  if (summary->about_mean[triad]) {
    summary->error_ratio[triad] = *summary->norm_rms[triad] / *summary->predicted_rms[triad];
  }
  if (std::isfinite(sum->squares_before)) {
    summary->norm_rms_before[triad] = std::sqrt(sum->squares_before / sum->count);
  }
}

// Adds every reading of every pose. Returns each pose's reading with which turns are compared.
Result<std::vector<std::optional<EvaluatedReading>>> AddPoses(const PosesLeftOut& left_out,
                                                              const Calibration& calibration,
                                                              const PoseSet& poses,
                                                              PerTriad<ErrorSums>* sums,
                                                              ConstantAngle* angle,
                                                              EvaluationSummary* summary) {
  std::vector<std::optional<EvaluatedReading>> vectors;
  PerTriad<std::vector<ThermalState>> felt;
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad] || poses.Find(triad) == nullptr) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(felt[triad], FeltAtPoses(*calibration.sensors[triad], poses));
  }
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    const StaticPose& pose = poses.poses[k];
    PerTriad<std::optional<EvaluatedReading>> seen;
    bool is_clamped = false;
    // The accelerometer first: a gyroscope's g-sensitivity needs the force.
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope}) {
      if (poses.Find(triad) == nullptr) continue;
      const auto& force = seen[Triad::kAccelerometer];
      TRUETRIAD_ASSIGN_OR_RETURN(seen[triad],
                                 EvaluateReading(calibration,
                                                 triad,
                                                 pose,
                                                 felt[triad].empty() ? nullptr : &felt[triad][k],
                                                 force ? std::optional(force->truth) : std::nullopt,
                                                 poses.source));
      if (left_out[triad].contains(pose.number)) seen[triad].reset();
      if (!seen[triad]) continue;
      is_clamped = is_clamped || seen[triad]->is_clamped;
      summary->pose_residuals.push_back(
          AddReading(calibration, pose, *poses.Find(triad), *seen[triad], &(*sums)[triad]));
    }
    if (is_clamped) ++summary->clamped_poses;
    if (seen[Triad::kAccelerometer] && seen[Triad::kMagnetometer]) {
      angle->Add(calibration, *seen[Triad::kAccelerometer], *seen[Triad::kMagnetometer]);
    }
    vectors.push_back(
        std::move(seen[calibration.sensors[Triad::kAccelerometer] ? Triad::kAccelerometer
                                                                  : Triad::kMagnetometer]));
  }
  return vectors;
}

}  // namespace

PosesLeftOut LeftOut(const Calibration& calibration, const PoseSet& poses, bool is_own) {
  PosesLeftOut numbers;
  if (!is_own || static_cast<std::size_t>(calibration.quality.poses) != poses.poses.size()) {
    return numbers;
  }
  for (const RejectedPose& rejected : calibration.quality.rests.rejected_poses) {
    numbers[rejected.triad].insert(rejected.pose);
  }
  return numbers;
}

Result<EvaluationSummary> EvaluateWithout(const PosesLeftOut& left_out,
                                          const Calibration& stated,
                                          const PoseSet& poses,
                                          bool is_own,
                                          const CountSizes& si_per_count) {
  if (!stated.IsUsable()) {
    return Error(ErrorCode::kCalibrationNotUsable,
                 "this calibration is not usable (" + std::string(stated.ReasonNotUsable()) +
                     "): there is nothing to evaluate");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration,
                             ForReadingsOf(poses, si_per_count, stated));
  EvaluationSummary summary;
  summary.is_own = is_own;
  summary.poses = static_cast<int>(poses.poses.size());
  PerTriad<ErrorSums> sums;
  ConstantAngle angle;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::optional<EvaluatedReading>> vectors,
                             AddPoses(left_out, calibration, poses, &sums, &angle, &summary));
  for (const Triad triad : kTriads) StateSums(calibration, triad, &sums[triad], &summary);
  angle.State(calibration, &summary);
  summary.turns = EvaluateTurns(calibration, poses, vectors, left_out[Triad::kGyroscope]);
  return summary;
}

Result<EvaluationSummary> Evaluate(const Calibration& calibration,
                                   const PoseSet& poses,
                                   bool is_own,
                                   const CountSizes& si_per_count) {
  return EvaluateWithout(
      LeftOut(calibration, poses, is_own), calibration, poses, is_own, si_per_count);
}

std::optional<double> WorstErrorRatio(const EvaluationSummary& evaluation) {
  std::optional<double> worst;
  for (const ErrorRatio& error : ErrorRatios(evaluation)) {
    worst = std::max(error.ratio, worst.value_or(0.0));
  }
  return worst;
}

PredictionVerdict VerdictOf(const EvaluationSummary& evaluation) {
  const bool has_poses =
      evaluation.turns || std::any_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
        return evaluation.norm_rms[triad].has_value();
      });
  if (!has_poses) return PredictionVerdict::kNotEvaluated;
  if (evaluation.is_own) return PredictionVerdict::kNoTest;
  const std::vector<ErrorRatio> ratios = ErrorRatios(evaluation);
  if (ratios.empty()) return PredictionVerdict::kNoPrediction;
  const bool is_worse = std::any_of(
      ratios.begin(), ratios.end(), [](const ErrorRatio& error) { return error.IsTooLarge(); });
  return is_worse ? PredictionVerdict::kWorse : PredictionVerdict::kAsPredicted;
}

std::string_view PredictionVerdictName(PredictionVerdict verdict) {
  constexpr NamedValues<PredictionVerdict, 5> kNames = {{
      {PredictionVerdict::kNotEvaluated, "not-evaluated"},
      {PredictionVerdict::kNoTest, "no-test"},
      {PredictionVerdict::kNoPrediction, "no-prediction"},
      {PredictionVerdict::kAsPredicted, "as-predicted"},
      {PredictionVerdict::kWorse, "worse"},
  }};
  return kNames.Name(verdict);
}

}  // namespace truetriad

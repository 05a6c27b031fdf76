// SPDX-License-Identifier: Apache-2.0
#include "verdict/face_tilts.h"

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>

#include "base/messages.h"
#include "math/distributions.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// If p is below this level, tilts beyond the stated ones are a warning, else a note.
constexpr double kShownLevel = 1e-4;
// If p is below this level, the larger tilt is used: this happens to one good fixture in twenty.
constexpr double kTakenLevel = 0.05;
// A combination of tilts is tested if readings reduce its prior variance by at least this share.
constexpr double kToldShare = 0.01;
// Probability that the larger tilt is still too small.
constexpr double kTooSmallByChance = 0.1;

// The covariance of tilts; `rows`: the rows of the basis that belong to these tilts.
template <typename Rows>
Eigen::MatrixXd CovarianceOf(const Rows& rows, const ReducedSystem& system) {
  return rows * system.covariance() * rows.transpose();
}

std::optional<TiltsSeen> TiltsAgainstStated(const PoseGraph& graph,
                                            const ReducedSystem& system,
                                            const AttitudeOptions& attitudes) {
  const SharedLayout& layout = graph.layout;
  std::vector<int> tilts;
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) tilts.insert(tilts.end(), {tilt, tilt + 1});
  }
  const bool is_known = system.size() > 0 && system.rank() == system.size();
  if (tilts.empty() || !is_known) return std::nullopt;
  const double stated_rad = attitudes.tilt_sigma_deg * kRadPerDeg;
  const Eigen::MatrixXd covariance = CovarianceOf(layout.basis(tilts, Eigen::all), system);
  const auto count = static_cast<Eigen::Index>(tilts.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> told(
      stated_rad * stated_rad * Eigen::MatrixXd::Identity(count, count) - covariance);
  const Eigen::VectorXd seen = told.eigenvectors().transpose() * graph.shared(tilts);
  double chi2 = 0.0;
  int dof = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double variance = told.eigenvalues()[i];
    if (!(variance > kToldShare * stated_rad * stated_rad)) continue;
    chi2 += seen[i] * seen[i] / variance;
    ++dof;
  }
  if (dof == 0) return std::nullopt;
  return TiltsSeen{
      1.0 - ChiSquareCdf(chi2, dof),
      attitudes.tilt_sigma_deg * std::sqrt(chi2 / ChiSquareQuantile(kTooSmallByChance, dof))};
}

}  // namespace

std::optional<TiltsSeen> TiltsBeyondStated(const PoseGraph& graph,
                                           const CalibrateOptions& options) {
  const bool is_asked =
      options.attitudes.kind == AttitudeKind::kSixFace && !options.attitudes.stated_tilt_sigma_deg;
  if (!is_asked || !graph.shared.allFinite()) return std::nullopt;
  const auto tilts = TiltsAgainstStated(graph, ReducedSystem(graph), options.attitudes);
  const bool is_beyond = tilts && tilts->p_value < kTakenLevel;
  return is_beyond ? tilts : std::nullopt;
}

CalibrateOptions WithTilts(const TiltsSeen& tilts, CalibrateOptions options) {
  options.attitudes.stated_tilt_sigma_deg = options.attitudes.tilt_sigma_deg;
  options.attitudes.tilt_sigma_deg = tilts.sigma_deg;
  return options;
}

Finding FindingOf(const TiltsSeen& tilts, const CalibrateOptions& options) {
  const double stated_deg = options.attitudes.tilt_sigma_deg;
  Finding finding(FindingCode::kFacesTilted,
                  Format("the faces are tilted by up to %.2g deg RMS, ", tilts.sigma_deg) +
                      Format("not %.2g deg as `tilt_sigma_deg` says; ", stated_deg) +
                      "σ assume the larger tilt",
                  Format("level the block, or state `attitudes: { six_face: { tilt_sigma_deg: "
                         "%.2g } }`",
                         tilts.sigma_deg));
  if (tilts.p_value > kShownLevel) finding.As(Severity::kNote);
  return finding.About(Triad::kAccelerometer)
      .With("tilt_sigma", tilts.sigma_deg, "deg")
      .With("p_value", tilts.p_value);
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "verdict/verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/recorded_temperature.h"
#include "problem/graph_builder.h"
#include "problem/known_motion_rows.h"
#include "problem/start_values.h"
#include "truetriad/math/rotation.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/checks/constancy.h"
#include "verdict/checks/held_gyroscope.h"
#include "verdict/checks/soak.h"
#include "verdict/observability.h"
#include "verdict/presentation.h"
#include "verdict/quality.h"

namespace truetriad {
namespace {

// Below this the noise level itself is hardly known: to 1 / sqrt(2 dof) of itself.
constexpr double kFewDof = 10.0;
// A fit whose residual is this share of the field does not explain the data.
constexpr double kExplainedShare = 0.1;
// A cap this wide without a pose is half of the sphere.
constexpr double kOneSidedGapDeg = 90.0;
// A magnetometer's gain this far from its unit is worth a word; normalised fields are used, too.
constexpr double kOddGain = 5.0;
// Within one pose; and the share of the recorded range without a rest that is worth a word.
constexpr double kMostChangeDegc = 3.0;
constexpr double kMostMissedShare = 0.1;
// A change of the magnetometer during the run is named when chance makes one in hundreds of runs; a
// run is refused for it when chance makes it in one of a million, so that no line sees a good unit
// refused, and when it moves a number by as much as the σ that is said.
constexpr double kRefusedChange = 1e-6;
constexpr double kMovedSigmas = 1.0;
// Over a recording without temperature terms that does not fit.
constexpr double kMuchTemperatureDegc = 10.0;
// χ² of a step that is left to go, and share of the typical sizes: the first alone is nothing where
// data without noise have made σ next to nothing.
constexpr double kShortChi2 = 0.01;
constexpr double kShortShare = 1e-6;

bool Wants(const CalibrateOptions& options, Triad triad) { return options.triads[triad].enabled; }

// A sensor with nothing but its units.
TriadCalibration InUnits(Triad triad, const PoseSet& poses) {
  TriadCalibration sensor;
  const StreamSummary* stream = poses.Find(triad);
  sensor.input_unit = stream != nullptr ? stream->unit.name : "";
  sensor.output_unit = std::string(TruthUnitName(triad));
  return sensor;
}

// Temperatures of the poses that count for a triad.
Eigen::Vector2d TemperatureRange(const PoseGraph& graph, Triad triad) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector2d range(kInfinity, -kInfinity);
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& observation : node.observations) {
      if (observation.triad != triad || observation.rejected) continue;
      range[0] = std::min(range[0], node.temperature_degc);
      range[1] = std::max(range[1], node.temperature_degc);
    }
  }
  return range;
}

// The sensors of a usable solution.
void StateSensors(const SettledRun& run,
                  const PresentedSolution& solution,
                  Calibration* calibration) {
  const NoiseState& noise = run.noise;
  for (const Triad triad : kTriads) {
    if (!Wants(run.options, triad)) continue;
    TriadCalibration sensor = SensorOf(triad, run.poses, solution);
    if (sensor.thermal) sensor.thermal->range_degc = TemperatureRange(run.graph, triad);
    // RMS over poses of each axis' σ.
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    int count = 0;
    const bool has_rests =
        std::any_of(run.graph.nodes.begin(), run.graph.nodes.end(), [](const PoseNode& node) {
          return node.role == PoseRole::kRest;
        });
    for (const PoseNode& node : run.graph.nodes) {
      if (node.role != (has_rests ? PoseRole::kRest : PoseRole::kRate)) continue;
      for (const Observation& observation : node.observations) {
        if (observation.triad != triad || observation.rejected) continue;
        rest += observation.rest_covariance.diagonal();
        total += observation.variance.diagonal();
        ++count;
      }
    }
    sensor.noise.source = noise.source[triad];
    const bool residual = noise.source[triad] == NoiseSource::kResidual;
    sensor.noise.sigma = ((residual ? total : rest) / std::max(count, 1)).cwiseSqrt();
    sensor.noise.excess_sigma = residual ? 0.0 : std::sqrt(noise.excess[triad]);
    sensor.noise.excess_dof = ExcessDegreesOfFreedom(noise.estimate, run.graph, PoseNoise(triad));
    if (triad == Triad::kGyroscope) {
      sensor.noise.turn_excess_sigma_rad = std::sqrt(noise.excess[NoiseComponent::kTurn]);
    }
    calibration->sensors[triad] = sensor;
  }
}

int CountRests(const PoseGraph& graph) {
  return static_cast<int>(
      std::count_if(graph.nodes.begin(), graph.nodes.end(), [](const PoseNode& node) {
        return node.role == PoseRole::kRest;
      }));
}

void StateRejected(const PoseGraph& graph, Quality* quality) {
  for (const IncrementEdge& edge : graph.increments) {
    if (!edge.rejected || edge.stated_turn >= 0) continue;
    quality->rejected_poses.push_back({graph.nodes[edge.from + 1].number,
                                       Triad::kGyroscope,
                                       "the turn into it from pose " +
                                           std::to_string(graph.nodes[edge.from].number) +
                                           " disagrees with all others"});
  }
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      const auto at =
          std::find_if(quality->pose_residuals.begin(),
                       quality->pose_residuals.end(),
                       [&](const auto& residual) {
                         return residual.pose == node.number && residual.triad == observation.triad;
                       });
      quality->rejected_poses.push_back(
          {node.number,
           observation.triad,
           Format("disagrees with all other poses by %.1f times its noise", at->normalized)});
    }
  }
}

// χ² of the residuals over their degrees of freedom.
double ReducedChi2(const ReducedSystem& system, double dof) {
  return (system.residual() + system.J() * system.step()).dot(system.projected()) / dof;
}

// χ² against all noise, and against the noise inside rests alone where that is known.
void StateChi2(const SettledRun& run, const ReducedSystem& system, double dof, Quality* quality) {
  quality->reduced_chi2 = std::numeric_limits<double>::quiet_NaN();
  quality->reduced_chi2_before = std::numeric_limits<double>::quiet_NaN();
  if (dof < 1.0) return;
  quality->reduced_chi2 = ReducedChi2(system, dof);
  for (const Triad triad : kTriads) {
    if (Wants(run.options, triad) && run.noise.source[triad] == NoiseSource::kResidual) return;
  }
  PoseGraph rests = run.graph;
  ApplyExcess(ExcessVariance{}, &rests);
  quality->reduced_chi2_before = ReducedChi2(ReducedSystem(rests), dof);
}

constexpr char kNotDetermined[] =
    "the poses do not determine every wanted parameter; see the weak directions";

// Why a solution cannot be used.
struct Refusal {
  Outcome outcome = Outcome::kNotCalled;
  std::string message;
  bool is_about_noise = false;
};

// In a flat and curved valley an optimiser may take steps so short that it thinks it is there. What
// Newton's method would still go tells.
bool IsShort(const ReducedSystem& system) {
  const double chi2 = system.step().dot(system.information() * system.step());
  const double share = system.step().cwiseQuotient(system.scale()).cwiseAbs().maxCoeff();
  return chi2 > kShortChi2 && share > kShortShare;
}

// A sensor most of whose poses were left out, or so many that the others determine too little: its
// noise was stated, and is not what the poses show. Empty where there is none.
std::string WhyTooManyAreLeftOut(const SettledRun& run, bool determined) {
  const double most = determined ? 0.5 : 0.25;
  std::size_t tests = run.graph.increments.size();
  for (const PoseNode& node : run.graph.nodes) tests += node.observations.size();
  for (const Triad triad : kTriads) {
    if (!Wants(run.options, triad)) continue;
    const Eigen::Matrix3d C = run.graph.sensitivity(triad).inverse();
    int rejected = 0, all = 0;
    double variance = 0.0;
    for (const PoseNode& node : run.graph.nodes) {
      for (const Observation& seen : node.observations) {
        if (seen.triad != triad || node.role != PoseRole::kRest) continue;
        ++all;
        rejected += seen.rejected ? 1 : 0;
        variance += (C * seen.variance * C.transpose()).trace() / 3.0;
      }
    }
    if (!(rejected > most * all)) continue;
    const std::string name(TriadName(triad));
    const bool is_estimated =
        std::find(run.noise.estimated.begin(), run.noise.estimated.end(), PoseNoise(triad)) !=
        run.noise.estimated.end();
    const std::string noise =
        Format(" of %.2g ", std::sqrt(variance / all)) + std::string(TruthUnitName(triad));
    return name + ": " + std::to_string(rejected) + " of " + std::to_string(all) +
           " poses were left out, being off by more than " + Format("%.1f σ", RejectedFrom(tests)) +
           noise + "; so many are not disturbed, and what is left cannot be trusted: " +
           (is_estimated
                ? "the readings do not fit the model"
                : "the poses scatter by more than that σ; let it be estimated "
                  "(`sensors: { " +
                      name + ": { noise: { excess: estimate } } }`), or state a larger noise");
  }
  return {};
}

std::optional<Refusal> WhyUnusable(const SettledRun& run,
                                   const Quality& quality,
                                   const ReducedSystem& system,
                                   bool determined) {
  if (run.noise.unknown) {
    return Refusal{
        Outcome::kNotEnough,
        "every residual is needed to determine the parameters, so the noise cannot be estimated; "
        "add poses, or state `noise: { sigma: [x, y, z] }`"};
  }
  for (const Triad triad : kTriads) {
    if (!Wants(run.options, triad) || !quality.residual_rms[triad]) continue;
    if (triad == Triad::kGyroscope) continue;  // at rest it sees no field
    const double share =
        *quality.residual_rms[triad] / WorldVector(triad, run.graph.reference()).norm();
    if (share <= kExplainedShare) continue;
    return Refusal{
        Outcome::kNotConverged,
        std::string(TriadName(triad)) +
            Format(": after the fit the readings still scatter by %.0f %%", 100.0 * share) +
            " of the field; these are not rests in one constant field"};
  }
  // Before convergence: along a direction that is not determined the optimiser only creeps.
  if (!determined || system.rank() < system.size()) {
    if (const std::optional<Eigen::Vector2d>& range = run.poses.temperature_range_degc;
        range && !run.options.HasThermal() && (*range)[1] - (*range)[0] > kMuchTemperatureDegc &&
        2 * quality.rejected_poses.size() > run.graph.nodes.size()) {
      return Refusal{
          Outcome::kNotConverged,
          Format("most poses disagree with one model, and the temperature went from %.0f ",
                 (*range)[0]) +
              Format("to %.0f degC: estimate temperature terms (`thermal:`), or record "
                     "at one temperature",
                     (*range)[1])};
    }
    if (std::string words = WhyTooManyAreLeftOut(run, /*determined=*/false); !words.empty()) {
      return Refusal{Outcome::kNotConverged, std::move(words), /*is_about_noise=*/true};
    }
    return Refusal{Outcome::kNotObservable, kNotDetermined};
  }
  if (std::string words = WhyTooManyAreLeftOut(run, /*determined=*/true); !words.empty()) {
    return Refusal{Outcome::kNotConverged, std::move(words), /*is_about_noise=*/true};
  }
  if (!run.converged || IsShort(system)) {
    return Refusal{
        Outcome::kNotConverged,
        "the optimiser did not converge: the readings do not fit the model from any start"};
  }
  return std::nullopt;
}

// "between pose 12 and pose 13 (61.2 s after the first)"; where others are as likely, "somewhere
// between pose 10 and pose 14, most likely …".
std::string PlaceOfChange(const SettledRun& run, const MagnetometerChange& change) {
  const auto between = [&](std::size_t first, std::size_t second) {
    return "between pose " + std::to_string(run.graph.nodes[first].number) + " and pose " +
           std::to_string(run.graph.nodes[second].number);
  };
  const int after = run.graph.nodes[change.node].number;
  std::string text = between(change.node - 1, change.node);
  if (change.earliest < change.latest) {
    text = "somewhere " + between(change.earliest - 1, change.latest) + ", most likely " + text;
  }
  if (!run.poses.has_time) return text;
  for (const StaticPose& pose : run.poses.poses) {
    const std::int64_t begin_ns = run.poses.poses.front().start_ns;
    if (pose.number != after || pose.start_ns == begin_ns) continue;
    text +=
        Format(" (%.1f s after the first)", 1e-9 * static_cast<double>(pose.start_ns - begin_ns));
  }
  return text;
}

// What happened to the magnetometer, and what to do about it.
std::string WordsOf(const SettledRun& run, const MagnetometerChange& change) {
  const std::string bias =
      Format("its bias differs by %.2g uT from there on", change.bias_ut.norm());
  const Eigen::Vector3d field = WorldVector(Triad::kMagnetometer, run.graph.reference());
  const Eigen::Vector3d later = field + change.field_ut;
  const double turned_deg = std::atan2(field.cross(later).norm(), field.dot(later)) * 180.0 / M_PI;
  const std::string world = Format("the field differs by %.2g uT ", change.field_ut.norm()) +
                            Format("(%+.2g uT in strength, ", later.norm() - field.norm()) +
                            Format("%.2g deg in direction) from there on", turned_deg);
  std::string text = "the magnetometer's readings changed " + PlaceOfChange(run, change) + ": ";
  switch (change.kind) {
    case ChangeKind::kBias:
      text += bias + ", as when iron or a magnet on the unit moves";
      break;
    case ChangeKind::kField:
      text += world + ", as when the unit or iron about it is moved";
      break;
    case ChangeKind::kEither:
      text += "either " + bias + ", or " + world;
      break;
  }
  text += Format("; without it numbers are off by up to %.2g σ", change.effect_sigmas) +
          Format(" (by chance: %.1g)", change.p_value);
  const std::optional<Eigen::Vector2d>& range = run.poses.temperature_range_degc;
  if (range && (*range)[1] - (*range)[0] > kMuchTemperatureDegc) {
    text += Format(
        "; the temperature changed by %.0f degC, too: temperature terms that are missing, or of "
        "too low an order, look the same",
        (*range)[1] - (*range)[0]);
  }
  return text + "; take the run again, or the poses of one side alone";
}

// Whether a change makes the result another than its σ say, before or after it.
bool IsBeyondSigma(const MagnetometerChange& change) {
  return change.p_value < kRefusedChange && change.effect_sigmas > kMovedSigmas;
}

// Where the temperature went on to the next, and σ count that the bias drifts between the two.
bool IsDrift(const PoseGraph& graph,
             const MagnetometerChange& change,
             const DriftCovariance& drift) {
  return drift.sigma_raw[Triad::kMagnetometer] > 0.0 && IsBetweenSettings(graph, change.node);
}

// What makes temperature terms less than they seem.
void SayThermalRemarks(const SettledRun& run, Messages* messages) {
  Eigen::Vector2d range(std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity());
  int changing = 0;
  double largest = 0.0;
  int worst = 0;
  for (const StaticPose& pose : run.poses.poses) {
    if (!pose.temperature_degc) continue;
    range[0] = std::min(range[0], *pose.temperature_degc);
    range[1] = std::max(range[1], *pose.temperature_degc);
    const double change = std::abs(pose.temperature_rate_degcps) * pose.duration_s();
    if (change > kMostChangeDegc) ++changing;
    if (change > largest) {
      largest = change;
      worst = pose.number;
    }
  }
  if (changing > 0) {
    messages->push_back(
        Format("the temperature moved by more than %.0f degC within ", kMostChangeDegc) +
        std::to_string(changing) + " pose(s), most in pose " + std::to_string(worst) +
        Format(" (%.1f degC): their means belong to no one temperature; state the rests "
               "(`poses: { file: … }`) or wait longer before each pose",
               largest));
  }
  const double reference = run.options.reference.temperature_degc;
  if (reference < range[0] || reference > range[1]) {
    messages->push_back(
        Format("the reference temperature, %.1f degC, lies outside of the poses' ", reference) +
        Format("%.1f to ", range[0]) +
        Format("%.1f degC: bias and sensitivity there, and what limits judge, are extrapolated",
               range[1]));
  }
  const Eigen::Vector2d& recorded = run.poses.temperature_range_degc.value_or(range);
  const double missed = std::max(range[0] - recorded[0], recorded[1] - range[1]);
  if (missed > kMostMissedShare * (recorded[1] - recorded[0])) {
    messages->push_back(
        Format("the recording reaches %.1f to ", recorded[0]) +
        Format("%.1f degC, its rests only ", recorded[1]) + Format("%.1f to ", range[0]) +
        Format("%.1f degC: were rests at the ends missed? (`truetriad inspect`)", range[1]));
  }
}

// A curve through all temperatures.
void SayUnchecked(const Calibration& calibration, Messages* messages) {
  for (const Triad triad : kTriads) {
    const auto& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal || sensor->thermal->bias.empty()) continue;
    const auto& settings = calibration.quality.temperature_settings;
    const auto count = std::count_if(settings.begin(), settings.end(), [&](const auto& setting) {
      return setting.triad == triad;
    });
    if (count != static_cast<std::ptrdiff_t>(sensor->thermal->bias.size()) + 1) continue;
    messages->push_back(std::string(TriadName(triad)) + ": the bias' curve goes through all " +
                        std::to_string(count) +
                        " temperatures: nothing checks it between them, and σ do not count how it "
                        "may be there; add a temperature");
  }
}

// Drift from one temperature to the next, or an order that is too low.
void SayDrift(const DriftCovariance& drift, const Calibration& calibration, Messages* messages) {
  for (const Triad triad : kTriads) {
    if (drift.sigma_raw[triad] <= 0.0) continue;
    messages->push_back(
        std::string(TriadName(triad)) +
        Format(": the poses of one temperature share %.2g ", drift.sigma_raw[triad]) +
        calibration.sensors[triad]->input_unit +
        " of bias (σ) that the temperature terms do not explain; σ count it as drawn anew at each: "
        "the bias drifts, the order is too low, or it has a knee, which a sweep with `knots` "
        "shows");
  }
}

// The parameters whose variance came out negative, the first few; empty when none did.
std::string WithoutVariance(const NamedCovariance& covariance) {
  constexpr int kNamed = 3;
  std::string names;
  int count = 0;
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (!(covariance.matrix(at, at) < 0.0) || ++count > kNamed) continue;
    names += (names.empty() ? "" : ", ") + covariance.parameters[i];
  }
  return names + (count > kNamed ? ", …" : "");
}

// Triads whose readings hold no noise to speak of.
void SayNoNoise(const SettledRun& run, const Calibration& calibration, Messages* messages) {
  constexpr double kHardlyMore = 2.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const auto& sensor = calibration.sensors[triad];
    const NoiseSource source = run.noise.source[triad];
    if (!sensor || (source != NoiseSource::kStatic && source != NoiseSource::kResidual)) continue;
    const double field = WorldVector(triad, run.graph.reference()).norm();
    const Eigen::Vector3d sigma = sensor->model.Correction().cwiseAbs() * sensor->noise.sigma;
    if (sigma.maxCoeff() + sensor->noise.excess_sigma > kHardlyMore * kLeastNoiseShare * field) {
      continue;
    }
    messages->push_back(std::string(TriadName(triad)) +
                        Format(": its readings hold no noise; σ are what %.0e of the field would "
                               "make, and no estimate",
                               kLeastNoiseShare));
  }
}

// What the reader of a usable result should know besides its numbers.
void SayRemarks(const SettledRun& run, const Calibration& calibration, Messages* messages) {
  const CalibrateOptions& options = run.options;
  const Quality& quality = calibration.quality;
  if (!run.noise.estimated.empty() && quality.effective_dof < kFewDof) {
    messages->push_back(
        Format("σ rests on few (%.1f) degrees of freedom: use the stated interval factor, not 2 σ",
               quality.effective_dof));
  }
  const auto& magnetometer = calibration.sensors[Triad::kMagnetometer];
  if (magnetometer && Wants(options, Triad::kAccelerometer) &&
      run.graph.sensitivity(Triad::kMagnetometer).determinant() < 0.0) {
    messages->emplace_back(kLeftHandedMagnetometer);
  }
  const auto& gyroscope = calibration.sensors[Triad::kGyroscope];
  if (gyroscope && gyroscope->model.sensitivity.determinant() < 0.0) {
    messages->emplace_back(kLeftHandedGyroscope);
  }
  if (gyroscope) {
    std::string remark = RemarkOnHeldGyroscope(options, gyroscope->noise.turn_excess_sigma_rad);
    if (!remark.empty()) messages->push_back(std::move(remark));
  }
  if (std::string words = WordsOf(quality.clock_offsets, run.poses); !words.empty()) {
    messages->push_back(std::move(words));
  }
  SayNoNoise(run, calibration, messages);
  for (const Coverage& coverage : quality.coverage) {
    if (coverage.largest_gap_deg < kOneSidedGapDeg) continue;
    messages->push_back(
        std::string(TriadName(coverage.triad)) +
        Format(": no pose within %.0f deg of one direction; nothing checks the model on that side",
               coverage.largest_gap_deg));
  }
  if (options.HasThermal()) SayThermalRemarks(run, messages);
  if (const auto recorded = RecordedDegc(run.poses); recorded && !options.HasThermal()) {
    std::string words =
        Format("recorded at %.1f", (*recorded)[0]) +
        Format(" to %.1f degC; no temperature terms were estimated", (*recorded)[2]);
    const double reference = options.reference.temperature_degc;
    if (std::abs((*recorded)[1] - reference) > kMuchTemperatureDegc) {
      words += Format(": bias and sensitivity are those there, not at the reference of %.1f degC",
                      reference);
    }
    messages->push_back(std::move(words));
  }
  if (magnetometer && options.reference.field_ut.known()) {
    const Unit& unit = run.poses.Find(Triad::kMagnetometer)->unit;
    const double gain =
        std::cbrt(std::abs(magnetometer->model.sensitivity.determinant())) * unit.truth_per_raw;
    if (!unit.is_counts && (gain > kOddGain || gain < 1.0 / kOddGain)) {
      messages->push_back(Format("the magnetometer's gain is %.4g times what ", gain) + unit.name +
                          " means at the stated field strength: check the unit and strength_ut");
    }
  }
  if (calibration.reference.field_nominal) {
    messages->push_back(
        Format("field strength unknown: the magnetometer's common scale is not observable, "
               "strength fixed to %.6g uT",
               *calibration.reference.field_ut));
  }
}

}  // namespace

TriadCalibration SensorOf(Triad triad, const PoseSet& poses, const PresentedSolution& solution) {
  TriadCalibration sensor = InUnits(triad, poses);
  sensor.model = *solution.models[triad];
  sensor.thermal = solution.thermal[triad];
  if (triad == Triad::kGyroscope) sensor.g_sensitivity = solution.g_sensitivity;
  const int at = PlaceOf(solution.covariance, {triad, ParameterKind::kBias, 0, 0, 0});
  const Eigen::VectorXd variance = solution.covariance.matrix.diagonal().segment(at, 12);
  for (int i = 0; i < 3; ++i) {
    sensor.bias_sigma[i] = std::sqrt(std::max(variance[i], 0.0));
    for (int j = 0; j < 3; ++j) {
      sensor.sensitivity_sigma(i, j) = std::sqrt(std::max(variance[3 + 3 * i + j], 0.0));
    }
  }
  const auto term_sigma = [&](ParameterKind kind) -> std::optional<Eigen::Vector3d> {
    const int place = PlaceOf(solution.covariance, {triad, kind, 0, 0, 0});
    if (place < 0) return std::nullopt;
    return solution.covariance.matrix.diagonal().segment<3>(place).cwiseMax(0.0).cwiseSqrt();
  };
  sensor.quadratic_sigma = term_sigma(ParameterKind::kQuadratic);
  sensor.asymmetry_sigma = term_sigma(ParameterKind::kAsymmetry);
  return sensor;
}

void StateReference(const CalibrateOptions& options,
                    const PoseGraph& graph,
                    ReferenceValues* stated) {
  const SharedLayout& layout = graph.layout;
  const ReferenceOptions& wanted = options.reference;
  const ReferenceVector reference = graph.reference();
  stated->gravity_mps2 = reference[kGravity];
  if (options.attitudes.unknown_fixture_rotation) {
    // World vectors: v_fixture = R_level^T Exp(-tilt) Rz(heading) v_world.
    const Eigen::Vector3d tilt(reference[kFixtureTilt], reference[kFixtureTilt + 1], 0.0);
    const Eigen::Quaterniond q = graph.level_from_fixture.conjugate() * RotationExp(-tilt) *
                                 RotationExp({0.0, 0.0, reference[kHeading]});
    stated->fixture_from_world = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  }
  if (wanted.gravity_mps2.sigma > 0.0) stated->gravity_sigma_mps2 = wanted.gravity_mps2.sigma;
  if (!Wants(options, Triad::kMagnetometer)) return;
  const bool field_free = layout.IsFree(layout.reference + kField);
  const bool dip_free = layout.IsFree(layout.reference + kDip);
  stated->field_ut = reference[kField];
  stated->field_nominal = !wanted.field_ut.known() && !field_free;
  stated->field_estimated = field_free || dip_free;
  if (dip_free || wanted.dip_rad.known()) stated->dip_rad = reference[kDip];
}

Status StateLimits(const CalibrateOptions& options,
                   const PoseSet& poses,
                   Calibration* calibration) {
  auto limits = JudgeLimits(*calibration, poses, options.limits);
  if (!limits) return limits.error();
  calibration->quality.limits = std::move(*limits);
  if (!calibration->quality.limits.empty()) {
    calibration->within_limits = std::all_of(calibration->quality.limits.begin(),
                                             calibration->quality.limits.end(),
                                             [](const LimitCheck& check) { return check.pass; });
  }
  return {};
}

Status StateVerdict(const SettledRun& run, Calibration* calibration) {
  const CalibrateOptions& options = run.options;
  const PoseGraph& graph = run.graph;
  Quality& quality = calibration->quality;
  const ReducedSystem system(graph);
  quality.poses = CountRests(graph);
  quality.dof = ResidualDof(graph, system);
  const JointTest joint = KenwardRogerTest(run.noise.estimate, system);
  quality.temperature_settings = FindTemperatureSettings(graph);
  const DriftCovariance drift = FindDriftCovariance(graph, system, quality.temperature_settings);
  quality.effective_dof = std::min(joint.dof, drift.dof);
  // The joint test's scale goes into the covariance, so that F(dim, ν) holds for it as printed.
  const Eigen::MatrixXd covariance =
      AdjustedCovariance(run.noise.estimate, system) / joint.scale + drift.covariance;
  StateReference(options, graph, &calibration->reference);

  Observability observability =
      AnalyseObservability(graph, system.shared(), options.observable_sigma);
  quality.weak_directions = std::move(observability.weak_directions);

  PresentedSolution solution = SolvedFrame(graph, covariance);
  StateInGauge(options.gauge, LeadingTriad(options), LeadingAxisSign(options), &solution);
  const TurnErrors turns = FindTurnErrors(graph, system, run.poses);
  FillPoseQuality(graph, solution, DeletionTests(graph, system), turns, run.poses, &quality);
  StateRejected(graph, &quality);
  if (Wants(options, Triad::kGyroscope)) {
    quality.turns =
        CheckTurns(run.poses, graph, covariance, run.noise.excess[NoiseComponent::kTurn]);
  }
  StateChi2(run, system, quality.dof, &quality);

  if (!graph.shared.allFinite() || !solution.covariance.matrix.allFinite() ||
      solution.covariance.matrix.diagonal().minCoeff() < 0.0) {
    std::vector<WeakDirection> weak = std::move(quality.weak_directions);
    quality = Quality{};
    quality.poses = CountRests(graph);
    // More often than not too little data is what makes them leave it.
    if (graph.shared.allFinite() && !weak.empty()) {
      quality.weak_directions = std::move(weak);
      calibration->outcome = Outcome::kNotObservable;
      calibration->messages.emplace_back(kNotDetermined);
      return {};
    }
    const std::string lost = WithoutVariance(solution.covariance);
    if (graph.shared.allFinite() && !lost.empty()) {
      calibration->outcome = Outcome::kNotObservable;
      calibration->messages.push_back("the poses hardly determine " + lost +
                                      ": no σ can be computed for it; leave the term out, or add "
                                      "poses and turns that show it");
      return {};
    }
    calibration->outcome = Outcome::kNotConverged;
    const bool has_asymmetry = options.triads[Triad::kGyroscope].asymmetry == Wanted::kYes;
    calibration->messages.push_back(
        std::string("the numbers left the range that can be computed with; ") +
        (has_asymmetry ? "an asymmetry that the turns hardly show does so: leave it out, or say "
                         "`asymmetry: auto`"
                       : "look for absurd readings, σ or held values"));
    return {};
  }
  // First: what a change in the middle of the run does to the fit may look like anything else.
  if (const auto change = FindMagnetometerChange(graph, system, run.noise)) {
    calibration->messages.push_back(WordsOf(run, *change));
    if (IsBeyondSigma(*change) && !IsDrift(graph, *change, drift)) {
      calibration->outcome = Outcome::kNotConverged;
      return {};
    }
  }
  if (auto refusal = WhyUnusable(run, quality, system, observability.determined)) {
    calibration->outcome = refusal->outcome;
    // More poses like those that were left out would not help.
    if (refusal->is_about_noise) quality.weak_directions.clear();
    calibration->messages.push_back(std::move(refusal->message));
    return {};
  }
  calibration->outcome = Outcome::kConverged;
  calibration->covariance = solution.covariance;
  StateSensors(run, solution, calibration);
  quality.held_out = CrossValidate(graph, turns, options.cross_validation_folds);
  quality.clock_offsets = FindClockOffsets(run.poses, graph);
  SayRemarks(run, *calibration, &calibration->messages);
  SayDrift(drift, *calibration, &calibration->messages);
  SayUnchecked(*calibration, &calibration->messages);
  return StateLimits(options, run.poses, calibration);
}

void StateStart(const PoseSet& poses,
                const CalibrateOptions& options,
                const NoiseState& noise,
                const StartValues& start,
                const PoseGraph& graph,
                Calibration* calibration) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix3d Q = GaugeRotation(
      options.gauge, start.models[LeadingTriad(options)]->sensitivity, LeadingAxisSign(options));
  for (const Triad triad : kTriads) {
    if (!start.models[triad]) continue;
    TriadCalibration sensor = InUnits(triad, poses);
    sensor.model = {start.models[triad]->sensitivity * Q, start.models[triad]->bias};
    sensor.bias_sigma.setConstant(unknown);
    sensor.sensitivity_sigma.setConstant(unknown);
    sensor.noise.sigma.setConstant(unknown);
    sensor.noise.source = noise.source[triad];
    calibration->sensors[triad] = sensor;
    if (triad == Triad::kGyroscope) continue;  // no field to compare with
    const double strength = WorldVector(triad, start.reference).norm();
    double sum = 0.0;
    int count = 0;
    for (const PoseNode& node : graph.nodes) {
      for (const Observation& observation : node.observations) {
        if (observation.triad != triad) continue;
        const double error = NormError(sensor.model, observation.mean_raw, strength);
        sum += error * error;
        ++count;
      }
    }
    if (count > 0) calibration->quality.residual_rms[triad] = std::sqrt(sum / count);
  }
  calibration->reference.gravity_mps2 = start.reference[kGravity];
  if (Wants(options, Triad::kMagnetometer)) {
    calibration->reference.field_ut = start.reference[kField];
    calibration->reference.field_nominal = start.field_nominal;
    if (Wants(options, Triad::kAccelerometer))
      calibration->reference.dip_rad = start.reference[kDip];
  }
  calibration->quality.poses = CountRests(graph);
  calibration->quality.reduced_chi2 = unknown;
  calibration->quality.reduced_chi2_before = unknown;
  calibration->outcome = Outcome::kConverged;
  calibration->messages.emplace_back("start values only, as asked: no refinement, no uncertainty");
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "start/start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <Eigen/LU>

#include "base/sensor_line.h"
#include "init/ellipsoid_fit.h"
#include "init/fixture_fit.h"
#include "init/frame_alignment.h"
#include "init/gyro_start.h"
#include "init/six_position.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/known_motion_rows.h"
#include "problem/lay_out.h"
#include "problem/moves.h"
#include "problem/pose_state.h"
#include "start/triad_fits.h"
#include "start/why_no_start.h"
#include "truetriad/base/triad.h"
#include "truetriad/math/rotation.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

// A magnetometer in counts in an unknown field has no natural scale: 50 uT is a mid-latitude field.
constexpr double kNominalFieldUt = 50.0;
// Chosen: if a log states a physical unit, a gain outside 1/4 to 4 means that the unit is wrong.
constexpr double kLargestSiGain = 4.0;
// Chosen: at most four rival alignments, which differ by signs and mirrors, become starts.
constexpr std::size_t kMaxCandidates = 4;
// For a start, stated rates within 0.1 % of their median are treated as equal.
constexpr double kSameSpeed = 1e-3;

// `may_be_faces`: the unit may have stood on its six faces, so the remedy names `six_face`.
Status CheckCount(Triad triad,
                  std::size_t poses,
                  const TriadOptions& options,
                  bool attitudes,
                  bool may_be_faces) {
  // Least number of poses: a diagonal model has six unknowns, a bias three; one more checks them.
  constexpr std::size_t kForDiagonal = 6, kForBias = 4;
  std::size_t needed = 9;
  if (options.fixed_sensitivity || options.model == MatrixModel::kBias || attitudes) {
    needed = kForBias;
  } else if (options.model == MatrixModel::kDiagonal) {
    needed = kForDiagonal;
  }
  const std::size_t of_matrix = needed;
  std::string model = "model `" + std::string(MatrixModelName(options.model)) + "`";
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad == Triad::kGyroscope || options.axis_terms[info.term] != Wanted::kYes) continue;
    // An axis term has three unknowns. A pose gives three equations with its attitude, else one.
    needed += attitudes ? 1 : 3;
    model += " with " + WithArticle(info.words);
  }
  if (poses >= needed) return {};
  // The axis terms need their additional poses with a smaller matrix as well.
  const auto suffices = [&](std::size_t smaller) {
    return smaller < of_matrix && poses + of_matrix >= needed + smaller;
  };
  std::string smaller;
  if (suffices(kForDiagonal)) {
    smaller = "choose a smaller model, as by " + SensorLine(triad, "model: diagonal");
  } else if (suffices(kForBias)) {
    smaller = "estimate the bias alone, as by " + SensorLine(triad, "model: bias");
  }
  const std::string noun = triad == Triad::kGyroscope ? "known rate" : "pose";
  may_be_faces = may_be_faces && !attitudes && poses >= 6;
  std::string remedy = "add " + noun + "s";
  if (!smaller.empty()) remedy += (may_be_faces ? ", " : ", or ") + smaller;
  if (may_be_faces) {
    remedy += ", or, if the unit stood on its six faces, state `attitudes: { six_face: {} }`";
  }
  return NotEnoughError(Finding(FindingCode::kTooFewPoses,
                                std::string(TriadName(triad)) + ": " + std::to_string(poses) + " " +
                                    noun + (poses == 1 ? ", but " : "s, but ") + model +
                                    " needs at least " + std::to_string(needed),
                                remedy)
                            .About(triad)
                            .With("poses", static_cast<double>(poses))
                            .With("needed", static_cast<double>(needed)));
}

// Refuses a gain that is off by a factor above 4 in the stated attitudes. WhyNotAsStated has
// checked already that the readings have gravity's length.
Status CheckAccelerometerGain(const PoseSet& poses,
                              const CalibrateOptions& options,
                              const std::vector<Eigen::Vector3d>& readings,
                              const TriadModel<double>& model) {
  const StreamSummary* stream = poses.Find(Triad::kAccelerometer);
  if (stream == nullptr || stream->unit.is_counts || !options.check_units) return {};
  if (options.attitudes.kind == AttitudeKind::kNone) return {};
  const double gain =
      std::cbrt(std::abs(model.sensitivity.determinant())) * stream->unit.truth_per_raw;
  if (gain < kLargestSiGain && gain > 1.0 / kLargestSiGain) return {};
  if (!Acts(Mechanism::kUnitAtStart)) return {};
  std::vector<double> norms;
  for (const Eigen::Vector3d& reading : readings) norms.push_back(reading.norm());
  return Error(ErrorCode::kDoesNotMatch,
               {poses.source},
               "the accelerometer reads gravity at rest (" + std::to_string(Median(norms)) + " " +
                   stream->unit.name +
                   ", median norm), but in the stated attitudes its gain is off by a factor above "
                   "4: check for exchanged faces or attitudes, or another frame convention");
}

// The six-position solution with known forces. If there is one rest per face and the readings are
// in a physical unit, it is the analytic solution, which takes each column from one face. Otherwise
// it is a least-squares fit over all rests.
Result<TriadModel<double>> SixPositionStart(const PoseSet& poses,
                                            const std::vector<Eigen::Vector3d>& readings,
                                            const std::vector<Eigen::Vector3d>& forces,
                                            double gravity) {
  if (forces.size() != readings.size()) {
    return Error(ErrorCode::kDoesNotMatch,
                 {poses.source},
                 std::to_string(readings.size()) + " poses, but `initialise.forces` has " +
                     std::to_string(forces.size()) +
                     " forces; expected one row per pose, in the same order");
  }
  const auto faces = AssignFaces(forces);
  const StreamSummary* stream = poses.Find(Triad::kAccelerometer);
  if (!faces || forces.size() != 6 || stream == nullptr || stream->unit.is_counts) {
    return FitInKnownField(readings, forces);
  }
  // SixPositionKnownForce wants -z, +z, -y, +y, +x, -x and readings in the forces' unit.
  std::array<Eigen::Vector3d, 6> ordered_readings;
  std::array<Eigen::Vector3d, 6> ordered_forces;
  for (std::size_t k = 0; k < 6; ++k) {
    constexpr std::array<std::size_t, 6> kPlaces = {4, 5, 3, 2, 1, 0};  // Of +x, -x, ….
    const std::size_t place = kPlaces[static_cast<std::size_t>((*faces)[k])];
    ordered_readings[place] = readings[k] * stream->unit.truth_per_raw;
    ordered_forces[place] = forces[k];
  }
  TriadModel<double> model = SixPositionKnownForce(ordered_readings, ordered_forces, gravity);
  model.sensitivity /= stream->unit.truth_per_raw;
  model.bias /= stream->unit.truth_per_raw;
  return model;
}

Result<TriadModel<double>> AccelerometerStart(const PoseSet& poses,
                                              const CalibrateOptions& options) {
  const TriadOptions& triad = options.triads[Triad::kAccelerometer];
  const double gravity = *options.reference.gravity_mps2.value;
  const double sign = triad.sign == AccelerometerSign::kGravity ? -1.0 : 1.0;
  const std::vector<Eigen::Vector3d> readings = ReadingsOf(poses, Triad::kAccelerometer);
  if (triad.fixed_sensitivity) return FitBias(readings, *triad.fixed_sensitivity);

  switch (options.initialise.method) {
    case InitialiseMethod::kSixFaceExtremes: {
      auto model = SixFaceExtremes(readings, gravity);
      if (model) model->sensitivity *= sign;
      return model;
    }
    case InitialiseMethod::kSixPosition: {
      if (!options.initialise.known_forces.empty()) {
        return SixPositionStart(poses, readings, options.initialise.known_forces, gravity);
      }
      TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<int> faces, AssignFaces(readings));
      auto model = SixPosition(readings, faces, gravity);
      if (model) model->sensitivity *= sign;
      return model;
    }
    default:
      break;
  }

  if (options.attitudes.kind == AttitudeKind::kGiven) {
    std::vector<Eigen::Vector3d> forces;
    for (const StaticPose& pose : poses.poses) {
      if (!pose.triads[Triad::kAccelerometer]) continue;
      forces.push_back(pose.attitude->world_from_body.conjugate() *
                       Eigen::Vector3d(0.0, 0.0, gravity));
    }
    return FitInKnownField(readings, forces);
  }
  if (options.attitudes.kind == AttitudeKind::kSixFace) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<int> faces, FacesOfPoses(poses, triad));
    std::vector<Eigen::Vector3d> forces;
    for (const int face : faces) {
      if (face >= 0) forces.push_back(gravity * FaceAxes(face).col(0));
    }
    return FitInKnownField(readings, forces);
  }

  MatrixModel shape = triad.model;
  if (options.initialise.method == InitialiseMethod::kEllipsoidAxisAligned) {
    shape = MatrixModel::kDiagonal;
  } else if (options.initialise.method == InitialiseMethod::kEllipsoid) {
    shape = MatrixModel::kFull;
  }
  auto model = FitModelTrimmed(readings, shape, gravity);
  if (!model) return model;
  model->sensitivity *= sign;
  // Rotates the frame so that the matrix is lower triangular, as the solution's gauge requires. A
  // diagonal matrix stays as it is.
  model->sensitivity *= GaugeRotation(Gauge::kAccelX, model->sensitivity, sign);
  return model;
}

// AccelerometerStart in the body frame, which the mounting defines if attitudes are unknown.
Result<TriadModel<double>> MountedAccelerometerStart(const PoseSet& poses,
                                                     const CalibrateOptions& options) {
  auto model = AccelerometerStart(poses, options);
  const bool is_given = options.triads[Triad::kAccelerometer].fixed_sensitivity ||
                        !options.initialise.known_forces.empty();
  if (model && !is_given) model->sensitivity *= LeadingAxisMap(options);
  return model;
}

// The magnetometer in its own frame (symmetric or diagonal sensitivity, right-handed). Also sets
// the start's field strength. If no strength is stated, it is a convention.
Result<TriadModel<double>> MagnetometerInOwnFrame(const PoseSet& poses,
                                                  const CalibrateOptions& options,
                                                  StartValues* start) {
  const TriadOptions& triad = options.triads[Triad::kMagnetometer];
  const std::vector<Eigen::Vector3d> readings = ReadingsOf(poses, Triad::kMagnetometer);
  const StreamSummary* stream = poses.Find(Triad::kMagnetometer);
  const std::optional<double>& stated = options.reference.field_ut.value;
  const bool is_counts = stream == nullptr || stream->unit.is_counts;
  start->field_nominal = !options.reference.field_ut.known();
  double& field = start->reference[kField];
  field = start->field_nominal ? kNominalFieldUt : *stated;
  if (triad.fixed_sensitivity && (!start->field_nominal || is_counts)) {
    return FitBias(readings, *triad.fixed_sensitivity);
  }
  auto fitted = FitModelTrimmed(readings, triad.model, 1.0);
  // The field strength is set to the mean radius in the stated unit, so that the mean gain is 1.
  if (fitted && start->field_nominal && !is_counts) {
    field = std::cbrt(std::abs(fitted->sensitivity.determinant())) * stream->unit.truth_per_raw;
  }
  if (triad.fixed_sensitivity) return FitBias(readings, *triad.fixed_sensitivity);
  if (fitted) fitted->sensitivity /= field;
  return fitted;
}

// The rotations that bring the fields to a constant angle with up; the best one comes first.
Result<std::vector<FrameAlignment>> RivalAlignments(const std::vector<Eigen::Vector3d>& ups,
                                                    const std::vector<Eigen::Vector3d>& fields,
                                                    const CalibrateOptions& options) {
  const bool held = options.triads[Triad::kMagnetometer].fixed_sensitivity.has_value();
  const Knowledge& dip = options.reference.dip_rad;

  std::vector<FrameAlignment> alignments;
  if (held) {
    FrameAlignment identity;
    for (std::size_t k = 0; k < ups.size(); ++k) identity.cosine += ups[k].dot(fields[k]);
    identity.cosine /= static_cast<double>(std::max<std::size_t>(ups.size(), 1));
    alignments.push_back(identity);
  } else {
    const double known_cosine = dip.known() ? -std::sin(*dip.value) : 0.0;
    const double* cosine = dip.known() && dip.sigma < 0.02 ? &known_cosine : nullptr;
    TRUETRIAD_ASSIGN_OR_RETURN(alignments, AlignFrames(ups, fields, +1, cosine));
    if (cosine != nullptr) {
      // If the dip is known, mirrored rotations are a separate problem, which is also solved.
      auto mirrored = AlignFrames(ups, fields, -1, cosine);
      if (mirrored) alignments.insert(alignments.end(), mirrored->begin(), mirrored->end());
      std::stable_sort(alignments.begin(), alignments.end(), [](const auto& a, const auto& b) {
        return a.rms < b.rms;
      });
    } else {
      // (R, c) and (-R, -c) are the same solution: the hemisphere decides. In the north the field
      // points down: the dip is positive, and the cosine with up is negative.
      const double wanted = dip.known() ? (*dip.value < 0.0 ? 1.0 : -1.0)
                                        : (options.reference.northern_hemisphere ? -1.0 : 1.0);
      for (FrameAlignment& alignment : alignments) {
        const bool equator = std::abs(alignment.cosine) < kEquatorSine;
        if (!equator && alignment.cosine * wanted < 0.0) {
          alignment.rotation = -alignment.rotation;
          alignment.cosine = -alignment.cosine;
        }
      }
    }
  }
  return alignments;
}

// Up and field at one pose as unit vectors, and the relative errors of the measured lengths.
struct Pair {
  const StaticPose* pose = nullptr;
  Eigen::Vector3d up, field;
  double up_error = 0.0, field_error = 0.0;
};

std::vector<Pair> PairsOf(const PoseSet& poses,
                          const StartValues& base,
                          const TriadModel<double>& own) {
  std::vector<Pair> pairs;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[Triad::kAccelerometer] || !pose.triads[Triad::kMagnetometer]) continue;
    const Eigen::Vector3d up = base.models[Triad::kAccelerometer]->TruthFromRaw(
        pose.triads[Triad::kAccelerometer]->mean_raw);
    const Eigen::Vector3d field = own.TruthFromRaw(pose.triads[Triad::kMagnetometer]->mean_raw);
    pairs.push_back({&pose,
                     up.normalized(),
                     field.normalized(),
                     std::abs(up.norm() / base.reference[kGravity] - 1.0),
                     std::abs(field.norm() / base.reference[kField] - 1.0)});
  }
  return pairs;
}

// Rotates the magnetometer from its own frame into the body frame, so that the angle between field
// and gravity is constant; returns one start for every rival solution.
Result<std::vector<StartValues>> AlignMagnetometer(const PoseSet& poses,
                                                   const CalibrateOptions& options,
                                                   const StartValues& base,
                                                   const TriadModel<double>& own) {
  std::vector<Pair> pairs = PairsOf(poses, base, own);
  std::vector<double> up_errors, field_errors;
  for (const Pair& pair : pairs) {
    up_errors.push_back(pair.up_error);
    field_errors.push_back(pair.field_error);
  }
  // If the length of a reading differs from the field's, its direction is wrong as well.
  const double wild_up = WildFrom(up_errors), wild_field = WildFrom(field_errors);
  std::erase_if(pairs, [&](const Pair& pair) {
    return (pair.up_error > wild_up || pair.field_error > wild_field) &&
           Acts(Mechanism::kWildPairs);
  });
  std::vector<Eigen::Vector3d> ups;
  std::vector<Eigen::Vector3d> fields;
  for (const Pair& pair : pairs) {
    ups.push_back(pair.up);
    fields.push_back(pair.field);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<FrameAlignment> alignments,
                             RivalAlignments(ups, fields, options));
  const Knowledge& dip = options.reference.dip_rad;

  std::vector<StartValues> starts;
  for (const FrameAlignment& alignment : alignments) {
    // Chosen: a rival with a residual above 20 times the best one plus 1e-3 is no solution.
    if (!starts.empty() && alignment.rms > 20.0 * alignments.front().rms + 1e-3) break;
    if (starts.size() == kMaxCandidates) break;
    if (!starts.empty() && !Acts(Mechanism::kRivalStarts)) break;
    StartValues start = base;
    TriadModel<double> model = own;
    // own frame vector = R^T body vector.
    model.sensitivity = own.sensitivity * alignment.rotation.transpose();
    start.models[Triad::kMagnetometer] = model;
    start.reference[kDip] =
        dip.known() ? *dip.value : -std::asin(std::clamp(alignment.cosine, -1.0, 1.0));
    if (options.attitudes.kind == AttitudeKind::kGiven) {
      Eigen::Vector3d world = Eigen::Vector3d::Zero();
      for (const Pair& pair : pairs) {
        world += base.level_from_fixture * pair.pose->attitude->world_from_body *
                 model.TruthFromRaw(pair.pose->triads[Triad::kMagnetometer]->mean_raw);
      }
      start.reference[kHeading] = std::atan2(world.y(), world.x());
    }
    starts.push_back(start);
  }
  return starts;
}

// Fits the triad in given attitudes and in a field of unknown direction.
Result<FixtureFit> FitInGivenAttitudes(const PoseSet& poses, Triad triad, double strength) {
  std::vector<Eigen::Quaterniond> attitudes;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[triad]) continue;
    if (!pose.attitude) {
      return Error(ErrorCode::kDoesNotMatch,
                   {poses.source},
                   "pose " + std::to_string(pose.number) +
                       " has no known attitude; `attitudes: {file: …}` needs one for every pose");
    }
    attitudes.push_back(pose.attitude->world_from_body);
  }
  return FitInFixture(ReadingsOf(poses, triad), attitudes, strength);
}

// A magnetometer alone in given attitudes: its matrix, and the field's dip and heading in the frame
// of the attitudes.
Status StartMagnetometerInGivenAttitudes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         StartValues* start) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      auto fit, FitInGivenAttitudes(poses, Triad::kMagnetometer, start->reference[kField]));
  const Knowledge& dip = options.reference.dip_rad;
  const bool north = dip.known() ? *dip.value >= 0.0 : options.reference.northern_hemisphere;
  // Near the equator the sign of the fit is kept, whose determinant is positive.
  if (std::abs(fit.direction.z()) > kEquatorSine && (fit.direction.z() < 0.0) != north) {
    fit.direction *= -1.0;
    fit.model.sensitivity *= -1.0;
  }
  start->models[Triad::kMagnetometer] = fit.model;
  start->reference[kDip] =
      dip.known() ? *dip.value : -std::asin(std::clamp(fit.direction.z(), -1.0, 1.0));
  start->reference[kHeading] = std::atan2(fit.direction.y(), fit.direction.x());
  return {};
}

// If the moves hardly rotate the unit about an axis, the gain of this axis may be arbitrary. In a
// log with a stated unit, gains outside 1/kLargestSiGain to kLargestSiGain are implausible.
bool IsPlausible(const Eigen::Matrix3d& sensitivity, const Unit& unit) {
  if (unit.is_counts) return true;
  const Eigen::Array3d gains = sensitivity.rowwise().norm().array() * unit.truth_per_raw;
  return (gains < kLargestSiGain).all() && (gains > 1.0 / kLargestSiGain).all();
}

// The turns between poses, with the direction of gravity or the field as `triad` measures it.
std::vector<DirectionMove> DirectionMovesOf(const PoseSet& poses,
                                            Triad triad,
                                            const TriadModel<double>& model) {
  std::vector<DirectionMove> moves;
  for (const RecordedMove& recorded : poses.moves) {
    const auto& before = poses.poses[recorded.from].triads[triad];
    const auto& after = poses.poses[recorded.from + 1].triads[triad];
    if (recorded.fault || !before || !after) continue;
    std::vector<Eigen::Vector3d> directions = FieldsDuring(recorded, triad, model);
    if (directions.empty()) continue;
    DirectionMove& move = moves.emplace_back();
    move.move = MoveOf(recorded, nullptr);
    move.direction = std::move(directions);
    move.before = model.TruthFromRaw(before->mean_raw).normalized();
    move.after = model.TruthFromRaw(after->mean_raw).normalized();
  }
  return moves;
}

// A gyroscope alone with rates of known magnitude. The readings minus the bias at rest, divided by
// the magnitude of the rate, lie on one ellipsoid. Without rests, only rates of the median
// magnitude are used.
Result<TriadModel<double>> GyroscopeFromSpeeds(const PoseSet& poses,
                                               const CalibrateOptions& options) {
  const TriadOptions& sensor = options.triads[Triad::kGyroscope];
  const std::vector<Eigen::Vector3d> rests = ReadingsOf(poses, Triad::kGyroscope);
  std::vector<double> speeds;
  std::vector<Eigen::Vector3d> readings;
  for (const KnownRate& rate : poses.rates) {
    if (!rate.means.triads[Triad::kGyroscope]) continue;
    speeds.push_back(rate.stated.rate_radps.norm());
    readings.push_back(rate.means.triads[Triad::kGyroscope]->mean_raw);
  }
  const Eigen::Vector3d zero = rests.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                             : MedianReading(poses, Triad::kGyroscope);
  const double usual = Median(speeds);
  std::vector<Eigen::Vector3d> same;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const bool is_usual = std::abs(speeds[k] - usual) < kSameSpeed * usual;
    if (rests.empty() && !is_usual) continue;
    same.push_back(zero + usual / speeds[k] * (readings[k] - zero));
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckCount(Triad::kGyroscope, same.size(), sensor, false, false));
  TRUETRIAD_ASSIGN_OR_RETURN(TriadModel<double> model, FitModelTrimmed(same, sensor.model, usual));
  model.sensitivity *= GaugeRotation(Gauge::kAccelX, model.sensitivity) * LeadingAxisMap(options);
  if (!rests.empty()) model.bias = zero;
  model.bias = sensor.fixed_bias.value_or(model.bias);
  return model;
}

// `vector`: the sensor with which the turns are compared; `vector_model`: the model of this sensor,
// or null if there is no such sensor.
Result<TriadModel<double>> GyroscopeStart(const PoseSet& poses,
                                          const CalibrateOptions& options,
                                          Triad vector,
                                          const TriadModel<double>* vector_model) {
  const TriadOptions& sensor = options.triads[Triad::kGyroscope];
  TriadModel<double> model;
  model.bias = sensor.fixed_bias.value_or(MedianReading(poses, Triad::kGyroscope));
  if (sensor.fixed_sensitivity) {
    model.sensitivity = *sensor.fixed_sensitivity;
    return model;
  }
  // Known rates with known axes determine the whole model without the accelerometer's readings.
  const bool use_rates =
      vector_model == nullptr ||
      std::any_of(poses.rates.begin(), poses.rates.end(), [](const KnownRate& rate) {
        return rate.stated.is_axis_known;
      });
  auto known = GyroscopeFromKnownMotions(poses);
  if (known && use_rates) {
    known->bias = sensor.fixed_bias.value_or(known->bias);
    return known;
  }
  if (vector_model == nullptr && !options.has_stated_axes) {
    return GyroscopeFromSpeeds(poses, options);
  }
  if (vector_model == nullptr) return WhyNoGyroscope(poses, known.error());
  const auto sensitivity =
      FindGyroSensitivity(DirectionMovesOf(poses, vector, *vector_model), model.bias);
  const Unit& unit = poses.Find(Triad::kGyroscope)->unit;
  if (sensitivity && (IsPlausible(*sensitivity, unit) || !Acts(Mechanism::kPlausibleStart))) {
    model.sensitivity = *sensitivity;
  } else if (known) {
    model.sensitivity = known->sensitivity;
  } else if (!sensitivity) {
    return WhyNoGyroscope(poses, sensitivity.error());
  } else {
    model.sensitivity = Eigen::Matrix3d::Identity() / unit.truth_per_raw;
  }
  return model;
}

// Adds the gyroscope's start model. `start` must have the model of the sensor, if there is one,
// with which turns are compared.
Status AddGyroscope(const PoseSet& poses, const CalibrateOptions& options, StartValues* start) {
  if (!options.triads[Triad::kGyroscope].enabled) return {};
  const Triad vector =
      start->models[Triad::kAccelerometer] ? Triad::kAccelerometer : Triad::kMagnetometer;
  const auto& model = start->models[vector];
  TRUETRIAD_ASSIGN_OR_RETURN(start->models[Triad::kGyroscope],
                             GyroscopeStart(poses, options, vector, model ? &*model : nullptr));
  return CheckTurnCounts(poses, *start);
}

}  // namespace

Status CheckPoseCounts(const PoseSet& poses, const CalibrateOptions& options) {
  const bool six_faces = options.initialise.method == InitialiseMethod::kSixFaceExtremes ||
                         options.initialise.method == InitialiseMethod::kSixPosition;
  if (options.HasGyroscopeAlone() && poses.turns.empty() && poses.rates.empty()) {
    return NotEnoughError(
        Finding(
            FindingCode::kNoKnownMotion,
            "gyroscope: without another sensor or a known motion, only its bias is observable",
            "state known `turns:` or `rates:`, or enable the accelerometer, so that its turns are "
            "measured against gravity")
            .About(Triad::kGyroscope));
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled || (triad == Triad::kAccelerometer && six_faces)) continue;
    const bool attitudes =
        triad == Triad::kAccelerometer && options.attitudes.kind != AttitudeKind::kNone;
    // Stated six faces would not help a magnetometer, so the remedy does not name them.
    const bool may_be_faces =
        triad == Triad::kAccelerometer && !options.triads[Triad::kMagnetometer].enabled;
    TRUETRIAD_RETURN_IF_ERROR(
        CheckCount(triad, ReadingsOf(poses, triad).size(), sensor, attitudes, may_be_faces));
  }
  return {};
}

Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options) {
  StartValues start;
  start.reference[kGravity] = *options.reference.gravity_mps2.value;
  start.reference[kField] = kNominalFieldUt;
  const bool has_accelerometer = options.triads[Triad::kAccelerometer].enabled;
  const bool has_magnetometer = options.triads[Triad::kMagnetometer].enabled;
  if (has_accelerometer) {
    const TriadOptions& sensor = options.triads[Triad::kAccelerometer];
    Result<TriadModel<double>> model = TriadModel<double>();
    if (options.attitudes.unknown_fixture_rotation) {
      TRUETRIAD_ASSIGN_OR_RETURN(
          auto fit, FitInGivenAttitudes(poses, Triad::kAccelerometer, start.reference[kGravity]));
      const double sign = sensor.sign == AccelerometerSign::kGravity ? -1.0 : 1.0;
      start.level_from_fixture = RotationBetween(sign * fit.direction, Eigen::Vector3d::UnitZ());
      fit.model.sensitivity *= sign;
      *model = fit.model;
    }
    if (!options.attitudes.unknown_fixture_rotation || sensor.fixed_sensitivity) {
      model = MountedAccelerometerStart(poses, options);
    }
    if (!model) return WhyNoStart(poses, Triad::kAccelerometer, model.error());
    TRUETRIAD_RETURN_IF_ERROR(
        CheckAccelerometerGain(poses, options, ReadingsOf(poses, Triad::kAccelerometer), *model));
    start.models[Triad::kAccelerometer] = *model;
  }
  const bool against_magnetometer = !has_accelerometer && has_magnetometer;
  if (!against_magnetometer) TRUETRIAD_RETURN_IF_ERROR(AddGyroscope(poses, options, &start));
  if (!has_magnetometer) return std::vector<StartValues>{start};

  auto own = MagnetometerInOwnFrame(poses, options, &start);
  if (!own) return WhyNoStart(poses, Triad::kMagnetometer, own.error());
  if (has_accelerometer) return AlignMagnetometer(poses, options, start, *own);
  if (options.attitudes.kind == AttitudeKind::kGiven &&
      !options.triads[Triad::kMagnetometer].fixed_sensitivity) {
    TRUETRIAD_RETURN_IF_ERROR(StartMagnetometerInGivenAttitudes(poses, options, &start));
    TRUETRIAD_RETURN_IF_ERROR(AddGyroscope(poses, options, &start));
    return std::vector<StartValues>{start};
  }
  if (!options.triads[Triad::kMagnetometer].fixed_sensitivity) {
    own->sensitivity *= GaugeRotation(Gauge::kAccelX, own->sensitivity) * LeadingAxisMap(options);
  }
  start.models[Triad::kMagnetometer] = *own;
  // If turns are compared with the field alone, the field is the vertical of the world frame.
  if (options.TurnsAgainstField()) start.reference[kDip] = kVerticalFieldRad;
  TRUETRIAD_RETURN_IF_ERROR(AddGyroscope(poses, options, &start));
  return std::vector<StartValues>{start};
}

std::optional<CalibrateOptions> WithMagnetometerMap(const CalibrateOptions& options,
                                                    const StartValues& start) {
  const TriadOptions& magnetometer = options.triads[Triad::kMagnetometer];
  const TriadOptions& gyroscope = options.triads[Triad::kGyroscope];
  if (!options.TurnsAgainstField() || magnetometer.mounting || magnetometer.fixed_sensitivity ||
      !gyroscope.mounting) {
    return std::nullopt;
  }
  // A rotation Q brings S_g Q to the stated axes; if the handedness differs, there is no such Q.
  const Eigen::Matrix3d found = NearestAxisMap(start.models[Triad::kGyroscope]->sensitivity);
  const Eigen::Matrix3d turn = found.transpose() * *gyroscope.mounting;
  const bool is_turned = turn.determinant() > 0.0 && !turn.isIdentity(0.0);
  if (!is_turned || !Acts(Mechanism::kMagnetometerMap)) return std::nullopt;
  CalibrateOptions mapped = options;
  mapped.triads[Triad::kMagnetometer].mounting = turn;
  mapped.triads[Triad::kMagnetometer].is_mounting_found = true;
  return mapped;
}

}  // namespace truetriad

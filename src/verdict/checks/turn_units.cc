// SPDX-License-Identifier: Apache-2.0
//
// Checks the unit of a gyroscope: its turns must move gravity in the body as the accelerometer
// shows. No fit is used, since a fit explains even turns that wrap around.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "math/distributions.h"
#include "model/gyro_increment.h"
#include "model/mechanisms.h"
#include "problem/moves.h"
#include "problem/start_values.h"
#include "truetriad/base/triad.h"
#include "verdict/checks/units.h"

namespace truetriad {
namespace {

// Most turns that are tested: more only cost time.
constexpr std::size_t kMostTurns = 24;
// Chosen: fewer turns fit some wrong factor by chance too often.
constexpr std::size_t kFewestTurns = 4;
// Least turn that is tested, 20 degrees: shorter ones hardly depend on the unit.
constexpr double kTurnedRad = 0.35;
// Largest median error of the turns, rad, of an uncalibrated gyroscope in the right unit: a gain
// error of a tenth is 0.31 in half a turn.
constexpr double kExplainedRad = 0.3;
// A factor explains the turns only if their error with it is smaller than their error with the
// stated unit by this ratio.
constexpr double kBetterBy = 3.0;
// If a unit never rests, its accelerometer's readings are averaged over ± this time, 0.05 s.
constexpr double kMeanNs = 5e7;
constexpr std::array<double, 4> kPiecesS = {0.25, 0.5, 1.0, 2.0};

// A turn: the gyroscope's readings, and the up direction in the body before and after them.
struct SeenTurn {
  Eigen::Vector3d before, after;
  GyroMove move;
};

// The up direction by the uncalibrated accelerometer; without one, the direction of the field.
Eigen::Vector3d RoughUp(const StreamSummary& stream, const Eigen::Vector3d& reading_raw) {
  // For counts, zero force is nearer to the middle of the readings' range than to 0; so is zero
  // field if iron is near.
  const bool is_centred = !stream.unit.is_counts && stream.triad == Triad::kAccelerometer;
  const Eigen::Vector3d zero =
      is_centred ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                 : Eigen::Vector3d(0.5 * (stream.minimum_raw + stream.maximum_raw));
  return (reading_raw - zero).normalized();
}

void AddTurn(SeenTurn turn, std::vector<SeenTurn>* turns) {
  if (turn.before.dot(turn.after) > std::cos(kTurnedRad) || turn.move.time_s.size() < 3) return;
  turns->push_back(std::move(turn));
}

std::vector<SeenTurn> TurnsBetweenRests(const PoseSet& poses, const StreamSummary& stream) {
  std::vector<SeenTurn> turns;
  for (const RecordedMove& move : poses.moves) {
    const auto& before = poses.poses[move.from].triads[stream.triad];
    const auto& after = poses.poses[move.from + 1].triads[stream.triad];
    if (move.fault || !before || !after) continue;
    AddTurn({RoughUp(stream, before->mean_raw),
             RoughUp(stream, after->mean_raw),
             MoveOf(move, nullptr)},
            &turns);
  }
  return turns;
}

// Mean of a track about a time; zero if it has no readings there.
Eigen::Vector3d MeanAbout(const ReadingTrack& track, std::int64_t time_ns) {
  const auto reach = static_cast<std::int64_t>(kMeanNs);
  const auto begin = std::lower_bound(track.time_ns.begin(), track.time_ns.end(), time_ns - reach);
  const auto end = std::upper_bound(begin, track.time_ns.end(), time_ns + reach);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto at = begin; at != end; ++at) {
    sum += track.reading_raw[static_cast<std::size_t>(at - track.time_ns.begin())];
  }
  return sum / std::max(1.0, static_cast<double>(end - begin));
}

std::vector<SeenTurn> TurnsOfLength(const PoseSet& poses,
                                    const StreamSummary& stream,
                                    double piece_s) {
  const ReadingTrack& gyroscope = poses.tracks[Triad::kGyroscope];
  const ReadingTrack& vectors = poses.tracks[stream.triad];
  std::vector<SeenTurn> turns;
  if (gyroscope.time_ns.empty()) return turns;
  const auto length = static_cast<std::int64_t>(1e9 * piece_s);
  const std::int64_t duration = gyroscope.time_ns.back() - gyroscope.time_ns.front();
  const std::int64_t every = std::max(length, duration / static_cast<std::int64_t>(4 * kMostTurns));
  for (std::int64_t from = gyroscope.time_ns.front(); from + length <= gyroscope.time_ns.back();
       from += every) {
    const auto begin = std::lower_bound(gyroscope.time_ns.begin(), gyroscope.time_ns.end(), from);
    const auto end = std::upper_bound(begin, gyroscope.time_ns.end(), from + length);
    if (end - begin < 3) continue;
    SeenTurn turn{RoughUp(stream, MeanAbout(vectors, *begin)),
                  RoughUp(stream, MeanAbout(vectors, *(end - 1))),
                  {}};
    for (auto at = begin; at != end; ++at) {
      turn.move.time_s.push_back(1e-9 * static_cast<double>(*at - *begin));
      turn.move.reading_raw.push_back(
          gyroscope.reading_raw[static_cast<std::size_t>(at - gyroscope.time_ns.begin())]);
    }
    AddTurn(std::move(turn), &turns);
  }
  return turns;
}

// The turns over pieces of one length, which is that of kPiecesS with the most turns.
std::vector<SeenTurn> TurnsInMotion(const PoseSet& poses, const StreamSummary& stream) {
  std::vector<SeenTurn> most;
  for (const double piece_s : kPiecesS) {
    std::vector<SeenTurn> turns = TurnsOfLength(poses, stream, piece_s);
    if (turns.size() > most.size()) most = std::move(turns);
    if (most.size() >= 2 * kMostTurns) break;
  }
  return most;
}

// Median angle between gravity as measured after a turn and as predicted by the turn, if a raw unit
// of each axis is `truth_per_raw` rad/s.
double TurnErrorAt(const std::vector<SeenTurn>& turns,
                   const Eigen::Vector3d& bias_raw,
                   const Eigen::Vector3d& truth_per_raw) {
  GyroModel model;
  model.triad.bias = bias_raw;
  model.triad.sensitivity = truth_per_raw.cwiseInverse().asDiagonal();
  std::vector<double> errors;
  for (const SeenTurn& turn : turns) {
    const Eigen::Quaterniond rotation = IntegrateRotation(
        {turn.move.time_s, turn.move.reading_raw, {}}, model, RateSampling::kInstantaneous);
    const double cosine = turn.after.dot(rotation.conjugate() * turn.before);
    errors.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  return Median(std::move(errors));
}

struct Explanation {
  double factor = 1.0;
  std::optional<int> axis;  // the only axis with this factor; unset: all axes
  double error = kExplainedRad;
};

// Factors by which readings may be wrong: another known unit was stated, readings were converted
// twice, or a decimal point was shifted.
std::vector<double> FactorsOf(const Unit& stated) {
  std::vector<double> factors = {1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3};
  for (const double truth_per_raw : KnownUnitsOf(Triad::kGyroscope)) {
    if (truth_per_raw == stated.truth_per_raw) continue;
    factors.push_back(truth_per_raw / stated.truth_per_raw);
    factors.push_back(stated.truth_per_raw / truth_per_raw);
  }
  return factors;
}

// The factor that explains the turns best, on all axes or on one.
Explanation BestOf(const std::vector<SeenTurn>& turns,
                   const Eigen::Vector3d& bias_raw,
                   const Unit& stated) {
  Explanation best;
  for (const double factor : FactorsOf(stated)) {
    for (int axis = -1; axis < 3; ++axis) {
      Eigen::Vector3d truth_per_raw = Eigen::Vector3d::Constant(stated.truth_per_raw);
      if (axis < 0) truth_per_raw *= factor;
      if (axis >= 0) truth_per_raw[axis] *= factor;
      const double error = TurnErrorAt(turns, bias_raw, truth_per_raw);
      if (!(error < best.error)) continue;
      best = {factor, axis < 0 ? std::nullopt : std::optional(axis), error};
    }
  }
  return best;
}

}  // namespace

std::optional<Finding> WhyTurnsAreNotAsStated(const PoseSet& poses,
                                              const CalibrateOptions& options) {
  const StreamSummary* gyroscope = poses.Find(Triad::kGyroscope);
  const bool against_field = options.TurnsAgainstField();
  const StreamSummary* vectors =
      poses.Find(against_field ? Triad::kMagnetometer : Triad::kAccelerometer);
  const TriadOptions& sensor = options.triads[Triad::kGyroscope];
  if (!sensor.enabled || sensor.fixed_sensitivity || gyroscope == nullptr ||
      gyroscope->unit.is_counts || vectors == nullptr) {
    return std::nullopt;
  }
  std::vector<SeenTurn> turns =
      options.motion ? TurnsInMotion(poses, *vectors) : TurnsBetweenRests(poses, *vectors);
  if (turns.size() < kFewestTurns) return std::nullopt;
  if (turns.size() > kMostTurns) {
    for (std::size_t k = 0; k < kMostTurns; ++k) {
      std::swap(turns[k], turns[k * turns.size() / kMostTurns]);
    }
    turns.resize(kMostTurns);
  }
  const Eigen::Vector3d bias_raw = MedianReading(poses, Triad::kGyroscope);
  const Unit& stated = gyroscope->unit;
  const double error =
      TurnErrorAt(turns, bias_raw, Eigen::Vector3d::Constant(stated.truth_per_raw));
  if (error < kExplainedRad) return std::nullopt;
  const Explanation best = BestOf(turns, bias_raw, stated);
  const bool is_explained = best.error < kExplainedRad && kBetterBy * best.error < error;
  if (!is_explained || !Acts(Mechanism::kUnitOfTurns)) return std::nullopt;
  const auto unit = LooksLike(Triad::kGyroscope, best.factor * stated.truth_per_raw, stated);
  const std::string of_axis =
      best.axis ? "the readings of its " + std::string(1, "xyz"[*best.axis]) + " axis" : "readings";
  return Finding(FindingCode::kWrongUnit,
                 "the gyroscope's turns differ from those of " +
                     std::string(against_field ? "the field" : "gravity") + " by " +
                     Format("%.0f deg, but only by ", error * kDegPerRad) +
                     Format("%.1f deg with ", best.error * kDegPerRad) + of_axis +
                     Format(" multiplied by %.3g: looks like ", best.factor) +
                     unit.value_or("another unit or counts") + " labelled " + stated.name,
                 best.axis
                     ? "give all three columns one unit, and state it"
                     : "state the unit of the gyroscope, or that of the times; `units: trust` "
                       "takes them as they are")
      .About(Triad::kGyroscope)
      .With("factor", best.factor);
}

}  // namespace truetriad

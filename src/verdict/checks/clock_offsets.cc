// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/clock_offsets.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/messages.h"
#include "data/readings_at.h"
#include "math/dense/cholesky.h"
#include "math/distributions.h"
#include "truetriad/math/rotation.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// Unknowns of an accelerometer: its clock offset, and three coordinates of its position.
constexpr int kMostUnknowns = 4;
using Normal = Eigen::Matrix<double, kMostUnknowns, kMostUnknowns>;
using Unknowns = Eigen::Matrix<double, kMostUnknowns, 1>;
using Columns = Eigen::Matrix<double, 3, kMostUnknowns>;

// An offset needs this many more moves than unknowns, so that σ by leaving one out is meaningful.
constexpr int kSpareMoves = 4;
// A move whose predicted end has a larger error, 11 degrees, is skipped.
constexpr double kLostRad = 0.2;
// Time over which the rate is differentiated, s: shorter than a hand's start and stop, and long
// enough to reduce the rate's noise.
constexpr double kDifferenceS = 0.04;
// Chosen: the iteration ends after this round even if its last step is above kSettledS.
constexpr int kMostRounds = 12;
// The iteration ends when its step is shorter than this, s: moves determine clocks to 0.1 ms.
constexpr double kSettledS = 1e-5;
// An offset that becomes longer than this, s, is discarded: moves last only about a second.
constexpr double kLongestS = 0.5;
// An offset with a larger p is not reported.
constexpr double kSaidChance = 1e-5;
// An offset is reported if it exceeds the time between two gyroscope readings by this many σ. A
// reading may be late by up to that time without any fault of its clock.
constexpr double kSurelyLonger = 3.0;

// One move, as the gyroscope measured it.
struct FollowedMove {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> rate_radps, acceleration_radps2;
  std::vector<Eigen::Quaterniond> world_from_body;
};

// Sums over one move's rows: Z^T r and r^T r.
struct MoveSums {
  Unknowns right = Unknowns::Zero();
  double square = 0.0;
};

std::vector<Eigen::Vector3d> Differences(const FollowedMove& move) {
  const std::size_t count = move.time_s.size();
  std::vector<Eigen::Vector3d> differences(count, Eigen::Vector3d::Zero());
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < count; ++i) {
    while (move.time_s[i] - move.time_s[before] > 0.5 * kDifferenceS) ++before;
    while (after + 1 < count && move.time_s[after] - move.time_s[i] < 0.5 * kDifferenceS) ++after;
    const double span_s = move.time_s[after] - move.time_s[before];
    if (!(span_s > 0.0)) continue;
    differences[i] = (move.rate_radps[after] - move.rate_radps[before]) / span_s;
  }
  return differences;
}

// Integrates the attitude along the turn of `edge`. The attitude's error at the turn's end is then
// distributed along the turn in proportion to the angle. Unset if this error exceeds kLostRad.
std::optional<FollowedMove> Follow(const PoseGraph& graph, const IncrementEdge& edge) {
  FollowedMove move;
  move.time_s = edge.move.time_s;
  const std::size_t count = move.time_s.size();
  const bool has_forces =
      edge.accelerometer_raw.size() == count && !edge.at.g_sensitivity.isZero(0.0);
  const TriadModel<double>& gyroscope = edge.at.triad;
  const Eigen::Matrix3d correction = gyroscope.Correction();
  TriadModel<double> accelerometer;
  if (has_forces) accelerometer = graph.ModelAt(Triad::kAccelerometer, graph.nodes[edge.from]);
  move.rate_radps.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d raw = edge.move.reading_raw[i] - gyroscope.bias;
    if (has_forces) {
      raw -= edge.at.g_sensitivity * accelerometer.TruthFromRaw(edge.accelerometer_raw[i]);
    }
    move.rate_radps.emplace_back(correction * gyroscope.Felt(raw));
  }
  move.world_from_body.reserve(count);
  move.world_from_body.push_back(graph.nodes[edge.from].rotation());
  std::vector<double> turned_rad(count, 0.0);
  for (std::size_t i = 1; i < count; ++i) {
    const Eigen::Vector3d step =
        0.5 * (move.time_s[i] - move.time_s[i - 1]) * (move.rate_radps[i - 1] + move.rate_radps[i]);
    move.world_from_body.push_back(move.world_from_body.back() * RotationExp(step));
    turned_rad[i] = turned_rad[i - 1] + step.norm();
  }
  const Eigen::Vector3d missed =
      RotationLog(move.world_from_body.back().conjugate() * graph.nodes[edge.from + 1].rotation());
  if (missed.norm() > kLostRad || !(turned_rad.back() > 0.0)) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    move.world_from_body[i] =
        move.world_from_body[i] * RotationExp(turned_rad[i] / turned_rad.back() * missed);
  }
  move.acceleration_radps2 = Differences(move);
  return move;
}

const Observation* SeenAt(const PoseNode& node, Triad triad) {
  for (const Observation& seen : node.observations) {
    if (seen.triad == triad && !seen.rejected) return &seen;
  }
  return nullptr;
}

// A move between two rests with readings of a sensor.
struct SeenMove {
  const FollowedMove* move = nullptr;
  std::vector<Eigen::Vector3d> reading;  // true unit; minus the errors at the two adjacent rests
  std::vector<Eigen::Vector3d> field;    // predicted by the attitude, true unit
  std::vector<Columns> columns;          // Z: derivatives of each reading by the unknowns
  Normal normal = Normal::Zero();        // Z^T Z
  double rows() const { return 3.0 * static_cast<double>(columns.size()); }
};

int UnknownsOf(Triad triad) { return triad == Triad::kAccelerometer ? kMostUnknowns : 1; }

SeenMove SeenBy(Triad triad,
                const PoseGraph& graph,
                const IncrementEdge& edge,
                const FollowedMove& move,
                const std::vector<Eigen::Vector3d>& reading_raw) {
  const bool has_place = UnknownsOf(triad) > 1;
  const Eigen::Vector3d world = WorldVector(triad, graph.reference());
  const PoseNode& first = graph.nodes[edge.from];
  const PoseNode& second = graph.nodes[edge.from + 1];
  const TriadModel<double> model = graph.ModelAt(triad, first);
  const auto off_at = [&](const PoseNode& node) -> Eigen::Vector3d {
    return graph.ModelAt(triad, node).TruthFromRaw(SeenAt(node, triad)->mean_raw) -
           node.rotation().conjugate() * world;
  };
  const Eigen::Vector3d off_before = off_at(first), off_after = off_at(second);
  const Eigen::Matrix3d correction = model.Correction();
  SeenMove seen;
  seen.move = &move;
  const std::size_t count = reading_raw.size();
  seen.reading.reserve(count);
  seen.field.reserve(count);
  seen.columns.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double share =
        static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(count, 2) - 1);
    seen.reading.emplace_back(correction * model.Felt(reading_raw[i] - model.bias) -
                              (1.0 - share) * off_before - share * off_after);
    seen.field.emplace_back(move.world_from_body[i].conjugate() * world);
    Columns& columns = seen.columns.emplace_back(Columns::Zero());
    columns.col(0) = move.rate_radps[i].cross(seen.field[i]);
    if (has_place) {
      const Eigen::Matrix3d turning = Skew(move.rate_radps[i]);
      columns.rightCols<3>() = Skew(move.acceleration_radps2[i]) + turning * turning;
    }
    seen.normal.noalias() += columns.transpose() * columns;
  }
  return seen;
}

// The sums over one move with readings shifted by `later_s`.
MoveSums SumsOf(const SeenMove& seen, double later_s) {
  MoveSums sums;
  const FollowedMove& move = *seen.move;
  const std::size_t count = move.time_s.size();
  std::size_t right = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // Before and after the move, the unit rests.
    const double time_s = std::clamp(move.time_s[i] + later_s, 0.0, move.time_s.back());
    while (right + 1 < count && move.time_s[right] < time_s) ++right;
    while (right > 0 && move.time_s[right - 1] >= time_s) --right;
    const std::size_t left = right > 0 ? right - 1 : 0;
    const double span_s = move.time_s[right] - move.time_s[left];
    const double share = span_s > 0.0 ? (time_s - move.time_s[left]) / span_s : 0.0;
    const Eigen::Vector3d off =
        (1.0 - share) * seen.reading[left] + share * seen.reading[right] - seen.field[i];
    sums.right.noalias() += seen.columns[i].transpose() * off;
    sums.square += off.squaredNorm();
  }
  return sums;
}

Unknowns Solved(const Normal& normal, const Unknowns& right, int unknowns) {
  Unknowns solved = Unknowns::Zero();
  solved.head(unknowns) =
      PivotedCholesky(normal.topLeftCorner(unknowns, unknowns)).SolveVector(right.head(unknowns));
  return solved;
}

std::optional<ClockOffset> OffsetOf(Triad triad, const std::vector<SeenMove>& moves) {
  const int unknowns = UnknownsOf(triad);
  const auto count = static_cast<int>(moves.size());
  if (count < unknowns + kSpareMoves) return std::nullopt;
  ClockOffset offset;
  offset.triad = triad;
  offset.moves = count;
  std::vector<double> weights(moves.size(), 1.0);
  std::vector<MoveSums> sums(moves.size());
  Normal normal;
  Unknowns right;
  for (int round = 0; round < kMostRounds; ++round) {
    normal.setZero();
    right.setZero();
    for (std::size_t k = 0; k < moves.size(); ++k) {
      sums[k] = SumsOf(moves[k], offset.later_s);
      normal += weights[k] * moves[k].normal;
      right += weights[k] * sums[k].right;
    }
    const Unknowns step = Solved(normal, right, unknowns);
    if (!step.allFinite()) return std::nullopt;
    for (std::size_t k = 0; k < moves.size(); ++k) {
      const double square =
          sums[k].square - 2.0 * step.dot(sums[k].right) + step.dot(moves[k].normal * step);
      weights[k] = square > 0.0 ? moves[k].rows() / square : 0.0;
    }
    offset.later_s += step[0];
    if (!(std::abs(offset.later_s) < kLongestS)) return std::nullopt;
    if (round > 1 && std::abs(step[0]) < kSettledS) break;
  }
  double squares = 0.0;
  const double whole = Solved(normal, right, unknowns)[0];
  for (std::size_t k = 0; k < moves.size(); ++k) {
    const double without = Solved(
        normal - weights[k] * moves[k].normal, right - weights[k] * sums[k].right, unknowns)[0];
    squares += (without - whole) * (without - whole);
  }
  offset.sigma_s = std::sqrt(squares * (count - 1.0) / count);
  if (!std::isfinite(offset.sigma_s) || !(offset.sigma_s > 0.0)) return std::nullopt;
  const double ratio = offset.later_s / offset.sigma_s;
  offset.p_value = 1.0 - FisherCdf(ratio * ratio, 1.0, count - unknowns);
  return offset;
}

// Values of a move shifted by `later_s`; before and after the move the unit rests.
std::vector<Eigen::Vector3d> ShiftedBy(double later_s,
                                       const std::vector<double>& time_s,
                                       const std::vector<Eigen::Vector3d>& values) {
  std::vector<double> wanted_s = time_s;
  for (double& at_s : wanted_s) at_s += later_s;
  return ReadingsAt(wanted_s, time_s, values);
}

Eigen::Vector3d ResidualOf(const IncrementEdge& edge, const PoseGraph& graph) {
  return edge.Residual(graph.layout,
                       graph.shared.data(),
                       graph.nodes[edge.from].state.data(),
                       graph.nodes[edge.from + 1].state.data());
}

// The change of all rows if the clock is corrected by `later_s`.
Eigen::VectorXd ChangeOfRows(Triad triad,
                             double later_s,
                             const PoseGraph& graph,
                             const ReducedSystem& system) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(system.residual().size());
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& seen = graph.nodes[k].observations;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].triad != triad) continue;
      // A row is model minus reading.
      change.segment<3>(system.factors()[k].row + 3 * static_cast<Eigen::Index>(i)) =
          -later_s * seen[i].by_clock_raw_per_s;
    }
  }
  if (triad != Triad::kAccelerometer) return change;
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    if (edge.accelerometer_raw.empty()) continue;
    IncrementEdge corrected = edge;
    corrected.accelerometer_raw = ShiftedBy(later_s, edge.move.time_s, edge.accelerometer_raw);
    // The turn is integrated at the graph's state, so that no derivative is involved.
    corrected.increment.rotation = corrected.RotationAt(graph.layout, graph.shared.data());
    change.segment<3>(system.factors()[graph.nodes.size() + i].row) =
        ResidualOf(corrected, graph) - ResidualOf(edge, graph);
  }
  return change;
}

// "magnetometer: its times are 60.10 ± 0.31 ms later than the gyroscope's"
std::string OffsetWords(Triad triad,
                        double later_s,
                        double sigma_s,
                        Triad reference = Triad::kGyroscope) {
  return std::string(TriadName(triad)) + Format(": its times are %.2f ", 1e3 * std::abs(later_s)) +
         Format("± %.2f ms ", 1e3 * sigma_s) + (later_s > 0.0 ? "later" : "earlier") +
         " than the " + std::string(TriadName(reference)) + "'s";
}

}  // namespace

std::vector<ClockOffset> FindClockOffsets(const PoseSet& poses, const PoseGraph& graph) {
  std::vector<ClockOffset> offsets;
  std::vector<std::pair<const IncrementEdge*, const RecordedMove*>> used;
  std::vector<FollowedMove> followed;
  auto recorded = poses.moves.begin();
  for (const IncrementEdge& edge : graph.increments) {
    if (edge.stated_turn >= 0 || edge.rejected) continue;
    const int number = graph.nodes[edge.from].number;
    while (recorded != poses.moves.end() && poses.poses[recorded->from].number < number) ++recorded;
    if (recorded == poses.moves.end()) break;
    if (poses.poses[recorded->from].number != number) continue;
    auto move = Follow(graph, edge);
    if (!move) continue;
    followed.push_back(*std::move(move));
    used.emplace_back(&edge, &*recorded);
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!graph.layout.Has(triad) || poses.clock_lag_s[triad]) continue;
    std::vector<SeenMove> moves;
    for (std::size_t k = 0; k < used.size(); ++k) {
      const auto& [edge, move] = used[k];
      const std::vector<Eigen::Vector3d>& reading_raw =
          triad == Triad::kAccelerometer ? move->accelerometer_raw : move->magnetometer_raw;
      if (reading_raw.size() != followed[k].time_s.size() ||
          SeenAt(graph.nodes[edge->from], triad) == nullptr ||
          SeenAt(graph.nodes[edge->from + 1], triad) == nullptr) {
        continue;
      }
      moves.push_back(SeenBy(triad, graph, *edge, followed[k], reading_raw));
    }
    if (const auto offset = OffsetOf(triad, moves)) offsets.push_back(*offset);
  }
  return offsets;
}

Eigen::VectorXd MovedByClock(const ClockOffset& offset,
                             const PoseGraph& graph,
                             const ReducedSystem& system) {
  if (system.rank() < system.size()) return Eigen::VectorXd::Zero(system.size());
  // The rms of an offset d ± σ; the effect is nearly proportional to the offset.
  const double most_s = std::hypot(offset.later_s, offset.sigma_s);
  const Eigen::VectorXd rows = ChangeOfRows(offset.triad, most_s, graph, system);
  return system.covariance() * (system.B().transpose() * rows);
}

bool IsNotable(const ClockOffset& offset, const PoseSet& poses) {
  const StreamSummary* gyroscope = poses.Find(Triad::kGyroscope);
  if (gyroscope == nullptr || !(gyroscope->rate_hz > 0.0)) return false;
  return offset.p_value < kSaidChance &&
         std::abs(offset.later_s) >= 1.0 / gyroscope->rate_hz + kSurelyLonger * offset.sigma_s;
}

Finding ClockCorrected(Triad triad, double later_s, double sigma_s, Triad reference) {
  Finding finding(FindingCode::kClockCorrected,
                  OffsetWords(triad, later_s, sigma_s, reference) + "; corrected");
  finding.treatment = Treatment::kCorrected;
  return finding.About(triad).With("offset", later_s, sigma_s, "s");
}

// The remedy of the last finding is one block with all offsets, also of sensors whose offset is too
// long for moves (PoseSet::clock_lag_s).
Findings CheckClockOffsets(const SettledRun& run, const SolvedRun& solved) {
  const PoseSet& poses = run.poses;
  Findings findings;
  std::string block;
  const auto state = [&](Triad triad, double more_s) {
    block += (block.empty() ? "" : ", ") + std::string(TriadName(triad)) +
             Format(": { time_offset_s: %.5f }", poses.time_offset_s[triad] + more_s);
  };
  const std::vector<ClockOffset>& offsets = solved.unmodelled.clocks;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const ClockOffset& offset = offsets[k];
    if (!IsNotable(offset, poses)) continue;
    const double effect_sigmas = solved.unmodelled.clock_sigmas[k];
    findings.push_back(Finding(FindingCode::kClockOffset,
                               OffsetWords(offset.triad, offset.later_s, offset.sigma_s) +
                                   " according to the moves between the rests; this is not "
                                   "corrected, which shifts parameters by up to " +
                                   Format("%.2g σ; σ allow for it", effect_sigmas))
                           .About(offset.triad)
                           .With("offset", offset.later_s, offset.sigma_s, "s")
                           .With("p_value", offset.p_value)
                           .Shifting(effect_sigmas, Treatment::kWidened));
    state(offset.triad, offset.later_s);
  }
  for (const Triad triad : kTriads) {
    if (poses.clock_lag_s[triad]) state(triad, *poses.clock_lag_s[triad]);
  }
  if (!findings.empty()) findings.back().remedy = "set `sensors: { " + block + " }`";
  return findings;
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "verdict/recording_faults.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "base/messages.h"
#include "data/pose_statistics.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/graph_rows.h"
#include "solve/shared_information.h"
#include "truetriad/math/rotation.h"
#include "verdict/lost_rows.h"

namespace truetriad {
namespace {

// Chance that makes so much: of steps a tenth, a hand's accelerations being no white noise to them.
constexpr double kLevel = 1e-4;
constexpr double kLevelOfSteps = 1e-5;
// Of a parameter, less than which rounding is not worth a word.
constexpr double kRoundingSigmas = 0.5;

// Turns that tell of it, and more than which are rows of a table or of a motion.
constexpr double kFewestTurns = 8.0;
constexpr std::size_t kMostTurns = 1000;

// Stretches in which neither sensor lacks a reading that the other one has.
void AddTogether(const ReadingTrack& rates, const ReadingTrack& fields, LostRowCounter* counter) {
  std::size_t r = 0, f = 0;
  while (r < rates.time_ns.size() && f < fields.time_ns.size()) {
    if (rates.time_ns[r] != fields.time_ns[f]) {
      ++(rates.time_ns[r] < fields.time_ns[f] ? r : f);
      continue;
    }
    std::size_t count = 1;
    while (r + count < rates.time_ns.size() && f + count < fields.time_ns.size() &&
           rates.time_ns[r + count] == fields.time_ns[f + count]) {
      ++count;
    }
    counter->Add(std::span(rates.time_ns).subspan(r, count),
                 std::span(rates.reading_raw).subspan(r, count),
                 std::span(fields.reading_raw).subspan(f, count));
    r += count;
    f += count;
  }
}

// What one vector sensor shows of lost rows.
std::optional<LostRowCounter> LostRows(const PoseSet& poses,
                                       const PoseGraph& graph,
                                       const Eigen::Vector3d& sigma_raw,
                                       Triad vector) {
  if (!graph.layout.Has(Triad::kGyroscope) || !graph.layout.Has(vector)) return std::nullopt;
  const TriadModel<double> model{graph.sensitivity(vector), graph.bias(vector)};
  const double field = WorldVector(vector, graph.reference()).norm();
  const double sigma = (model.Correction() * sigma_raw).norm() / std::sqrt(3.0) / field;
  LostRowCounter counter(
      {graph.sensitivity(Triad::kGyroscope), graph.bias(Triad::kGyroscope)}, model, sigma);
  for (const RecordedMove& move : poses.moves) {
    counter.Add(move.time_ns,
                move.gyroscope_raw,
                vector == Triad::kMagnetometer ? move.magnetometer_raw : move.accelerometer_raw);
  }
  const ReadingTrack& rates = poses.tracks[Triad::kGyroscope];
  const ReadingTrack& fields = poses.tracks[vector];
  AddTogether(rates, fields, &counter);
  return counter;
}

Mechanism ActsAs(RecordingFaultKind kind) {
  switch (kind) {
    case RecordingFaultKind::kOneSided:
      return Mechanism::kOneSided;
    case RecordingFaultKind::kLostRows:
      return Mechanism::kLostRows;
    case RecordingFaultKind::kRounding:
      return Mechanism::kRounding;
    case RecordingFaultKind::kSettling:
      break;
  }
  return Mechanism::kSettlingTurns;
}

// Adds one by which the shared entries from `at` on are off by `shift`.
void AddShift(const PoseGraph& graph,
              const Eigen::MatrixXd& covariance,
              int at,
              const Eigen::VectorXd& shift,
              RecordingFault fault,
              RecordingFaults* faults) {
  if (!Acts(ActsAs(fault.kind))) return;
  const Eigen::VectorXd moved = graph.layout.basis.middleRows(at, shift.size()).transpose() * shift;
  faults->covariance += moved * moved.transpose();
  fault.effect_sigmas = LargestInSigmas(graph.layout, covariance, moved);
  faults->found.push_back(fault);
}

// A gyroscope at rest whose noise is less than a step reads the same in every rest: the mean of all
// rests is off by as much as one.
void AddRounding(const PoseSet& poses,
                 const PoseGraph& graph,
                 const Eigen::MatrixXd& covariance,
                 RecordingFaults* faults) {
  const StreamSummary* stream = poses.Find(Triad::kGyroscope);
  if (stream == nullptr || !graph.layout.Has(Triad::kGyroscope) || poses.poses.empty()) return;
  Eigen::Vector3d shift;
  for (int axis = 0; axis < 3; ++axis) {
    const double noise = stream->noise_sigma_raw[axis];
    shift[axis] = std::sqrt(RoundingVariance(noise * noise, stream->resolution_raw[axis]));
  }
  const int at = graph.layout.bias[Triad::kGyroscope];
  const Eigen::VectorXd moved = graph.layout.basis.middleRows<3>(at).transpose() * shift;
  if (LargestInSigmas(graph.layout, covariance, moved) < kRoundingSigmas) return;
  AddShift(
      graph, covariance, at, shift, {Triad::kGyroscope, RecordingFaultKind::kRounding}, faults);
}

// Rows are lost where steps from one row to the next show it.
void AddLostRows(const PoseSet& poses,
                 const PerTriad<Eigen::Vector3d>& sigma_raw,
                 const PoseGraph& graph,
                 const Eigen::MatrixXd& covariance,
                 RecordingFaults* faults) {
  double share = 0.0, looked = 0.0;
  ShareOfRows steps;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::optional<LostRowCounter> counter = LostRows(poses, graph, sigma_raw[triad], triad);
    if (!counter) continue;
    looked += 1.0;
    share = std::max(share, counter->Share());
    const ShareOfRows random = counter->AtRandom();
    if (random.chance < steps.chance) steps = random;
  }
  if (share == 0.0 && looked * steps.chance < kLevelOfSteps) share = steps.share;
  if (!(share > 0.0)) return;
  // The gyroscope turns further than it reads.
  const Eigen::Matrix3d shift = share / (1.0 - share) * graph.sensitivity(Triad::kGyroscope);
  AddShift(graph,
           covariance,
           graph.layout.sensitivity[Triad::kGyroscope],
           shift.reshaped(),
           {Triad::kGyroscope, RecordingFaultKind::kLostRows, 0.0, 0.0, share},
           faults);
}

std::string WordsOf(const RecordingFault& fault) {
  switch (fault.kind) {
    case RecordingFaultKind::kOneSided:
      return "has readings that are off to one side, which the means follow";
    case RecordingFaultKind::kLostRows:
      return Format(
          "turned further than its readings say: %.2g %% of the rows are missing, though "
          "their times are regular",
          100.0 * fault.share);
    case RecordingFaultKind::kRounding:
      return "reads in steps that are larger than its noise, so its bias is known to a step only";
    case RecordingFaultKind::kSettling:
      break;
  }
  return "has turns that are all too short by about the same angle";
}

std::string RemedyOf(RecordingFaultKind kind) {
  switch (kind) {
    case RecordingFaultKind::kOneSided:
      return "look for spikes in the log";
    case RecordingFaultKind::kLostRows:
      return "log the times at which readings were taken, and all of them";
    case RecordingFaultKind::kRounding:
      return "log it with more digits, or set a smaller full-scale range";
    case RecordingFaultKind::kSettling:
      break;
  }
  return "wait longer before and after each move, or set a wider bandwidth";
}

}  // namespace

RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const Eigen::MatrixXd& covariance) {
  RecordingFaults faults;
  faults.covariance = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  AddRounding(poses, graph, covariance, &faults);
  const bool is_coarse = !faults.found.empty();
  for (const StreamSummary& stream : poses.streams) {
    if (!graph.layout.Has(stream.triad) || stream.one_sided_raw.isZero(0.0)) continue;
    // Between two steps readings lean to one side, which rounding has counted.
    if (is_coarse && stream.triad == Triad::kGyroscope) continue;
    AddShift(graph,
             covariance,
             graph.layout.bias[stream.triad],
             stream.one_sided_raw,
             {stream.triad, RecordingFaultKind::kOneSided},
             &faults);
  }
  AddLostRows(poses, sigma_raw, graph, covariance, &faults);
  return faults;
}

void AddUnsettledTurns(const PoseSet& poses,
                       const PoseGraph& graph,
                       const ReducedSystem& system,
                       RecordingFaults* faults) {
  if (graph.nodes.size() > kMostTurns || system.rank() < system.size()) return;
  std::map<int, const TriadPose*> rests;
  for (const StaticPose& pose : poses.poses) {
    const auto& seen = pose.triads[Triad::kGyroscope];
    if (seen && !seen->quarter_sigma_raw_s.isZero(0.0)) rests[pose.number] = &*seen;
  }
  const auto rest_of = [&](std::size_t node) {
    const auto at = rests.find(graph.nodes[node].number);
    return at == rests.end() ? nullptr : at->second;
  };
  Eigen::VectorXd by = Eigen::VectorXd::Zero(system.size());
  double count = 0.0, sum = 0.0, squares = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    if (edge.rejected || edge.stated_turn >= 0) continue;
    const TriadPose* before = rest_of(edge.from);
    const TriadPose* after = rest_of(edge.from + 1);
    const Eigen::Vector3d turn = RotationLog(edge.increment.rotation);
    if (before == nullptr || after == nullptr || !(turn.norm() > 0.0)) continue;
    const Eigen::Vector3d axis = turn.normalized();
    const Eigen::Vector3d in_raw = edge.at.triad.Correction().transpose() * axis;
    const double angle = in_raw.dot(before->last_quarter_raw_s + after->first_quarter_raw_s);
    count += 1.0, sum += angle, squares += angle * angle;
    variance += in_raw.cwiseProduct(before->quarter_sigma_raw_s).squaredNorm() +
                in_raw.cwiseProduct(after->quarter_sigma_raw_s).squaredNorm();
    by += system.B().middleRows<3>(system.factors()[graph.nodes.size() + i].row).transpose() * axis;
  }
  if (count < kFewestTurns) return;
  const double mean = sum / count;
  const double scatter = std::max(variance, squares - count * mean * mean) / (count * count);
  RecordingFault fault{Triad::kGyroscope, RecordingFaultKind::kSettling};
  fault.p_value = 1.0 - ChiSquareCdf(mean * mean / scatter, 1.0);
  const bool is_shown = fault.p_value < kLevel && Acts(ActsAs(fault.kind));
  faults->tests.push_back({Triad::kGyroscope, "settling", fault.p_value, is_shown, std::nullopt});
  if (!is_shown) return;
  const Eigen::VectorXd moved = system.covariance() * by;
  fault.effect_sigmas = LargestInSigmas(graph.layout, system.covariance(), mean * moved);
  faults->covariance += (mean * mean + scatter) * moved * moved.transpose();
  faults->found.push_back(fault);
}

Findings FindingsOf(const RecordingFaults& faults) {
  Findings findings;
  for (const RecordingFault& fault : faults.found) {
    findings.push_back(
        Finding(FindingCode::kFault,
                "the " + std::string(TriadName(fault.triad)) + " " + WordsOf(fault) +
                    Format("; it moves parameters by up to %.2g times the σ that noise alone "
                           "gives, and σ are widened for it",
                           fault.effect_sigmas),
                RemedyOf(fault.kind))
            .About(fault.triad)
            .Shifting(fault.effect_sigmas, Treatment::kWidened)
            .With("p_value", fault.p_value));
    if (fault.effect_sigmas < 1.0) findings.back().As(Severity::kNote);
  }
  return findings;
}

}  // namespace truetriad

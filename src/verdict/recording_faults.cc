// SPDX-License-Identifier: Apache-2.0
#include "verdict/recording_faults.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "data/pose_statistics.h"
#include "model/mechanisms.h"
#include "problem/graph_rows.h"
#include "solve/shared_information.h"
#include "verdict/lost_rows.h"

namespace truetriad {
namespace {

// Chance makes steps and turns together show so much: a tenth of kLeftOutLevel, a hand's
// accelerations being no white noise to the steps.
constexpr double kTogetherLevel = 1e-5;
// Of a parameter, less than which rounding is not worth a word.
constexpr double kRoundingSigmas = 0.5;

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

// Adds a term by which the shared entries from `at` on are off by `shift`.
void AddShift(const PoseGraph& graph,
              const Eigen::MatrixXd& covariance,
              int at,
              const Eigen::VectorXd& shift,
              LeftOutTerm term,
              LeftOutTerms* terms) {
  if (!Acts(ActsAs(term))) return;
  const Eigen::VectorXd moved = graph.layout.basis.middleRows(at, shift.size()).transpose() * shift;
  terms->covariance += moved * moved.transpose();
  term.effect_sigmas = LargestInSigmas(graph.layout, covariance, moved);
  term.p_value = 0.0;
  terms->found.push_back(term);
}

// A gyroscope at rest whose noise is less than a step reads the same in every rest: the mean of all
// rests is off by as much as one.
void AddRounding(const PoseSet& poses,
                 const PoseGraph& graph,
                 const Eigen::MatrixXd& covariance,
                 LeftOutTerms* terms) {
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
  AddShift(graph, covariance, at, shift, {Triad::kGyroscope, LeftOutKind::kRounding}, terms);
}

// The gyroscope turns further than it reads, by this share.
void AddCommonGain(LeftOutKind kind,
                   double share,
                   const PoseGraph& graph,
                   const Eigen::MatrixXd& covariance,
                   LeftOutTerms* terms) {
  if (!(share > 0.0)) return;
  LeftOutTerm term{Triad::kGyroscope, kind};
  term.share = share;
  const Eigen::Matrix3d shift = share / (1.0 - share) * graph.sensitivity(Triad::kGyroscope);
  AddShift(graph,
           covariance,
           graph.layout.sensitivity[Triad::kGyroscope],
           shift.reshaped(),
           term,
           terms);
}

// Rows are lost where steps from one row to the next show it, or turns do, which then miss more
// along their axes than across; or both together, each less than by itself (R. A. Fisher).
void AddLostRows(const PoseSet& poses,
                 const PerTriad<Eigen::Vector3d>& sigma_raw,
                 const std::vector<TurnMiss>& misses,
                 const PoseGraph& graph,
                 const Eigen::MatrixXd& covariance,
                 LeftOutTerms* terms) {
  double sure_share = 0.0;
  ShareOfRows steps;
  double looked = 0.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::optional<LostRowCounter> counter = LostRows(poses, graph, sigma_raw[triad], triad);
    if (!counter) continue;
    looked += 1.0;
    sure_share = std::max(sure_share, counter->Share());
    const ShareOfRows random = counter->AtRandom();
    if (random.chance < steps.chance) steps = random;
  }
  AddCommonGain(LeftOutKind::kLostRows, sure_share, graph, covariance, terms);
  const ShareOfRows turns = ShareOfTurnScatter(misses);
  if (turns.chance < kLeftOutLevel) {
    AddCommonGain(LeftOutKind::kTurnScatter, turns.share, graph, covariance, terms);
  } else if (sure_share == 0.0) {
    const double product = std::min(1.0, std::max(1.0, looked) * steps.chance) * turns.chance;
    const double together = product * (1.0 - std::log(product));
    if (product > 0.0 && together > kTogetherLevel) return;
    AddCommonGain(
        LeftOutKind::kLostRows, std::max(steps.share, turns.share), graph, covariance, terms);
  }
}

}  // namespace

void AddFaultsOfRecording(const PoseSet& poses,
                          const PerTriad<Eigen::Vector3d>& sigma_raw,
                          const std::vector<TurnMiss>& misses,
                          const PoseGraph& graph,
                          const Eigen::MatrixXd& covariance,
                          LeftOutTerms* terms) {
  AddRounding(poses, graph, covariance, terms);
  const bool is_coarse =
      std::any_of(terms->found.begin(), terms->found.end(), [](const LeftOutTerm& term) {
        return term.kind == LeftOutKind::kRounding;
      });
  for (const StreamSummary& stream : poses.streams) {
    if (!graph.layout.Has(stream.triad) || stream.one_sided_raw.isZero(0.0)) continue;
    // Between two steps readings lean to one side, which rounding has counted.
    if (is_coarse && stream.triad == Triad::kGyroscope) continue;
    AddShift(graph,
             covariance,
             graph.layout.bias[stream.triad],
             stream.one_sided_raw,
             {stream.triad, LeftOutKind::kOneSided},
             terms);
  }
  AddLostRows(poses, sigma_raw, misses, graph, covariance, terms);
}

}  // namespace truetriad

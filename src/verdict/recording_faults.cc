// SPDX-License-Identifier: Apache-2.0
#include "verdict/recording_faults.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/messages.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/graph_rows.h"
#include "solve/shared_information.h"
#include "truetriad/math/rotation.h"
#include "verdict/lost_rows.h"

namespace truetriad {
namespace {

// Significance level of turns that extend into the rests.
constexpr double kLevel = 1e-4;
// Significance level of the test for rows lost at random. The test assumes white noise, which a
// hand's accelerations are not, so that its level is a tenth of kLevel.
constexpr double kLevelOfSteps = 1e-5;

// The fewest turns that are tested: fewer do not determine the scatter of their mean.
constexpr double kFewestTurns = 8.0;
// Graphs with more poses are not tested: they are of a table or a motion, without turns between
// long rests.
constexpr std::size_t kMostTurns = 1000;

// Adds to `counter` the intervals in which both sensors have readings at the same times.
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

// Compares the gyroscope with one vector sensor; unset if one of them is missing.
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

class RecordingSearch {
 public:
  RecordingSearch(const PoseSet& poses, const PoseGraph& graph, const ReducedSystem& system)
      : poses_(poses), graph_(graph), system_(system) {
    faults_.covariance = Eigen::MatrixXd::Zero(system.size(), system.size());
  }

  void FindOneSided();
  void FindLostRows(const PerTriad<Eigen::Vector3d>& sigma_raw);
  void FindUnsettledTurns();
  RecordingFaults faults() && { return std::move(faults_); }

 private:
  // The change of the free coordinates if the shared entries from `at` on change by `shift`.
  Eigen::VectorXd MovedBy(int at, const Eigen::VectorXd& shift) const {
    return graph_.layout.basis.middleRows(at, shift.size()).transpose() * shift;
  }
  double InSigmas(const Eigen::VectorXd& moved) const {
    return LargestInSigmas(graph_.layout, system_.covariance(), moved);
  }
  // Reports a fault that changes the free coordinates by `moved`, and widens the covariance.
  void Widen(const Eigen::VectorXd& moved,
             Triad triad,
             const std::string& words,
             const char* remedy,
             double p_value = 0.0);

  const PoseSet& poses_;
  const PoseGraph& graph_;
  const ReducedSystem& system_;
  RecordingFaults faults_;
};

void RecordingSearch::Widen(const Eigen::VectorXd& moved,
                            Triad triad,
                            const std::string& words,
                            const char* remedy,
                            double p_value) {
  faults_.covariance += moved * moved.transpose();
  const double sigmas = InSigmas(moved);
  Finding finding(FindingCode::kFault,
                  "the " + std::string(TriadName(triad)) + " " + words +
                      Format("; this shifts parameters by up to %.2g times the σ that noise alone "
                             "gives, and σ are widened for it",
                             sigmas),
                  remedy);
  finding.About(triad).Shifting(sigmas, Treatment::kWidened).With("p_value", p_value);
  if (sigmas < 1.0) finding.As(Severity::kNote);
  faults_.findings.push_back(std::move(finding));
}

void RecordingSearch::FindOneSided() {
  for (const StreamSummary& stream : poses_.streams) {
    if (!graph_.layout.Has(stream.triad) || stream.one_sided_raw.isZero(0.0)) continue;
    if (!Acts(Mechanism::kOneSided)) continue;
    Widen(MovedBy(graph_.layout.bias[stream.triad], stream.one_sided_raw),
          stream.triad,
          "has outliers in one direction only, which bias the means",
          "look for spikes in the log");
  }
}

// Finds lost rows by the turn from one row to the next.
void RecordingSearch::FindLostRows(const PerTriad<Eigen::Vector3d>& sigma_raw) {
  double share = 0.0, looked = 0.0;
  ShareOfRows steps;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::optional<LostRowCounter> counter = LostRows(poses_, graph_, sigma_raw[triad], triad);
    if (!counter) continue;
    looked += 1.0;
    share = std::max(share, counter->Share());
    const ShareOfRows random = counter->AtRandom();
    if (random.chance < steps.chance) steps = random;
  }
  if (share == 0.0 && looked * steps.chance < kLevelOfSteps) share = steps.share;
  if (!(share > 0.0) || !Acts(Mechanism::kLostRows)) return;
  // The unit turned by more than the readings show, so that the estimated gains are too small.
  const Eigen::Matrix3d shift = share / (1.0 - share) * graph_.sensitivity(Triad::kGyroscope);
  Widen(MovedBy(graph_.layout.sensitivity[Triad::kGyroscope], shift.reshaped()),
        Triad::kGyroscope,
        Format("turned further than its readings show: %.2g %% of the rows are missing, though "
               "their times are regular",
               100.0 * share),
        "log every reading with the time at which it was taken");
}

void RecordingSearch::FindUnsettledTurns() {
  if (graph_.nodes.size() > kMostTurns || system_.rank() < system_.size()) return;
  std::map<int, const TriadPose*> rests;
  for (const StaticPose& pose : poses_.poses) {
    const auto& seen = pose.triads[Triad::kGyroscope];
    if (seen && !seen->quarter_sigma_raw_s.isZero(0.0)) rests[pose.number] = &*seen;
  }
  const auto rest_of = [&](std::size_t node) {
    const auto at = rests.find(graph_.nodes[node].number);
    return at == rests.end() ? nullptr : at->second;
  };
  Eigen::VectorXd by = Eigen::VectorXd::Zero(system_.size());
  double count = 0.0, sum = 0.0, squares = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < graph_.increments.size(); ++i) {
    const IncrementEdge& edge = graph_.increments[i];
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
    by += system_.B().middleRows<3>(system_.factors()[graph_.nodes.size() + i].row).transpose() *
          axis;
  }
  if (count < kFewestTurns) return;
  const double mean = sum / count;
  const double scatter = std::max(variance, squares - count * mean * mean) / (count * count);
  const double p_value = 1.0 - ChiSquareCdf(mean * mean / scatter, 1.0);
  const bool is_shown = p_value < kLevel && Acts(Mechanism::kSettlingTurns);
  faults_.tests.push_back({Triad::kGyroscope, "settling", p_value, is_shown, std::nullopt});
  if (!is_shown) return;
  // The square of the true mean is expected to be mean^2 plus the variance of `mean`.
  Widen(std::hypot(mean, std::sqrt(scatter)) * (system_.covariance() * by),
        Triad::kGyroscope,
        "measures all turns too short by about the same angle",
        "wait longer before and after each move, or set a wider bandwidth",
        p_value);
}

}  // namespace

RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const ReducedSystem& system) {
  RecordingSearch search(poses, graph, system);
  search.FindOneSided();
  search.FindLostRows(sigma_raw);
  search.FindUnsettledTurns();
  return std::move(search).faults();
}

}  // namespace truetriad

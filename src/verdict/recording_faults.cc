// SPDX-License-Identifier: Apache-2.0
#include "verdict/recording_faults.h"

#include <algorithm>
#include <cmath>

#include "problem/graph_rows.h"
#include "verdict/lost_rows.h"

namespace truetriad {
namespace {

// Rows that were lost, as one vector sensor shows it.
double ShareOfLostRows(const PoseSet& poses,
                       const PoseGraph& graph,
                       const Eigen::Vector3d& sigma_raw,
                       Triad vector) {
  if (!graph.layout.Has(Triad::kGyroscope) || !graph.layout.Has(vector)) return 0.0;
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
  if (rates.time_ns == fields.time_ns) {
    counter.Add(rates.time_ns, rates.reading_raw, fields.reading_raw);
  }
  return counter.Share();
}

}  // namespace

void AddFaultsOfRecording(const PoseSet& poses,
                          const PerTriad<Eigen::Vector3d>& sigma_raw,
                          const PoseGraph& graph,
                          const Eigen::MatrixXd& covariance,
                          LeftOutTerms* terms) {
  for (const StreamSummary& stream : poses.streams) {
    if (!graph.layout.Has(stream.triad) || stream.one_sided_raw.isZero(0.0)) continue;
    AddShift(graph,
             covariance,
             graph.layout.bias[stream.triad],
             stream.one_sided_raw,
             {stream.triad, LeftOutKind::kOneSided},
             terms);
  }
  const double share = std::max(
      ShareOfLostRows(poses, graph, sigma_raw[Triad::kAccelerometer], Triad::kAccelerometer),
      ShareOfLostRows(poses, graph, sigma_raw[Triad::kMagnetometer], Triad::kMagnetometer));
  if (!(share > 0.0)) return;
  LeftOutTerm term{Triad::kGyroscope, LeftOutKind::kLostRows};
  term.share = share;
  const Eigen::Matrix3d shift = share / (1.0 - share) * graph.sensitivity(Triad::kGyroscope);
  AddShift(graph,
           covariance,
           graph.layout.sensitivity[Triad::kGyroscope],
           shift.reshaped(),
           term,
           terms);
}

}  // namespace truetriad

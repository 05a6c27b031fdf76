// SPDX-License-Identifier: Apache-2.0
#include "verdict/sessions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/messages.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// The biases of those sessions that have readings of a triad. `value` has a row for each such
// session and a column for each axis. Row k of by_free[i] is the derivative of value(k, i) by the
// free coordinates.
struct SessionBiases {
  std::vector<int> sessions;
  Eigen::MatrixX3d value;
  std::array<Eigen::MatrixXd, 3> by_free;
};

SessionBiases BiasesOf(const PoseGraph& graph, Triad triad) {
  const SharedLayout& layout = graph.layout;
  const SessionBlock& block = layout.sessions[triad];
  SessionBiases biases;
  for (std::size_t k = 0; k < block.places.size(); ++k) {
    if (block.places[k] >= 0) biases.sessions.push_back(static_cast<int>(k));
  }
  const auto count = static_cast<Eigen::Index>(biases.sessions.size());
  biases.value.resize(count, 3);
  for (Eigen::MatrixXd& by_free : biases.by_free) by_free.resize(count, layout.basis.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    const int session = biases.sessions[static_cast<std::size_t>(k)];
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::RowVectorXd entry = Eigen::RowVectorXd::Unit(layout.size, layout.bias[triad] + axis);
      for (int i = 0; i < block.block_count(); ++i) {
        entry[block.block_at(i) + axis] = block.Factor(i, session);
      }
      biases.value(k, axis) = entry.dot(graph.shared);
      biases.by_free[static_cast<std::size_t>(axis)].row(k) = entry * layout.basis;
    }
  }
  return biases;
}

// The sum of squares of n sessions' biases about their mean has the expectation (n - 1) v + tr(P
// C). v is the variance from session to session, C the covariance of the estimated biases, and P
// the projector that subtracts the mean.
void AddScatter(const Eigen::VectorXd& values,
                const Eigen::MatrixXd& covariance,
                int axis,
                BiasRepeatability* scatter) {
  const auto count = static_cast<double>(values.size());
  const double dof = count - 1.0;
  const double seen = (values.array() - values.mean()).square().sum() / dof;
  const double known = (covariance.trace() - covariance.sum() / count) / dof;
  const double variance = std::max(seen - known, 0.0);
  scatter->value_raw[axis] = std::sqrt(variance);
  // σ of `value_raw`, which is the root of a mean of `dof` squares.
  scatter->sigma_raw[axis] = std::sqrt(std::max(seen, known) / (2.0 * dof));
  const double of_mean = covariance.sum() / (count * count);
  scatter->next_session_raw[axis] = std::sqrt(variance * (1.0 + 1.0 / count) + of_mean);
}

int PosesOf(const PoseGraph& graph, Triad triad, int session) {
  int count = 0;
  for (const PoseNode& node : graph.nodes) {
    if (node.session != session || node.role != PoseRole::kRest) continue;
    count += static_cast<int>(std::count_if(
        node.observations.begin(), node.observations.end(), [triad](const Observation& seen) {
          return seen.triad == triad;
        }));
  }
  return count;
}

}  // namespace

void StateSessions(const PoseSet& poses,
                   const PoseGraph& graph,
                   const Eigen::MatrixXd& free_covariance,
                   RestQuality* quality) {
  for (const Triad triad : kTriads) {
    if (graph.layout.sessions[triad].block_count() == 0) continue;
    const SessionBiases biases = BiasesOf(graph, triad);
    const std::size_t first = quality->sessions.size();
    for (std::size_t k = 0; k < biases.sessions.size(); ++k) {
      const int session = biases.sessions[k];
      SessionBias& stated = quality->sessions.emplace_back();
      stated.session = session + 1;
      stated.file = poses.sessions[static_cast<std::size_t>(session)].source;
      stated.triad = triad;
      stated.poses = PosesOf(graph, triad, session);
      stated.bias_raw = biases.value.row(static_cast<Eigen::Index>(k));
    }
    BiasRepeatability& scatter = quality->repeatability.emplace_back();
    scatter.triad = triad;
    scatter.sessions = static_cast<int>(biases.sessions.size());
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::MatrixXd& by_free = biases.by_free[static_cast<std::size_t>(axis)];
      const Eigen::MatrixXd covariance = by_free * free_covariance * by_free.transpose();
      for (std::size_t k = 0; k < biases.sessions.size(); ++k) {
        const auto row = static_cast<Eigen::Index>(k);
        quality->sessions[first + k].sigma_raw[axis] =
            std::sqrt(std::max(covariance(row, row), 0.0));
      }
      AddScatter(biases.value.col(axis), covariance, axis, &scatter);
    }
  }
}

Findings CheckSessions(const SettledRun& run, const SolvedRun& solved) {
  Findings findings;
  for (const BiasRepeatability& scatter : solved.stated.quality.rests.repeatability) {
    const StreamSummary* stream = run.poses.Find(scatter.triad);
    const std::string unit = stream != nullptr ? stream->unit.name : "";
    const double most = scatter.next_session_raw.maxCoeff();
    findings.push_back(
        Finding(
            FindingCode::kSessions,
            std::string(TriadName(scatter.triad)) + ": each of " +
                std::to_string(scatter.sessions) +
                " sessions has its own bias; the reported bias is their mean, and its σ is that of "
                "the mean; after the next switch-on the bias differs from this mean by " +
                Format("%.2g ", most) + unit + " (1 σ, worst axis)")
            .About(scatter.triad)
            .With("sessions", scatter.sessions)
            .With("next_session", most, unit));
  }
  return findings;
}

}  // namespace truetriad

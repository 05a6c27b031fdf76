// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/model/triad_model.h"

namespace truetriad {

// Largest number of sessions of a unit. The Jacobian of a pose is on the stack; session biases take
// 3 (16 - 1) columns of it for each of 3 triads (kMaxSharedSize).
inline constexpr int kMaxSessions = 16;

// The session biases of a triad, as differences from the triad's bias. Each session but the last
// has a block of 3; the last session's difference is minus the sum of the others. The triad's bias
// is thus the mean over all sessions.
struct SessionBlock {
  int at = -1;
  // For each session: its place among the sessions with readings of the triad; -1 if it has no such
  // readings.
  std::vector<int> places;
  int seen = 0;  // number of sessions with readings of the triad

  int block_count() const { return at < 0 ? 0 : seen - 1; }
  int size() const { return 3 * block_count(); }
  int block_at(int i) const { return at + 3 * i; }

  // The factor of block `i` in a session: 1 in the block's own session, -1 in the last session, 0
  // in others.
  double Factor(int i, int session) const {
    if (session < 0 || session >= static_cast<int>(places.size())) return 0.0;
    const int place = places[static_cast<std::size_t>(session)];
    return place == i ? 1.0 : place == seen - 1 ? -1.0 : 0.0;
  }

  // Adds the session's difference to the bias of the model.
  void AddTo(int session, const double* shared, TriadModel<double>* model) const {
    for (int i = 0; i < block_count(); ++i) {
      if (const double factor = Factor(i, session); factor != 0.0) {
        model->bias += factor * Eigen::Map<const Eigen::Vector3d>(shared + block_at(i));
      }
    }
  }
};

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/model/triad_model.h"

namespace truetriad {

// Largest number of sessions of a unit. The Jacobian of a pose is on the stack, with 3 triads times
// 3 (16 - 1) columns for their biases (kMaxSharedSize).
inline constexpr int kMaxSessions = 16;

// The session biases of a triad, as differences from the triad's bias, in blocks of 3: one for each
// session but the last, whose difference is minus the sum of the others. The triad's bias is thus
// the mean over all sessions.
struct SessionBlock {
  int at = -1;
  // For each session its place among those with readings of the triad; -1: it has none.
  std::vector<int> places;
  int seen = 0;  // number of sessions with readings of the triad

  int block_count() const { return at < 0 ? 0 : seen - 1; }
  int size() const { return 3 * block_count(); }
  int block_at(int i) const { return at + 3 * i; }

  // The factor of block `i` in a session: 1 in the block's own, -1 in the last, 0 in others.
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

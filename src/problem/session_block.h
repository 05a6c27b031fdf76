// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/model/triad_model.h"

namespace truetriad {

// Sessions of one unit that may have a bias each. The Jacobian of a pose stands on the stack, with
// room for their columns (kMaxSharedSize).
inline constexpr int kMaxSessions = 16;

// Where a triad's bias differs from session to session: what is added to its bias, in blocks of 3,
// one for each session but the last, whose own is minus their sum. The bias itself thus is the mean
// of all sessions.
struct SessionBlock {
  int at = -1;
  // Of each session its place among those in which the triad was seen; -1: it was not.
  std::vector<int> places;
  int seen = 0;  // sessions

  int block_count() const { return at < 0 ? 0 : seen - 1; }
  int size() const { return 3 * block_count(); }
  int block_at(int i) const { return at + 3 * i; }

  // What block `i` is multiplied with in a session: 1 in its own, -1 in the last.
  double Factor(int i, int session) const {
    if (session < 0 || session >= static_cast<int>(places.size())) return 0.0;
    const int place = places[static_cast<std::size_t>(session)];
    return place == i ? 1.0 : place == seen - 1 ? -1.0 : 0.0;
  }

  // Adds what the session adds to the bias of the model.
  void AddTo(int session, const double* shared, TriadModel<double>* model) const {
    for (int i = 0; i < block_count(); ++i) {
      if (const double factor = Factor(i, session); factor != 0.0) {
        model->bias += factor * Eigen::Map<const Eigen::Vector3d>(shared + block_at(i));
      }
    }
  }
};

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "math/random.h"

#include <cmath>

namespace truetriad {

double Random::Normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u = 0.0;
  double v = 0.0;
  double s = 0.0;
  do {
    u = Uniform(-1.0, 1.0);
    v = Uniform(-1.0, 1.0);
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  const double factor = std::sqrt(-2.0 * std::log(s) / s);
  spare_ = v * factor;
  has_spare_ = true;
  return u * factor;
}

Eigen::Quaterniond Random::Rotation() {
  Eigen::Vector4d q;
  do {
    for (int i = 0; i < 4; ++i) q[i] = Normal();
  } while (q.norm() < 1e-6);
  q.normalize();
  return {q[3], q[0], q[1], q[2]};
}

}  // namespace truetriad

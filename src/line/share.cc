// SPDX-License-Identifier: Apache-2.0
#include "line/share.h"

#include <algorithm>
#include <cmath>

#include "math/distributions.h"

namespace truetriad::line {

Estimate ShareOf(int count, int all, double confidence) {
  if (all <= 0) return {};
  const double n = all, share = count / n;
  const double z = NormalQuantile(0.5 * (1.0 + confidence));
  const double center = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half =
      z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n);
  return {share, {std::max(0.0, center - half), std::min(1.0, center + half)}};
}

}  // namespace truetriad::line

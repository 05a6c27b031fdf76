// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/probed_row.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <glog/logging.h>

namespace truetriad {
namespace {

using RowJacobian = Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>;

}  // namespace

ProbedRow::ProbedRow(std::shared_ptr<const Row> row, std::vector<Probe> probes)
    : Row(row->num_residuals()), row_(std::move(row)), probes_(std::move(probes)) {
  CHECK_EQ(num_residuals(), 3);
  AddFirstShared(row_->shared_blocks(), probes_.size());
  for (const Probe& probe : probes_) {
    AddShared(probe.block);
    CHECK_EQ(probe.block.size,
             probe.like < 0 ? static_cast<int>(probe.by.cols())
                            : row_->shared_blocks()[PlaceOf(probe.like)].size);
  }
  const std::vector<int>& sizes = row_->parameter_block_sizes();
  for (std::size_t i = row_->shared_blocks().size(); i < sizes.size(); ++i) AddState(sizes[i]);
}

std::size_t ProbedRow::PlaceOf(int offset) const {
  const std::vector<SharedBlock>& blocks = row_->shared_blocks();
  const auto found = std::find_if(blocks.begin(), blocks.end(), [offset](const SharedBlock& block) {
    return block.offset == offset;
  });
  CHECK(found != blocks.end());
  return static_cast<std::size_t>(found - blocks.begin());
}

bool ProbedRow::Evaluate(double const* const* parameters,
                         double* residuals,
                         double** jacobians) const {
  const std::size_t own = row_->shared_blocks().size(),
                    count = row_->parameter_block_sizes().size();
  std::vector<const double*> own_parameters(count);
  std::copy(parameters + own + probes_.size(),
            parameters + count + probes_.size(),
            std::copy(parameters, parameters + own, own_parameters.begin()));
  // All derivatives of the row: probes may be like any of them.
  std::vector<std::vector<double>> buffers(count);
  std::vector<double*> own_jacobians(count);
  for (std::size_t i = 0; i < count; ++i) {
    double* asked = jacobians == nullptr ? nullptr : jacobians[i < own ? i : i + probes_.size()];
    if (asked == nullptr) {
      buffers[i].resize(3 * static_cast<std::size_t>(row_->parameter_block_sizes()[i]));
      asked = buffers[i].data();
    }
    own_jacobians[i] = asked;
  }
  if (!row_->Evaluate(own_parameters.data(), residuals, own_jacobians.data())) return false;
  for (std::size_t p = 0; p < probes_.size(); ++p) {
    const Probe& probe = probes_[p];
    Columns by = probe.by;
    if (probe.like >= 0) {
      by = probe.factor * RowJacobian(own_jacobians[PlaceOf(probe.like)], 3, probe.block.size);
    }
    const Eigen::Map<const Eigen::VectorXd> h(parameters[own + p], probe.block.size);
    Eigen::Map<Eigen::Vector3d>{residuals} += by * h;
    if (jacobians == nullptr || jacobians[own + p] == nullptr) continue;
    RowJacobian(jacobians[own + p], 3, probe.block.size) = by;
  }
  return true;
}

}  // namespace truetriad

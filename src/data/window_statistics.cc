// SPDX-License-Identifier: Apache-2.0
#include "data/window_statistics.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <glog/logging.h>

namespace truetriad {

void TriadWindow::Merge(const TriadWindow& later) {
  if (later.count == 0) return;
  if (count == 0) {
    *this = later;
    return;
  }
  const double n1 = static_cast<double>(count);
  const double n2 = static_cast<double>(later.count);
  // Chan, Golub, LeVeque 1983, eq. (2.1): no large sums are subtracted.
  const Eigen::Vector3d delta = later.mean_raw - mean_raw;
  mean_raw += delta * (n2 / (n1 + n2));
  scatter_raw += later.scatter_raw + delta * delta.transpose() * (n1 * n2 / (n1 + n2));
  minimum_raw = minimum_raw.cwiseMin(later.minimum_raw);
  maximum_raw = maximum_raw.cwiseMax(later.maximum_raw);
  count += later.count;
  temperature_count += later.temperature_count;
  temperature_sum_degc += later.temperature_sum_degc;
  last_ns = later.last_ns;
  last_row = later.last_row;
}

TriadWindow Summarize(const SampleBlock& block, std::size_t begin, std::size_t end) {
  DCHECK_LT(begin, end);
  const double x0 = block.x[begin], y0 = block.y[begin], z0 = block.z[begin];
  double sx = 0, sy = 0, sz = 0, sxx = 0, sxy = 0, sxz = 0, syy = 0, syz = 0, szz = 0;
  double low_x = x0, low_y = y0, low_z = z0, high_x = x0, high_y = y0, high_z = z0;
  for (std::size_t i = begin + 1; i < end; ++i) {
    const double x = block.x[i] - x0, y = block.y[i] - y0, z = block.z[i] - z0;
    sx += x, sy += y, sz += z;
    sxx += x * x, sxy += x * y, sxz += x * z, syy += y * y, syz += y * z, szz += z * z;
    low_x = std::min(low_x, block.x[i]), high_x = std::max(high_x, block.x[i]);
    low_y = std::min(low_y, block.y[i]), high_y = std::max(high_y, block.y[i]);
    low_z = std::min(low_z, block.z[i]), high_z = std::max(high_z, block.z[i]);
  }
  const double n = static_cast<double>(end - begin);
  const Eigen::Vector3d shift = Eigen::Vector3d(sx, sy, sz) / n;

  TriadWindow window;
  window.count = static_cast<std::int64_t>(end - begin);
  window.mean_raw = Eigen::Vector3d(x0, y0, z0) + shift;
  window.scatter_raw << sxx, sxy, sxz, sxy, syy, syz, sxz, syz, szz;
  window.scatter_raw -= n * shift * shift.transpose();
  window.minimum_raw = Eigen::Vector3d(low_x, low_y, low_z);
  window.maximum_raw = Eigen::Vector3d(high_x, high_y, high_z);
  if (!block.temperature_degc.empty()) {
    for (std::size_t i = begin; i < end; ++i) {
      const double temperature = block.temperature_degc[i];
      if (std::isnan(temperature)) continue;
      window.temperature_sum_degc += temperature;
      ++window.temperature_count;
    }
  }
  window.first_ns = block.time_ns[begin], window.last_ns = block.time_ns[end - 1];
  window.first_row = block.row[begin], window.last_row = block.row[end - 1];
  return window;
}

WindowBuffer::WindowBuffer(std::int64_t origin_ns,
                           std::int64_t width_ns,
                           std::vector<Triad> streams)
    : origin_ns_(origin_ns), width_ns_(width_ns), streams_(std::move(streams)) {
  CHECK_GT(width_ns, 0);
  cursor_.items.fill(0);
  latest_index_.items.fill(-1);
  // Reserves memory for windows that may wait; pages that are never written cost nothing.
  for (const Triad triad : streams_) windows_[triad].reserve(2 * kMostWindows);
}

std::size_t WindowBuffer::Slot(std::int64_t window_index, std::size_t hint) {
  while (hint < index_.size() && index_[hint] < window_index) ++hint;
  if (hint == index_.size() || index_[hint] != window_index) {
    const auto at = static_cast<std::ptrdiff_t>(hint);
    index_.insert(index_.begin() + at, window_index);
    for (const Triad triad : streams_) {
      windows_[triad].insert(windows_[triad].begin() + at, TriadWindow());
      // If a slot is inserted before a stream's last one, the index of the last one shifts.
      if (latest_index_[triad] > window_index) ++cursor_[triad];
    }
  }
  return hint;
}

Status WindowBuffer::Add(const SampleBlock& block) {
  for (std::size_t begin = 0; begin < block.x.size();) {
    const std::int64_t index = (block.time_ns[begin] - origin_ns_) / width_ns_;
    const std::int64_t end_ns = origin_ns_ + (index + 1) * width_ns_;
    std::size_t end = begin + 1;
    while (end < block.x.size() && block.time_ns[end] < end_ns) ++end;
    if (index < dropped_before_) {
      return Error(ErrorCode::kTimeGoesBack,
                   "the streams of the recording are out of step: the " +
                       std::string(TriadName(block.triad)) + " at row " +
                       std::to_string(block.row[begin]) +
                       " is far behind the others; sort each file by time");
    }
    const std::size_t slot = Slot(index, cursor_[block.triad]);
    windows_[block.triad][slot].Merge(Summarize(block, begin, end));
    cursor_[block.triad] = slot;
    latest_index_[block.triad] = index;
    begin = end;
  }
  return {};
}

std::size_t WindowBuffer::CompleteCount() const {
  std::size_t complete = index_.size();
  for (const Triad triad : streams_) {
    const std::size_t done = latest_index_[triad] < dropped_before_ ? 0 : cursor_[triad];
    complete = std::min(complete, done);
  }
  if (index_.size() > kMostWindows) complete = std::max(complete, index_.size() - kMostWindows);
  return complete;
}

void WindowBuffer::DropFront(std::size_t windows) {
  CHECK_LE(windows, index_.size());
  if (windows == 0) return;
  const auto count = static_cast<std::ptrdiff_t>(windows);
  dropped_before_ = index_[windows - 1] + 1;
  index_.erase(index_.begin(), index_.begin() + count);
  for (const Triad triad : streams_) {
    windows_[triad].erase(windows_[triad].begin(), windows_[triad].begin() + count);
    cursor_[triad] -= std::min(cursor_[triad], windows);
  }
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_spacing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace truetriad {
namespace {

// 1024 spacings: their quantiles at 5 and 95 % rest on fifty each.
constexpr std::size_t kFirstSamples = 1025;
/// So few missing samples are filled: noise over ten samples of a line is lost to nobody's harm.
constexpr std::int64_t kMostFilledSteps = 10;

SpacedStream::Readings Part(const SpacedStream::Readings& readings,
                            std::size_t begin,
                            std::size_t end) {
  SpacedStream::Readings part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    part[axis] = readings[axis].subspan(begin, end - begin);
  }
  return part;
}

}  // namespace

void SpacedStream::Add(const SampleBlock& block) {
  const Readings readings = {block.x, block.y, block.z};
  if (settled_) return Process(block.time_ns, readings);
  pending_ns_.insert(pending_ns_.end(), block.time_ns.begin(), block.time_ns.end());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    pending_[axis].insert(pending_[axis].end(), readings[axis].begin(), readings[axis].end());
  }
  if (pending_ns_.size() >= kFirstSamples) Settle();
}

void SpacedStream::Settle() {
  settled_ = true;
  std::vector<double> spacings_ns;
  for (std::size_t i = 1; i < pending_ns_.size() && i < kFirstSamples; ++i) {
    spacings_ns.push_back(static_cast<double>(pending_ns_[i] - pending_ns_[i - 1]));
  }
  if (!spacings_ns.empty()) {
    std::sort(spacings_ns.begin(), spacings_ns.end());
    const auto quantile = [&](double share) {
      return spacings_ns[static_cast<std::size_t>(share *
                                                  static_cast<double>(spacings_ns.size() - 1))];
    };
    // The mean, since stamps in whole milliseconds alternate about it, but without the gaps. Stamps
    // that come in bursts have a median of zero.
    const double longest = quantile(0.5) > 0.0 ? 3.0 * quantile(0.5) : spacings_ns.back();
    double sum = 0.0;
    std::size_t count = 0;
    for (; count < spacings_ns.size() && spacings_ns[count] <= longest; ++count) {
      sum += spacings_ns[count];
    }
    typical_ns_ = sum / static_cast<double>(count);
    irregular_ = quantile(0.95) > 1.5 * typical_ns_ || quantile(0.05) < 0.5 * typical_ns_;
    break_ns_ =
        std::max((kMostFilledSteps + 1.5) * typical_ns_, irregular_ ? 3.0 * quantile(0.95) : 0.0);
  }
  Process(pending_ns_, {pending_[0], pending_[1], pending_[2]});
  pending_ns_ = {};
  pending_ = {};
}

std::int64_t SpacedStream::MissingBefore(std::span<const std::int64_t> time_ns,
                                         std::size_t i) const {
  const auto spacing_ns = static_cast<double>(time_ns[i] - (i == 0 ? last_ns_ : time_ns[i - 1]));
  if (spacing_ns > break_ns_) return -1;
  if (irregular_ || spacing_ns <= 1.5 * typical_ns_) return 0;
  std::int64_t missing = std::llround(spacing_ns / typical_ns_) - 1;
  if (i + 1 < time_ns.size()) {
    // A stamp that is only late is followed by a short spacing: together they are as many as usual.
    const auto next_ns = static_cast<double>(time_ns[i + 1] - time_ns[i]);
    if (next_ns < 0.75 * typical_ns_) {
      missing =
          std::min<std::int64_t>(missing, std::llround((spacing_ns + next_ns) / typical_ns_) - 2);
    }
  }
  return std::max<std::int64_t>(missing, 0);
}

void SpacedStream::Process(std::span<const std::int64_t> time_ns, const Readings& readings) {
  std::size_t begin = 0;  // First sample not handed over.
  for (std::size_t i = 0; i < time_ns.size(); ++i) {
    if (i == 0 && !started_) continue;
    const std::int64_t previous_ns = i == 0 ? last_ns_ : time_ns[i - 1];
    const std::int64_t missing = MissingBefore(time_ns, i);
    if (missing >= 0) {
      intervals_ += missing + 1;
      span_ns_ += time_ns[i] - previous_ns;
    }
    if (missing == 0) continue;
    if (i > begin) HandOver(Part(readings, begin, i), time_ns[begin]);
    begin = i;
    if (missing > 0) {
      Fill(missing, {readings[0][i], readings[1][i], readings[2][i]});
    } else {
      end_();
      ++breaks_;
    }
  }
  if (time_ns.empty()) return;
  HandOver(Part(readings, begin, time_ns.size()), time_ns[begin]);
  started_ = true;
  last_ns_ = time_ns.back();
}

void SpacedStream::HandOver(const Readings& readings, std::int64_t start_ns) {
  add_(readings, start_ns);
  samples_ += static_cast<std::int64_t>(readings[0].size());
  for (std::size_t axis = 0; axis < 3; ++axis) last_[axis] = readings[axis].back();
}

void SpacedStream::Fill(std::int64_t missing, const std::array<double, 3>& next) {
  std::array<std::array<double, kMostFilledSteps>, 3> line{};
  Readings readings;
  const auto count = static_cast<std::size_t>(missing);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < count; ++i) {
      line[axis][i] = std::lerp(
          last_[axis], next[axis], static_cast<double>(i + 1) / static_cast<double>(missing + 1));
    }
    readings[axis] = {line[axis].data(), count};
  }
  HandOver(readings, last_ns_);
  filled_ += missing;
}

void SpacedStream::Finish() {
  if (!settled_) Settle();
  end_();
}

double SpacedStream::spacing_ns() const {
  return intervals_ > 0 ? static_cast<double>(span_ns_) / static_cast<double>(intervals_) : 0.0;
}

}  // namespace truetriad

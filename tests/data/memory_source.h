// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/sample_source.h"

namespace truetriad {

/// One stream of a recording held in memory.
struct MemoryStream {
  StreamInfo info;
  std::vector<std::int64_t> time_ns, row;
  std::vector<double> x, y, z, temperature_degc;
  std::vector<std::int32_t> pose;

  explicit MemoryStream(Triad triad, std::string unit = "counts") {
    info.triad = triad;
    info.unit = {std::move(unit), 1.0, true};
    info.file = "memory.csv";
  }
  void Add(std::int64_t at_ns, const Eigen::Vector3d& reading) {
    row.push_back(static_cast<std::int64_t>(row.size()));
    time_ns.push_back(at_ns);
    x.push_back(reading.x()), y.push_back(reading.y()), z.push_back(reading.z());
  }
};

/// Hands streams over in blocks, the one that lags most first, as the io layer does.
class MemorySource : public SampleSource {
 public:
  explicit MemorySource(std::vector<MemoryStream> streams, std::size_t block_size = 4096)
      : streams_(std::move(streams)), next_(streams_.size(), 0), block_size_(block_size) {
    info_.path = "memory";
    for (MemoryStream& stream : streams_) {
      stream.info.has_temperature = !stream.temperature_degc.empty();
      stream.info.has_pose_column = !stream.pose.empty();
      info_.streams.push_back(stream.info);
    }
  }

  RecordingInfo& mutable_info() { return info_; }
  const RecordingInfo& info() const override { return info_; }

  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    blocks->clear();
    std::size_t lagging = streams_.size();
    for (std::size_t s = 0; s < streams_.size(); ++s) {
      if (next_[s] == streams_[s].x.size()) continue;
      if (lagging == streams_.size() ||
          streams_[s].time_ns[next_[s]] < streams_[lagging].time_ns[next_[lagging]]) {
        lagging = s;
      }
    }
    if (lagging == streams_.size()) return false;
    const MemoryStream& stream = streams_[lagging];
    const std::size_t begin = next_[lagging];
    const std::size_t count = std::min(block_size_, stream.x.size() - begin);
    next_[lagging] += count;
    const auto part = [&](const auto& values) {
      return values.empty() ? std::span(values) : std::span(values).subspan(begin, count);
    };
    blocks->push_back({stream.info.triad,
                       part(stream.time_ns),
                       part(stream.x),
                       part(stream.y),
                       part(stream.z),
                       part(stream.temperature_degc),
                       part(stream.pose),
                       part(stream.row)});
    return true;
  }

  double progress() const override {
    return static_cast<double>(next_[0]) / static_cast<double>(streams_[0].x.size());
  }
  StreamCounts counts(Triad triad) const override {
    for (const MemoryStream& stream : streams_) {
      if (stream.info.triad == triad) return {static_cast<std::int64_t>(stream.x.size()), 0};
    }
    return {};
  }
  std::vector<InputFile> inputs() const override { return {}; }

 private:
  std::vector<MemoryStream> streams_;
  std::vector<std::size_t> next_;
  std::size_t block_size_;
  RecordingInfo info_;
};

}  // namespace truetriad

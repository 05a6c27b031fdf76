// SPDX-License-Identifier: Apache-2.0
#include "python/array_source.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "io/text_file.h"

namespace truetriad::python {
namespace {

template <typename T>
void KeepRows(const std::vector<std::int64_t>& rows, std::vector<T>* values) {
  if (values->empty()) return;
  std::size_t kept = 0;
  for (const std::int64_t row : rows) (*values)[kept++] = (*values)[static_cast<std::size_t>(row)];
  values->resize(kept);
}

Error AtRow(const std::string& name,
            const ArrayStream& stream,
            std::int64_t row,
            ErrorCode code,
            const std::string& what) {
  return Error(code,
               {name},
               std::string(TriadName(stream.triad)) + ", row " + std::to_string(row) + ": " + what);
}

Status SettleStream(const std::string& name, ArrayStream* stream) {
  stream->row.clear();
  for (std::size_t i = 0; i < stream->size(); ++i) {
    const double sum = std::abs(stream->x[i]) + std::abs(stream->y[i]) + std::abs(stream->z[i]);
    const auto row = static_cast<std::int64_t>(i);
    if (std::isinf(sum)) {
      return AtRow(name, *stream, row, ErrorCode::kValueOutOfRange, "the reading is infinite");
    }
    if (!std::isnan(sum)) stream->row.push_back(row);
  }
  if (stream->row.size() < stream->size()) {
    for (auto* values : {&stream->x, &stream->y, &stream->z, &stream->temperature_degc}) {
      KeepRows(stream->row, values);
    }
    KeepRows(stream->row, &stream->time_ns);
    KeepRows(stream->row, &stream->pose);
  }
  const auto back = std::adjacent_find(
      stream->time_ns.begin(), stream->time_ns.end(), [](auto a, auto b) { return b < a; });
  if (back != stream->time_ns.end()) {
    const auto row = stream->row[static_cast<std::size_t>(back - stream->time_ns.begin()) + 1];
    return AtRow(name,
                 *stream,
                 row,
                 ErrorCode::kTimeGoesBack,
                 "the time is before the previous reading's; sort the readings by time");
  }
  return {};
}

/// Hash of the bytes of a vector.
template <typename T>
std::string HashOf(const std::vector<T>& values) {
  return Sha256Hex({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

class ArraySource : public SampleSource {
 public:
  explicit ArraySource(std::shared_ptr<const ArrayRecording> recording)
      : recording_(std::move(recording)), at_(recording_->streams.size(), 0) {
    info_.path = recording_->name;
    info_.serial = recording_->serial;
    info_.has_time = recording_->has_time;
    for (const ArrayStream& stream : recording_->streams) {
      StreamInfo info;
      info.triad = stream.triad;
      info.unit = stream.unit;
      info.file = recording_->name;
      info.has_temperature = !stream.temperature_degc.empty();
      info.has_pose_column = !stream.pose.empty();
      info_.streams.push_back(std::move(info));
      total_ += stream.size();
    }
  }

  const RecordingInfo& info() const override { return info_; }

  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    blocks->clear();
    // All streams are read up to the earliest time at which one of them has filled a block.
    std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
    for (std::size_t k = 0; k < at_.size(); ++k) {
      const ArrayStream& stream = recording_->streams[k];
      const std::size_t last = at_[k] + kBlockRows;
      if (last < stream.size()) until_ns = std::min(until_ns, TimeOf(stream, last));
    }
    for (std::size_t k = 0; k < at_.size(); ++k) {
      const ArrayStream& stream = recording_->streams[k];
      const std::size_t first = at_[k];
      std::size_t end = std::min(first + kBlockRows, stream.size());
      while (end > first && TimeOf(stream, end - 1) > until_ns) --end;
      if (end == first) continue;
      blocks->push_back(BlockOf(stream, first, end - first));
      at_[k] = end;
      read_ += end - first;
    }
    return !blocks->empty();
  }

  double progress() const override {
    return total_ == 0 ? 1.0 : static_cast<double>(read_) / static_cast<double>(total_);
  }

  StreamCounts counts(Triad triad) const override {
    for (std::size_t k = 0; k < at_.size(); ++k) {
      if (recording_->streams[k].triad == triad) return {static_cast<std::int64_t>(at_[k]), 0};
    }
    return {};
  }

  std::vector<InputFile> inputs() const override {
    std::string hashes;
    std::size_t longest = 0;
    for (const ArrayStream& s : recording_->streams) {
      hashes += std::string(TriadName(s.triad)) + s.unit.name + HashOf(s.time_ns) + HashOf(s.x) +
                HashOf(s.y) + HashOf(s.z) + HashOf(s.temperature_degc) + HashOf(s.pose);
      longest = std::max(longest, s.size());
    }
    return {{recording_->name, Sha256Hex(hashes), static_cast<std::int64_t>(longest)}};
  }

 private:
  static constexpr std::size_t kBlockRows = 4096;  // A block takes about 100 kB.

  static std::int64_t TimeOf(const ArrayStream& stream, std::size_t i) {
    return stream.time_ns.empty() ? stream.row[i] : stream.time_ns[i];
  }

  static SampleBlock BlockOf(const ArrayStream& stream, std::size_t first, std::size_t count) {
    const auto part = [&](const auto& values) {
      return values.empty() ? std::span(values) : std::span(values).subspan(first, count);
    };
    SampleBlock block;
    block.triad = stream.triad;
    block.time_ns = part(stream.time_ns.empty() ? stream.row : stream.time_ns);
    block.x = part(stream.x);
    block.y = part(stream.y);
    block.z = part(stream.z);
    block.temperature_degc = part(stream.temperature_degc);
    block.pose = part(stream.pose);
    block.row = part(stream.row);
    return block;
  }

  std::shared_ptr<const ArrayRecording> recording_;
  RecordingInfo info_;
  std::vector<std::size_t> at_;  // Next sample of each stream.
  std::size_t read_ = 0, total_ = 0;
};

}  // namespace

Status ArrayRecording::Settle() {
  if (streams.empty()) {
    return Error(ErrorCode::kMissingSensor,
                 {name},
                 "has no sensor; expected accelerometer, gyroscope or magnetometer");
  }
  has_time = !streams.front().time_ns.empty() || streams.front().size() == 0;
  PerTriad<bool> is_there{};
  for (ArrayStream& stream : streams) {
    if (std::exchange(is_there[stream.triad], true)) {
      return Error(ErrorCode::kConflictingArguments,
                   {name},
                   "has the " + std::string(TriadName(stream.triad)) + " twice");
    }
    if (stream.size() > 0 && stream.time_ns.empty() == has_time) {
      return Error(ErrorCode::kMissingTime, {name}, "some sensors have times and others have none");
    }
    TRUETRIAD_RETURN_IF_ERROR(SettleStream(name, &stream));
  }
  return {};
}

std::unique_ptr<SampleSource> OpenArrays(std::shared_ptr<const ArrayRecording> recording) {
  return std::make_unique<ArraySource>(std::move(recording));
}

}  // namespace truetriad::python

// SPDX-License-Identifier: Apache-2.0
//
// Readings without a file: a few bytes are a stretch of many rows, so that short inputs make
// recordings in which something rests, turns, clips, stops or is repeated.
#include <array>
#include <limits>

#include "fuzz/fuzz_target.h"
#include "fuzz/selection.h"
#include "truetriad/data/pose_collection.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

/// Stretches of nine bytes: kind and length, what is added to the time between rows, and what every
/// reading changes by.
class MadeSource : public SampleSource {
 public:
  MadeSource(std::uint8_t streams, fuzz::Bytes script) : script_(script) {
    info_.path = "made.csv";
    info_.has_time = (streams & 8U) == 0;
    for (const Triad triad : kTriads) {
      if ((streams >> static_cast<unsigned>(triad) & 1U) == 0) continue;
      StreamInfo stream;
      stream.triad = triad;
      stream.unit = *ParseTriadUnit(triad, (streams & 16U) != 0 ? "counts" : TruthUnitName(triad));
      stream.file = "made.csv";
      stream.has_temperature = (streams & 32U) != 0;
      stream.has_ambient = (streams & 64U) != 0;
      stream.has_pose_column = true;
      info_.streams.push_back(stream);
    }
  }

  const RecordingInfo& info() const override { return info_; }
  double progress() const override { return 0.5; }
  StreamCounts counts(Triad triad) const override {
    return counts_[static_cast<std::size_t>(triad)];
  }
  std::vector<InputFile> inputs() const override { return {}; }

  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    blocks->clear();
    if (script_.size() < kStretch || row_ > kMostRows) return false;
    times_.clear();
    for (auto& axis : values_) axis.clear();
    temperatures_.clear();
    pose_.clear();
    rows_.clear();
    const fuzz::Bytes stretch = script_.first(kStretch);
    script_ = script_.subspan(kStretch);
    Make(stretch);
    for (const StreamInfo& stream : info_.streams) {
      const auto t = static_cast<std::size_t>(stream.triad);
      if ((stretch[1] >> 5U) == t + 1) continue;  // This one is silent.
      SampleBlock block;
      block.triad = stream.triad;
      block.time_ns = times_;
      block.x = values_[3 * t];
      block.y = values_[3 * t + 1];
      block.z = values_[3 * t + 2];
      if (stream.has_temperature) block.temperature_degc = temperatures_;
      if (stream.has_ambient) block.ambient_degc = temperatures_;
      block.pose = pose_;
      block.row = rows_;
      counts_[t].samples += static_cast<std::int64_t>(times_.size());
      blocks->push_back(block);
    }
    return true;
  }

 private:
  static constexpr std::size_t kStretch = 9;
  static constexpr std::int64_t kMostRows = 300;

  void Make(fuzz::Bytes stretch) {
    const std::uint8_t kind = stretch[0];
    const int length = 1 + stretch[1] % 32 * 2;
    constexpr std::array<double, 8> kSizes = {1.0, 0.01, 100.0, 1e6, 1e-9, 1e15, 1e150, 1e300};
    const double size = kSizes[kind & 7U];
    for (int i = 0; i < length; ++i) {
      time_ns_ +=
          std::int64_t{stretch[2]} * (kind & 8U ? 1 : 100'000) + (kind & 16U ? noise_ >> 20U : 1);
      times_.push_back(info_.has_time ? time_ns_ : row_);
      for (std::size_t k = 0; k < level_.size(); ++k) {
        if (i == 0 || (kind & 32U) != 0)
          level_[k] += size * static_cast<std::int8_t>(stretch[3 + k % 3 + (k > 4 ? 1 : 0)]);
        if (!(std::abs(level_[k]) < 1e300)) level_[k] = 0.0;
        noise_ = noise_ * 1664525U + 1013904223U;
        const double scatter = (kind & 64U) != 0 ? 0.0 : 1e-9 * noise_ * stretch[7];
        values_[k].push_back(level_[k] + scatter);
      }
      degc_ += 0.01 * static_cast<std::int8_t>(stretch[6]);
      temperatures_.push_back(
          (kind & 128U) != 0 && i % 3 != 0 ? std::numeric_limits<double>::quiet_NaN() : degc_);
      pose_.push_back(stretch[8]);
      rows_.push_back(row_++);
    }
  }

  fuzz::Bytes script_;
  RecordingInfo info_;
  std::array<StreamCounts, 3> counts_;
  std::vector<std::int64_t> times_, rows_;
  std::array<std::vector<double>, 9> values_;
  std::vector<double> temperatures_;
  std::vector<std::int32_t> pose_;
  std::array<double, 9> level_{};
  std::int64_t time_ns_ = 0, row_ = 0;
  std::uint32_t noise_ = 1;
  double degc_ = 25.0;
};

}  // namespace

TRUETRIAD_FUZZ_TARGET(poses) {
  if (input.size() < 12) return -1;
  MadeSource source(input[2], input.subspan(3));
  const Result<PoseSet> poses = CollectPoses(source, fuzz::SelectionOf(input[0], input[1]));
  if (!poses) fuzz::MustSay(poses.error());
  return 0;
}

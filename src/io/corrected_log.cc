// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/corrected_log.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "io/merged_rows.h"
#include "io/reading_corrector.h"
#include "io/whole_file.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// A triad that is written.
struct Channel {
  Triad triad = Triad::kAccelerometer;
  ReadingCorrector corrector;
  double lengths = 0.0;  ///< Of what was written, and how many.
  std::int64_t written = 0;
};

void AppendNumber(double value, std::string* text) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text->append(digits.data(), end);
}

/// Nanoseconds as decimal seconds, exactly.
void AppendSeconds(std::int64_t time_ns, std::string* text) {
  constexpr std::uint64_t kPerSecond = 1'000'000'000;
  const auto bits = static_cast<std::uint64_t>(time_ns);
  const std::uint64_t magnitude = time_ns < 0 ? 0 - bits : bits;
  if (time_ns < 0) *text += '-';
  *text += std::to_string(magnitude / kPerSecond);
  std::string fraction = std::to_string(kPerSecond + magnitude % kPerSecond);
  fraction[0] = '.';
  fraction.resize(fraction.find_last_not_of('0') + 1);
  if (fraction.size() > 1) *text += fraction;
}

/// Merges the channels by time into rows of text.
class RowWriter {
 public:
  RowWriter(const RecordingInfo& info, std::vector<Channel> channels)
      : has_time_(info.has_time), channels_(std::move(channels)) {
    for (const Channel& channel : channels_) rows_.AddStream(channel.triad);
    for (const StreamInfo& stream : info.streams) {
      has_temperature_ = has_temperature_ || stream.has_temperature;
      has_pose_ = has_pose_ || stream.has_pose_column;
    }
  }

  std::string Header() const {
    std::string text = has_time_ ? "time[s]," : "";
    for (const Channel& channel : channels_) {
      for (const char* axis : {"_x[", "_y[", "_z["}) {
        text.append(TriadPrefix(channel.triad)).append(axis);
        text.append(TruthUnitName(channel.triad)).append("],");
      }
    }
    if (has_temperature_) text += "temperature[degC],";
    if (has_pose_) text += "pose,";
    text.back() = '\n';
    return text;
  }

  void Add(const SampleBlock& block) { rows_.Add(block); }

  void StateLengths(CorrectedLogSummary* summary) const {
    for (const Channel& channel : channels_) {
      if (channel.written == 0) continue;
      summary->mean_length[channel.triad] = channel.lengths / static_cast<double>(channel.written);
    }
  }

  /// Appends the rows whose samples are all there; at the end of the recording, all that wait.
  Status TakeRows(bool at_end, std::string* text, CorrectedLogSummary* summary) {
    while (rows_.Next(at_end)) AppendRow(text, summary);
    return rows_.status();
  }

 private:
  void AppendRow(std::string* text, CorrectedLogSummary* summary) {
    if (has_time_) {
      AppendSeconds(rows_.time_ns(), text);
      *text += ',';
    }
    double temperature_degc = kNotKnown;
    std::optional<std::int32_t> pose;
    bool clamped = false;
    bool unknown_temperature = false;
    // The accelerometer comes first, so that its force is there for the gyroscope's row.
    for (std::size_t k = 0; k < channels_.size(); ++k) {
      const auto& [triad, samples, i, is_in_row] = rows_.streams()[k];
      Channel& channel = channels_[k];
      if (!is_in_row) {
        *text += ",,,";
        continue;
      }
      const double degc =
          samples.temperature_degc.empty() ? kNotKnown : samples.temperature_degc[i];
      if (std::isnan(temperature_degc)) temperature_degc = degc;
      if (!pose) pose = samples.pose.empty() ? 0 : samples.pose[i];
      const Eigen::Vector3d truth =
          channel.corrector.Correct(rows_.time_ns(), samples.reading(i), degc, force_mps2_);
      if (triad == Triad::kAccelerometer) force_mps2_ = truth;
      clamped = clamped || channel.corrector.clamped();
      unknown_temperature = unknown_temperature || truth.hasNaN();
      if (!truth.hasNaN()) {
        channel.lengths += truth.norm();
        ++channel.written;
      }
      for (const double value : truth) {
        if (!std::isnan(value)) AppendNumber(value, text);
        *text += ',';
      }
    }
    if (has_temperature_) {
      if (!std::isnan(temperature_degc)) AppendNumber(temperature_degc, text);
      *text += ',';
    }
    if (has_pose_) *text += std::to_string(pose.value_or(0)) + ',';
    text->back() = '\n';
    ++summary->rows;
    summary->clamped_temperature += clamped ? 1 : 0;
    summary->not_corrected += unknown_temperature ? 1 : 0;
  }

  bool has_time_;
  bool has_temperature_ = false;
  bool has_pose_ = false;
  std::vector<Channel> channels_;
  Eigen::Vector3d force_mps2_ = Eigen::Vector3d::Constant(kNotKnown);  ///< The last one known.
  MergedRows rows_;
};

/// The triads of the recording that the calibration covers.
Result<std::vector<Channel>> MakeChannels(const RecordingInfo& info,
                                          const Calibration& calibration,
                                          CorrectedLogSummary* summary) {
  if (!calibration.IsUsable()) {
    return Error(ErrorCode::kCalibrationNotUsable,
                 "the calibration is not usable (" + std::string(calibration.ReasonNotUsable()) +
                     "): set right what its findings name, and calibrate again");
  }
  std::vector<Channel> channels;
  for (const Triad triad : kTriads) {
    const StreamInfo* const stream = info.Find(triad);
    if (stream == nullptr) continue;
    if (!calibration.sensors[triad]) {
      summary->left_out.push_back(triad);
      continue;
    }
    TRUETRIAD_ASSIGN_OR_RETURN(ReadingCorrector corrector,
                               ReadingCorrector::Create(*calibration.sensors[triad], *stream));
    if (corrector.needs_force() &&
        (channels.empty() || channels[0].triad != Triad::kAccelerometer)) {
      return Error(ErrorCode::kMissingSensor,
                   {info.path},
                   "the calibration of the " + std::string(TriadName(triad)) +
                       " has g-sensitivity, which needs the accelerometer too; add its columns");
    }
    channels.push_back({triad, std::move(corrector)});
  }
  if (channels.empty()) {
    std::string names;
    for (const Triad triad : summary->left_out) {
      names += (names.empty() ? "" : ", ") + std::string(TriadName(triad));
    }
    return Error(ErrorCode::kMissingSensor,
                 {info.path},
                 "contains " + names + ", but the calibration includes none of these sensors");
  }
  return channels;
}

}  // namespace

Result<CorrectedLogSummary> WriteCorrectedLog(SampleSource& source,
                                              const Calibration& calibration,
                                              const std::string& path,
                                              const ProgressCallback& progress,
                                              const std::function<bool()>& stop) {
  CorrectedLogSummary summary;
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<Channel> channels,
                             MakeChannels(source.info(), calibration, &summary));
  RowWriter rows(source.info(), std::move(channels));
  WholeFile file(path);
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  std::string text = rows.Header();
  std::vector<SampleBlock> blocks;
  for (bool at_end = false; !at_end;) {
    if (stop && stop())
      return Error(ErrorCode::kStopped, {path}, "not written: stopped before the end");
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source.Next(&blocks));
    at_end = !more;
    for (const SampleBlock& block : blocks) rows.Add(block);
    TRUETRIAD_RETURN_IF_ERROR(rows.TakeRows(at_end, &text, &summary));
    file.Write(text);
    TRUETRIAD_RETURN_IF_ERROR(file.status());
    text.clear();
    if (progress) progress(source.progress());
  }
  TRUETRIAD_RETURN_IF_ERROR(file.Commit());
  rows.StateLengths(&summary);
  return summary;
}

}  // namespace truetriad

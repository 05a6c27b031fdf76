// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "io/reading_corrector.h"
#include "io/row_writer.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// Corrects the readings of the triads that the calibration covers, and collects the numbers of the
/// summary.
class Correction : public ReadingChange {
 public:
  /// Error: the calibration is unusable, covers no triad of the recording, or cannot correct a
  /// triad.
  static Result<Correction> Create(const RecordingInfo& info, const Calibration& calibration) {
    if (!calibration.IsUsable()) {
      return Error(ErrorCode::kCalibrationNotUsable,
                   "the calibration is not usable (" + std::string(calibration.ReasonNotUsable()) +
                       "): resolve its findings, and calibrate again");
    }
    Correction correction;
    std::string names;
    bool has_any = false;
    for (const Triad triad : kTriads) {
      const StreamInfo* const stream = info.Find(triad);
      if (stream == nullptr) continue;
      if (!calibration.sensors[triad]) {
        correction.summary_.left_out.push_back(triad);
        names += (names.empty() ? "" : ", ") + std::string(TriadName(triad));
        continue;
      }
      TRUETRIAD_ASSIGN_OR_RETURN(const ReadingCorrector corrector,
                                 ReadingCorrector::Create(*calibration.sensors[triad], *stream));
      if (corrector.needs_force() && !correction.correctors_[Triad::kAccelerometer]) {
        return Error(ErrorCode::kMissingSensor,
                     {info.path},
                     "the calibration of the " + std::string(TriadName(triad)) +
                         " has g-sensitivity, which needs the accelerometer too; add its columns");
      }
      correction.correctors_[triad] = corrector;
      has_any = true;
    }
    if (has_any) return correction;
    return Error(ErrorCode::kMissingSensor,
                 {info.path},
                 "contains " + names + ", but the calibration includes none of these sensors");
  }

  bool Covers(Triad triad) const { return correctors_[triad].has_value(); }

  Eigen::Vector3d Changed(Triad triad,
                          std::int64_t time_ns,
                          const Eigen::Vector3d& raw,
                          double temperature_degc) override {
    ReadingCorrector& corrector = *correctors_[triad];
    const Eigen::Vector3d truth = corrector.Correct(time_ns, raw, temperature_degc, force_mps2_);
    if (triad == Triad::kAccelerometer) force_mps2_ = truth;
    is_clamped_ |= corrector.clamped();
    if (truth.hasNaN()) {
      is_empty_ = true;
    } else {
      summary_.mean_length[triad] += truth.norm();
      ++written_[triad];
    }
    return truth;
  }

  void EndRow() override {
    ++summary_.rows;
    summary_.clamped_temperature += std::exchange(is_clamped_, false) ? 1 : 0;
    summary_.not_corrected += std::exchange(is_empty_, false) ? 1 : 0;
  }

  CorrectedLogSummary Summary() const {
    CorrectedLogSummary summary = summary_;
    for (const Triad triad : kTriads) {
      if (written_[triad] > 0) summary.mean_length[triad] /= static_cast<double>(written_[triad]);
    }
    return summary;
  }

 private:
  PerTriad<std::optional<ReadingCorrector>> correctors_;
  Eigen::Vector3d force_mps2_ =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< Of the last sample.
  bool is_clamped_ = false, is_empty_ = false;                              ///< Of this row.
  CorrectedLogSummary summary_;  ///< Its mean_length holds sums of lengths until Summary().
  PerTriad<std::int64_t> written_{};
};

}  // namespace

Result<CorrectedLogSummary> WriteCorrectedLog(SampleSource& source,
                                              const Calibration& calibration,
                                              const std::string& path,
                                              const ProgressCallback& progress,
                                              const std::function<bool()>& stop) {
  const RecordingInfo& info = source.info();
  TRUETRIAD_ASSIGN_OR_RETURN(Correction correction, Correction::Create(info, calibration));
  RecordingFormat format;
  format.time_decimals = RecordingFormat::kShortest;
  RowWriter rows(path, format, info.has_time);
  TRUETRIAD_RETURN_IF_ERROR(rows.status());
  // The accelerometer comes first: the gyroscope's correction may need the force of the same row.
  for (const Triad triad : kTriads) {
    if (!correction.Covers(triad)) continue;
    StreamInfo stream = *info.Find(triad);
    stream.unit = {std::string(TruthUnitName(triad)), 1.0, false};
    stream.has_ambient = false;
    rows.AddStream(stream);
  }
  rows.WriteHeader();
  std::vector<SampleBlock> blocks;
  for (bool at_end = false; !at_end;) {
    if (stop && stop())
      return Error(ErrorCode::kStopped, {path}, "not written: stopped before the end");
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source.Next(&blocks));
    at_end = !more;
    for (const SampleBlock& block : blocks) rows.Add(block);
    TRUETRIAD_RETURN_IF_ERROR(rows.WriteRows(at_end, &correction));
    if (progress) progress(source.progress());
  }
  TRUETRIAD_RETURN_IF_ERROR(rows.Commit());
  return correction.Summary();
}

}  // namespace truetriad

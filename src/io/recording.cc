// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/recording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/rounded_text.h"
#include "io/burst_windows.h"
#include "io/clock_pieces.h"
#include "io/recording_layout.h"

namespace truetriad {
namespace {

/// Converts the blocks of a file into the samples of one of its triads.
class Stream {
 public:
  /// Maps the columns. Error: a column is used in two different ways.
  static Result<Stream> Create(StreamLayout layout, CsvReader* csv) {
    using Kind = CsvReader::Kind;
    std::vector<std::size_t> numbers(layout.axes.begin(), layout.axes.end());
    if (layout.temperature) numbers.push_back(layout.temperature->column);
    if (layout.ambient) numbers.push_back(layout.ambient->column);
    if (layout.pose) numbers.push_back(*layout.pose);
    for (const std::size_t column : numbers) {
      TRUETRIAD_RETURN_IF_ERROR(csv->Map(column, Kind::kNumber));
    }
    if (layout.time.kind == TimeColumn::Kind::kColumn) {
      TRUETRIAD_RETURN_IF_ERROR(csv->Map(layout.time.column, Kind::kTime, layout.time.power));
    }
    return Stream(std::move(layout));
  }

  Triad triad() const { return layout_.info.triad; }
  const StreamCounts& counts() const { return counts_; }
  /// Time of the last sample returned; before the first sample, the smallest int64.
  std::int64_t last_time_ns() const { return last_time_ns_; }

  /// The samples in the `row_count` rows that `csv` has just read. Unless it is empty, `shifts_ns`
  /// is added to their times. Error: time going backwards, an invalid pose number.
  Result<SampleBlock> Take(const CsvReader& csv,
                           std::size_t row_count,
                           std::span<const std::int64_t> shifts_ns) {
    if (windows_ && row_count == 0) return windows_->Finish(triad());  // At the end of the file.
    SelectRows(csv, row_count);
    SampleBlock block;
    block.triad = triad();
    block.x = Selected(csv.Numbers(layout_.axes[0]), &axes_[0]);
    block.y = Selected(csv.Numbers(layout_.axes[1]), &axes_[1]);
    block.z = Selected(csv.Numbers(layout_.axes[2]), &axes_[2]);
    block.row = Selected(csv.Rows(), &rows_);
    block.time_ns = Times(csv, block.row);
    if (!shifts_ns.empty()) block.time_ns = Shifted(block.time_ns, shifts_ns);
    std::span<const std::int64_t> known_ns = block.time_ns;
    if (windows_) {
      known_ns = LastKnown(block.time_ns);
    } else {
      TRUETRIAD_RETURN_IF_ERROR(CheckTimes(csv, block.time_ns));
    }
    if (layout_.temperature) {
      TRUETRIAD_ASSIGN_OR_RETURN(
          block.temperature_degc,
          Temperatures(csv, *layout_.temperature, known_ns, row_count, &temperature_));
    }
    if (layout_.ambient) {
      TRUETRIAD_ASSIGN_OR_RETURN(
          block.ambient_degc, Temperatures(csv, *layout_.ambient, known_ns, row_count, &ambient_));
    }
    if (layout_.applied) TRUETRIAD_RETURN_IF_ERROR(UndoApplied(csv, &block));
    if (layout_.pose) {
      TRUETRIAD_RETURN_IF_ERROR(ReadPoses(csv));
      block.pose = poses_;
    }
    counts_.samples += static_cast<std::int64_t>(selected_count_);
    counts_.dropped_empty += static_cast<std::int64_t>(row_count - selected_count_);
    if (!windows_) return block;
    GiveTimesOfOtherRows(csv, row_count);
    lines_.resize(selected_count_);
    for (std::size_t i = 0; i < selected_count_; ++i) lines_[i] = csv.Line(SelectedRow(i));
    Result<SampleBlock> spread = windows_->Spread(block, lines_);
    if (spread && !spread->time_ns.empty()) last_time_ns_ = spread->time_ns.back();
    return spread;
  }

 private:
  explicit Stream(StreamLayout layout) : layout_(std::move(layout)) {
    if (layout_.info.window_samples > 1)
      windows_.emplace(layout_.info.window_samples, layout_.info.file);
  }

  /// Passes the times of rows without a reading to `windows_`, since such a row may state a
  /// window's time.
  void GiveTimesOfOtherRows(const CsvReader& csv, std::size_t row_count) {
    if (all_) return;
    const std::int64_t* const stated = csv.Times(layout_.time.column);
    auto next_selected = selection_.begin();
    for (std::size_t row = 0; row < row_count; ++row) {
      if (next_selected != selection_.end() && *next_selected == row) {
        ++next_selected;
      } else if (stated[row] != CsvReader::kMissingTime) {
        windows_->AddTime(csv.Rows()[row], Scaled(stated[row]), csv.Line(row));
      }
    }
  }

  /// Returns the times, each missing one replaced by the last known time before it, or by the first
  /// known time.
  std::span<const std::int64_t> LastKnown(std::span<const std::int64_t> times_ns) {
    known_.assign(times_ns.begin(), times_ns.end());
    const auto is_known = [](std::int64_t time_ns) { return time_ns != CsvReader::kMissingTime; };
    const auto first = std::find_if(times_ns.begin(), times_ns.end(), is_known);
    if (last_known_ns_ == 0 && first != times_ns.end()) last_known_ns_ = *first;
    for (std::int64_t& time_ns : known_) {
      if (is_known(time_ns)) last_known_ns_ = time_ns;
      time_ns = last_known_ns_;
    }
    return known_;
  }

  /// Selects the rows that have this triad's time and readings.
  void SelectRows(const CsvReader& csv, std::size_t row_count) {
    // A window needs a time on one row only.
    const bool has_time_column = layout_.time.kind == TimeColumn::Kind::kColumn && !windows_;
    all_ = !(has_time_column && csv.AnyMissing(layout_.time.column)) &&
           std::none_of(layout_.axes.begin(), layout_.axes.end(), [&](std::size_t column) {
             return csv.AnyMissing(column);
           });
    selected_count_ = row_count;
    if (all_) return;
    selection_.clear();
    for (std::size_t row = 0; row < row_count; ++row) {
      const bool has_time =
          !has_time_column || csv.Times(layout_.time.column)[row] != CsvReader::kMissingTime;
      const bool has_readings =
          std::none_of(layout_.axes.begin(), layout_.axes.end(), [&](std::size_t column) {
            return std::isnan(csv.Numbers(column)[row]);
          });
      if (has_time && has_readings) selection_.push_back(row);
    }
    selected_count_ = selection_.size();
  }

  std::size_t SelectedRow(std::size_t sample) const { return all_ ? sample : selection_[sample]; }

  /// The selected rows of a column. If all rows are selected, this is the reader's own buffer.
  template <typename T>
  std::span<const T> Selected(const T* column, std::vector<T>* buffer) const {
    if (all_) return {column, selected_count_};
    buffer->resize(selected_count_);
    for (std::size_t i = 0; i < selected_count_; ++i) (*buffer)[i] = column[selection_[i]];
    return *buffer;
  }

  std::span<const std::int64_t> Times(const CsvReader& csv, std::span<const std::int64_t> rows) {
    const TimeColumn& time = layout_.time;
    if (time.kind == TimeColumn::Kind::kNone) return rows;
    if (time.kind == TimeColumn::Kind::kColumn) {
      const std::span<const std::int64_t> stated = Selected(csv.Times(time.column), &times_);
      if (time.rate_hz == 1.0) return stated;
      if (stated.data() != times_.data()) times_.assign(stated.begin(), stated.end());
    } else {
      times_.assign(rows.begin(), rows.end());
      for (std::int64_t& value : times_) value *= 1'000'000'000;
    }
    for (std::int64_t& value : times_) value = Scaled(value);
    return times_;
  }

  /// Converts a time to ns. If the rate is not 1, `value` is a sample number times 1e9.
  std::int64_t Scaled(std::int64_t value) const {
    const double rate_hz = layout_.time.rate_hz;
    if (value == CsvReader::kMissingTime || rate_hz == 1.0) return value;
    // CheckTimes refuses times above kFarthestTime. A long double has the 64 bits that sample
    // numbers may need.
    constexpr auto kBeyond = static_cast<long double>(CsvReader::kFarthestTime) + 1.0L;
    const long double time_ns = static_cast<long double>(value) / static_cast<long double>(rate_hz);
    return std::llround(std::clamp(time_ns, -kBeyond, kBeyond));
  }

  std::span<const std::int64_t> Shifted(std::span<const std::int64_t> times_ns,
                                        std::span<const std::int64_t> shifts_ns) {
    if (times_ns.data() != times_.data()) times_.assign(times_ns.begin(), times_ns.end());
    for (std::size_t i = 0; i < times_.size(); ++i) {
      if (times_[i] != CsvReader::kMissingTime) times_[i] += shifts_ns[SelectedRow(i)];
    }
    return times_;
  }

  Status CheckTimes(const CsvReader& csv, std::span<const std::int64_t> times_ns) {
    for (std::size_t i = 0; i < times_ns.size(); ++i) {
      if (times_ns[i] < last_time_ns_) {
        return Error(ErrorCode::kTimeGoesBack,
                     {csv.path(), csv.Line(SelectedRow(i))},
                     csv.ColumnName(layout_.time.column) + ": time goes backwards to " +
                         RoundedText(1e-9 * static_cast<double>(times_ns[i]), 14) + " s after " +
                         RoundedText(1e-9 * static_cast<double>(last_time_ns_), 14) +
                         " s; sort the log, or split it where the clock was set");
      }
      last_time_ns_ = times_ns[i];
    }
    // The times are in order, so that the first and the last are the extreme ones.
    if (!times_ns.empty() && (times_ns.front() < -CsvReader::kFarthestTime ||
                              times_ns.back() > CsvReader::kFarthestTime)) {
      return Error(ErrorCode::kValueOutOfRange,
                   {csv.path(), csv.Line(SelectedRow(times_ns.size() - 1))},
                   "the time on this line or on an earlier line is out of range; check the unit of "
                   "the times, or the rate");
    }
    return {};
  }

  /// The last reading of a thermometer, which is held until the next one.
  struct HeldTemperature {
    double degc = std::numeric_limits<double>::quiet_NaN();
    std::int64_t time_ns = 0;
    bool is_new = false;
    std::optional<double> count;  ///< Number in a register, unwrapped.
    std::vector<double> values;   ///< The temperatures of the block's samples, degC.
  };

  /// The temperature of each sample. A temperature is held until the next one is logged, but not
  /// longer than kLongestHoldNs. Error: a number that the register cannot have.
  Result<std::span<const double>> Temperatures(const CsvReader& csv,
                                               const TemperatureColumn& column,
                                               std::span<const std::int64_t> times_ns,
                                               std::size_t row_count,
                                               HeldTemperature* held) const {
    // A minute: temperatures are logged far more often, and chambers and devices change by less
    // than a degree per minute.
    constexpr std::int64_t kLongestHoldNs = 60'000'000'000;
    const double* const stated = csv.Numbers(column.column);
    held->values.resize(selected_count_);
    std::size_t sample = 0;
    for (std::size_t row = 0; row < row_count; ++row) {
      if (!std::isnan(stated[row])) {
        double count = stated[row];
        if (column.wrap_bits > 0) {
          Result<double> continued = Continued(count, column, held->count);
          if (!continued) {
            return Error(ErrorCode::kValueOutOfRange,
                         {csv.path(), csv.Line(row)},
                         csv.ColumnName(column.column) + ": " + continued.error().message);
          }
          held->count = count = *continued;
        }
        held->degc = column.unit.scale * count + column.unit.offset;
        held->is_new = true;
      }
      if (sample < selected_count_ && SelectedRow(sample) == row) {
        if (held->is_new) held->time_ns = times_ns[sample];
        held->is_new = false;
        const bool is_known = times_ns[sample] - held->time_ns <= kLongestHoldNs;
        held->values[sample++] = is_known ? held->degc : std::numeric_limits<double>::quiet_NaN();
      }
    }
    return std::span<const double>(held->values);
  }

  /// Unwraps the number of a register, logged with or without a sign, to the value nearest to
  /// `before`. A chip warms by less than a quarter of the register's range per step. Error: a
  /// number that does not fit, a larger step, or a first number whose sign is unclear.
  static Result<double> Continued(double count,
                                  const TemperatureColumn& column,
                                  std::optional<double> before) {
    const double all = std::ldexp(1.0, column.wrap_bits);
    const std::string number = RoundedText(count, 9);
    const std::string bits = "wrap_bits: " + std::to_string(column.wrap_bits);
    const auto fail = [](const std::string& text) {
      return Error(ErrorCode::kValueOutOfRange, text);
    };
    if (count != std::floor(count) || count < -0.5 * all || count >= all)
      return fail(number + " does not fit a register of " + bits);
    if (!before && count >= 0.5 * all && !column.is_signed) {
      return fail("the first number, " + number + ", is " + RoundedText(count - all, 9) +
                  " if the register (" + bits +
                  ") is signed; state `signed: true` or `signed: false`");
    }
    const bool is_signed = column.is_signed.value_or(true);
    if (!before && is_signed) return count >= 0.5 * all ? count - all : count;
    if (!before) return count < 0.0 ? count + all : count;
    const double continued = count + all * std::round((*before - count) / all);
    // A step of half the range could be up or down, which would shift all later values.
    if (std::abs(continued - *before) > 0.25 * all) {
      return fail("the register steps to " + number + " by more than a quarter of the range of " +
                  bits + "; empty the field if it is damaged, or correct `wrap_bits`");
    }
    return continued;
  }

  /// Converts readings that were corrected before logging back to raw readings.
  Status UndoApplied(const CsvReader& csv, SampleBlock* block) {
    for (std::vector<double>& axis : raw_) axis.resize(selected_count_);
    const std::optional<AppliedCorrection::Thermal>& thermal = layout_.applied->thermal;
    for (std::size_t i = 0; i < selected_count_; ++i) {
      Eigen::Vector3d raw =
          layout_.applied->RawFromLogged(Eigen::Vector3d(block->x[i], block->y[i], block->z[i]));
      if (thermal) {
        const double temperature_degc = temperature_.values[i];
        if (std::isnan(temperature_degc)) {
          return Error(
              ErrorCode::kMissingTemperature,
              {csv.path(), csv.Line(SelectedRow(i))},
              "has no temperature within the last minute, so the `thermal` part of `applied` "
              "cannot be undone; remove such rows, or log the temperature more often");
        }
        raw += thermal->At(temperature_degc) - thermal->at_calibration;
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        raw_[axis][i] = raw[static_cast<Eigen::Index>(axis)];
      }
    }
    block->x = raw_[0];
    block->y = raw_[1];
    block->z = raw_[2];
    return {};
  }

  Status ReadPoses(const CsvReader& csv) {
    const double* const stated = csv.Numbers(*layout_.pose);
    poses_.resize(selected_count_);
    for (std::size_t i = 0; i < selected_count_; ++i) {
      const double value = stated[SelectedRow(i)];
      if (!(value >= 0.0) || value > std::numeric_limits<std::int32_t>::max() ||
          value != std::floor(value)) {
        return Error(ErrorCode::kUnreadableNumber,
                     {csv.path(), csv.Line(SelectedRow(i))},
                     "" + csv.ColumnName(*layout_.pose) +
                         " is not a pose number; expected whole numbers, 0 while moving");
      }
      poses_[i] = static_cast<std::int32_t>(value);
    }
    return {};
  }

  StreamLayout layout_;
  StreamCounts counts_;
  std::int64_t last_time_ns_ = std::numeric_limits<std::int64_t>::min();
  HeldTemperature temperature_, ambient_;

  bool all_ = true;  ///< Every row is selected; selection_ is not used.
  std::vector<std::size_t> selection_;
  std::size_t selected_count_ = 0;
  std::array<std::vector<double>, 3> axes_;
  std::array<std::vector<double>, 3> raw_;  ///< Used only to undo a correction.
  std::optional<BurstWindows> windows_;
  std::vector<std::int64_t> rows_, times_, lines_, known_;
  std::int64_t last_known_ns_ = 0;
  std::vector<std::int32_t> poses_;
};

struct File {
  std::unique_ptr<CsvReader> csv;
  std::vector<Stream> streams;
  std::optional<ClockPieces> pieces;  ///< Set if the file may be joined from pieces.
  bool done = false;

  std::int64_t last_time_ns() const {
    std::int64_t last = std::numeric_limits<std::int64_t>::min();
    for (const Stream& stream : streams) last = std::max(last, stream.last_time_ns());
    return last;
  }
};

/// The time column that all sensors share. Unset if there are several time columns, since their
/// pieces could not be matched. Also unset if the column has sample numbers or times of windows.
std::optional<std::size_t> CommonTimeColumn(const std::vector<FileLayout>& files) {
  if (files.size() != 1) return std::nullopt;
  const TimeColumn& first = files[0].streams.front().time;
  const bool is_common =
      std::all_of(files[0].streams.begin(), files[0].streams.end(), [&](const auto& stream) {
        return stream.time.kind == TimeColumn::Kind::kColumn && stream.time.rate_hz == 1.0 &&
               stream.info.window_samples == 1 && stream.time.column == first.column;
      });
  return is_common ? std::optional(first.column) : std::nullopt;
}

class RecordingSource : public SampleSource {
 public:
  static Result<std::unique_ptr<SampleSource>> Create(RecordingLayout layout, bool may_be_joined) {
    const std::optional<std::size_t> time_column = CommonTimeColumn(layout.files);
    std::vector<File> files;
    for (FileLayout& file_layout : layout.files) {
      File file;
      file.csv = std::move(file_layout.csv);
      for (StreamLayout& stream_layout : file_layout.streams) {
        TRUETRIAD_ASSIGN_OR_RETURN(Stream stream,
                                   Stream::Create(std::move(stream_layout), file.csv.get()));
        file.streams.push_back(std::move(stream));
      }
      if (may_be_joined && time_column) file.pieces.emplace(*time_column);
      files.push_back(std::move(file));
    }
    return std::unique_ptr<SampleSource>(
        new RecordingSource(std::move(layout.info), std::move(files), std::move(layout.manifest)));
  }

  const RecordingInfo& info() const override { return info_; }

  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    blocks->clear();
    while (File* const file = MostLagging()) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t row_count, file->csv->Read());
      file->done = row_count == 0;
      std::span<const std::int64_t> shifts_ns;
      if (file->pieces) {
        file->pieces->Follow(*file->csv, row_count);
        shifts_ns = file->pieces->shifts_ns();
      }
      for (Stream& stream : file->streams) {
        TRUETRIAD_ASSIGN_OR_RETURN(const SampleBlock block,
                                   stream.Take(*file->csv, row_count, shifts_ns));
        if (!block.x.empty()) blocks->push_back(block);
      }
      if (!blocks->empty()) return true;
    }
    return false;
  }

  double progress() const override {
    double sum = 0.0;
    for (const File& file : files_) sum += file.csv->progress();
    return sum / static_cast<double>(files_.size());
  }

  StreamCounts counts(Triad triad) const override {
    for (const File& file : files_) {
      for (const Stream& stream : file.streams) {
        if (stream.triad() == triad) return stream.counts();
      }
    }
    return {};
  }

  std::vector<RecordingJoint> joints() const override {
    for (const File& file : files_) {
      if (file.pieces) return file.pieces->joints();
    }
    return {};
  }

  std::vector<InputFile> inputs() const override {
    std::vector<InputFile> inputs;
    for (const File& file : files_) {
      std::int64_t samples = 0;
      for (const Stream& stream : file.streams) {
        samples = std::max(samples, stream.counts().samples);
      }
      inputs.push_back({file.csv->path(), file.csv->Sha256(), samples});
    }
    if (manifest_) inputs.push_back(*manifest_);
    return inputs;
  }

 private:
  RecordingSource(RecordingInfo info, std::vector<File> files, std::optional<InputFile> manifest)
      : info_(std::move(info)), files_(std::move(files)), manifest_(std::move(manifest)) {}

  /// The unfinished file whose last time is the earliest; null if all are read.
  File* MostLagging() {
    File* lagging = nullptr;
    for (File& file : files_) {
      if (!file.done && (lagging == nullptr || file.last_time_ns() < lagging->last_time_ns())) {
        lagging = &file;
      }
    }
    return lagging;
  }

  RecordingInfo info_;
  std::vector<File> files_;
  std::optional<InputFile> manifest_;
};

}  // namespace

Result<std::unique_ptr<SampleSource>> OpenRecording(const std::string& path,
                                                    const OpenRecordingOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(RecordingLayout layout,
                             IsManifest(path) ? OpenManifest(path, options)
                                              : OpenSelfDescribing(path, options.pose_column));
  if (!options.ambient) {
    // Columns that were not asked for are not parsed.
    for (FileLayout& file : layout.files) {
      for (StreamLayout& stream : file.streams) stream.ambient.reset();
    }
  }
  return RecordingSource::Create(std::move(layout), options.may_be_joined);
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <unordered_map>
#include <utility>

#include "base/messages.h"
#include "data/collector.h"
#include "data/repeats.h"
#include "io/recording_layout.h"
#include "math/distributions.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// Tables of averaged poses have far fewer rows; a longer table is a log without its time column.
constexpr std::size_t kMaxPoses = 100'000;

constexpr std::array<std::string_view, 4> kAttitude = {"qw", "qx", "qy", "qz"};

struct TriadColumns {
  Triad triad = Triad::kAccelerometer;
  std::array<std::size_t, 3> axes{};
  std::optional<std::array<std::size_t, 3>>
      sigma;  ///< A column for all axes is listed three times.
  double raw_per_sigma_unit = 1.0;
};

struct Columns {
  TimeColumn time;
  std::optional<TemperatureColumn> temperature;
  std::vector<TriadColumns> triads;
  std::optional<std::array<std::size_t, 4>> attitude;
  std::optional<std::size_t> id;
  std::optional<std::size_t> face;
};

/// The σ columns of a triad: `accel_sigma` for all axes, or `accel_sigma_x`, _y, _z.
Status TakeSigma(HeaderColumns* header, const Unit& unit, TriadColumns* triad) {
  const std::string prefix = std::string(TriadPrefix(triad->triad)) + "_sigma";
  const std::optional<std::size_t> common = header->Take(prefix);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<HeaderColumns::Axes> axes,
                             header->TakeAxes(triad->triad, prefix));
  if (!common && !axes) return {};
  if (common && axes) {
    return header->Fail(ErrorCode::kDuplicateColumn,
                        *common,
                        "is given together with `" + prefix + "_x`; keep one of the two");
  }
  Unit sigma_unit;
  if (common) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string name, header->UnitOf(*common, unit.name));
    const Result<Unit> parsed = ParseTriadUnit(triad->triad, name);
    if (!parsed) return header->Fail(parsed.error().code, *common, parsed.error().message);
    sigma_unit = *parsed;
    triad->sigma = {*common, *common, *common};
  } else {
    sigma_unit = axes->unit;
    triad->sigma = axes->columns;
  }
  if (sigma_unit.is_counts != unit.is_counts) {
    return header->Fail(ErrorCode::kUnitMismatch,
                        (*triad->sigma)[0],
                        "is in " + sigma_unit.name + ", but the readings are in " + unit.name);
  }
  triad->raw_per_sigma_unit = sigma_unit.truth_per_raw / unit.truth_per_raw;
  return {};
}

/// Reads the header; adds the streams to `poses`.
Result<Columns> ReadColumns(const CsvReader& csv, PoseSet* poses) {
  TRUETRIAD_ASSIGN_OR_RETURN(HeaderColumns header, HeaderColumns::Of(csv));
  Columns columns;
  TRUETRIAD_ASSIGN_OR_RETURN(const TimeColumn time, TakeTime(&header));
  columns.time = time;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<TemperatureColumn> temperature,
                             TakeTemperature(&header));
  columns.temperature = temperature;
  columns.id = header.Take("id");
  columns.face = header.Take("face");
  std::array<std::size_t, 4> attitude{};
  std::size_t attitude_columns = 0;
  for (const std::string_view name : kAttitude) {
    if (const std::optional<std::size_t> column = header.Take(std::string(name))) {
      attitude[attitude_columns++] = *column;
    }
  }
  if (attitude_columns == attitude.size()) {
    columns.attitude = attitude;
  } else if (attitude_columns > 0) {
    return header.Fail(ErrorCode::kMissingColumn,
                       attitude[0],
                       "is incomplete: an attitude needs all of qw, qx, qy, qz");
  }
  for (const Triad triad : kTriads) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<HeaderColumns::Axes> axes,
                               header.TakeAxes(triad, std::string(TriadPrefix(triad))));
    if (!axes) continue;
    TriadColumns& found = columns.triads.emplace_back();
    found.triad = triad;
    found.axes = axes->columns;
    TRUETRIAD_RETURN_IF_ERROR(TakeSigma(&header, axes->unit, &found));
    StreamSummary& stream = poses->streams.emplace_back();
    stream.triad = triad;
    stream.unit = axes->unit;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> ignored, header.Ignored());
  if (auto finding = IgnoredColumns(ignored)) poses->findings.push_back(*std::move(finding));
  // A table may have attitudes alone, as a turntable or a robot writes them.
  if (columns.triads.empty() && !columns.attitude) {
    return header.NoSensors();
  }
  return columns;
}

Status MapColumns(const Columns& columns, CsvReader* csv) {
  using Kind = CsvReader::Kind;
  std::vector<std::size_t> numbers;
  for (const TriadColumns& triad : columns.triads) {
    numbers.insert(numbers.end(), triad.axes.begin(), triad.axes.end());
    if (triad.sigma) numbers.insert(numbers.end(), triad.sigma->begin(), triad.sigma->end());
  }
  if (columns.attitude) {
    numbers.insert(numbers.end(), columns.attitude->begin(), columns.attitude->end());
  }
  if (columns.temperature) numbers.push_back(columns.temperature->column);
  for (const std::size_t column : numbers) {
    TRUETRIAD_RETURN_IF_ERROR(csv->Map(column, Kind::kNumber));
  }
  if (columns.time.kind == TimeColumn::Kind::kColumn) {
    TRUETRIAD_RETURN_IF_ERROR(csv->Map(columns.time.column, Kind::kTime, columns.time.power));
  }
  if (columns.id) TRUETRIAD_RETURN_IF_ERROR(csv->Map(*columns.id, Kind::kText));
  if (columns.face) TRUETRIAD_RETURN_IF_ERROR(csv->Map(*columns.face, Kind::kText));
  return {};
}

/// One row of the block that `csv` has just read.
class Row {
 public:
  Row(const CsvReader& csv, const Columns& columns, std::size_t row)
      : csv_(csv), columns_(columns), row_(row) {}

  std::int64_t line() const { return csv_.Line(row_); }

  Result<StaticPose> Read() const {
    StaticPose pose;
    pose.first_row = pose.last_row = csv_.Rows()[row_];
    if (columns_.id) pose.id = csv_.Texts(*columns_.id)[row_];
    if (columns_.face) {
      pose.face_up = csv_.Texts(*columns_.face)[row_];
      if (!pose.face_up.empty() && !IsFace(pose.face_up)) {
        return Fail(ErrorCode::kInvalidValue,
                    *columns_.face,
                    "`" + pose.face_up + "` is not among +x -x +y -y +z -z");
      }
    }
    if (columns_.time.kind == TimeColumn::Kind::kColumn) {
      pose.start_ns = pose.end_ns = csv_.Times(columns_.time.column)[row_];
      if (pose.start_ns == CsvReader::kMissingTime)
        return Fail(ErrorCode::kMissingTime, columns_.time.column, "is empty");
    }
    if (columns_.temperature && !std::isnan(Number(columns_.temperature->column))) {
      const TemperatureUnit& unit = columns_.temperature->unit;
      pose.temperature_degc = unit.scale * Number(columns_.temperature->column) + unit.offset;
    }
    for (const TriadColumns& triad : columns_.triads) {
      const Eigen::Vector3d mean = Numbers(triad.axes);
      if (mean.hasNaN()) continue;
      TriadPose& reading = pose.triads[triad.triad].emplace();
      reading.samples = 1;
      reading.mean_raw = mean;
      if (!triad.sigma) continue;
      const Eigen::Vector3d sigma = Numbers(*triad.sigma) * triad.raw_per_sigma_unit;
      if (sigma.hasNaN()) continue;
      if (!(sigma.array() > 0.0).all()) {
        return Fail(ErrorCode::kInvalidValue,
                    (*triad.sigma)[0],
                    "must be above zero; leave it empty where it is unknown");
      }
      reading.mean_covariance_raw = sigma.array().square().matrix().asDiagonal();
      reading.has_covariance = true;
    }
    TRUETRIAD_RETURN_IF_ERROR(ReadAttitude(&pose));
    return pose;
  }

 private:
  Status ReadAttitude(StaticPose* pose) const {
    if (!columns_.attitude) return {};
    Eigen::Vector4d wxyz;
    for (int i = 0; i < 4; ++i) wxyz[i] = Number((*columns_.attitude)[static_cast<std::size_t>(i)]);
    if (wxyz.array().isNaN().all()) return {};
    // Quaternions are written with four digits or more, so that lengths are within 1e-4 of 1.
    constexpr double kAttitudeLengthTolerance = 1e-3;
    if (!(std::abs(wxyz.norm() - 1.0) < kAttitudeLengthTolerance)) {
      return Fail(ErrorCode::kInvalidValue,
                  (*columns_.attitude)[0],
                  "the attitude qw,qx,qy,qz is not a unit quaternion; expected four numbers whose "
                  "squares sum to 1");
    }
    pose->attitude.emplace().world_from_body =
        Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
    return {};
  }

  double Number(std::size_t column) const { return csv_.Numbers(column)[row_]; }
  Eigen::Vector3d Numbers(const std::array<std::size_t, 3>& columns) const {
    return {Number(columns[0]), Number(columns[1]), Number(columns[2])};
  }
  Error Fail(ErrorCode code, std::size_t column, const std::string& message) const {
    return Error(code,
                 {csv_.path(), line(), static_cast<int>(column) + 1},
                 csv_.ColumnName(column) + ": " + message);
  }

  const CsvReader& csv_;
  const Columns& columns_;
  std::size_t row_;
};

bool StandAlike(const StaticPose& a, const StaticPose& b) {
  if (a.face_up != b.face_up || a.attitude.has_value() != b.attitude.has_value()) return false;
  return !a.attitude ||
         a.attitude->world_from_body.coeffs() == b.attitude->world_from_body.coeffs();
}

/// Finds rows whose readings equal those of an earlier row to the last bit. Since sensors have
/// noise, such rows were copied or rounded, or the sensor was stuck. They add no information.
class DuplicateFinder {
 public:
  /// Whether the row repeats a pose of `poses` in the same attitude, so that the two count as one.
  /// `lines`: the line of each pose of `poses`. If the row repeats none, the caller adds it to both
  /// vectors.
  bool CountsAlready(const StaticPose& pose,
                     std::int64_t line,
                     const std::vector<StaticPose>& poses,
                     const std::vector<std::int64_t>& lines) {
    constexpr std::size_t kBytes = 3 * sizeof(double);  // x, y and z.
    std::string bits(3 * kBytes + 3, '\0');
    for (const Triad triad : kTriads) {
      const auto index = static_cast<std::size_t>(triad);
      if (!pose.triads[triad]) continue;
      bits[3 * kBytes + index] = 1;
      std::memcpy(bits.data() + index * kBytes, pose.triads[triad]->mean_raw.data(), kBytes);
    }
    const auto [entry, is_new] = first_of_.emplace(std::move(bits), poses.size());
    const std::size_t first = entry->second, before = std::exchange(last_, first);
    if (is_new) return false;
    held_ += first == before ? 1 : 0;
    lines_.emplace_back(lines[first], line);
    const bool is_same = StandAlike(poses[first], pose);
    counted_once_ += is_same ? 1 : 0;
    return is_same;
  }

  /// The number of rows that repeat a pose and therefore did not become poses.
  std::int64_t counted_once() const { return counted_once_; }

  /// Adds a finding about the rows that repeat others. `rows`: number of all rows. Error (bad
  /// input): over a third of the rows repeat a row other than the previous one.
  Status Judge(std::int64_t rows, const std::string& path, Findings* findings) const {
    if (lines_.empty()) return {};
    const auto count = static_cast<std::int64_t>(lines_.size());
    const auto name = [this](std::size_t k) {
      return std::to_string(lines_[k].first) + " and " + std::to_string(lines_[k].second);
    };
    const std::string text = Counted(count, "row") + (count == 1 ? " repeats" : " repeat") +
                             " another row's readings to the last digit (lines " +
                             Named(lines_.size(), name) + ")";
    const std::string advice = "; check for a stuck sensor or rows pasted twice";
    if (3 * (count - held_) > rows) {
      return Error(ErrorCode::kRepeatedRows,
                   {path},
                   text + advice +
                       ". So many rows cannot be separate readings; check how the table was made");
    }
    findings->push_back(Finding(FindingCode::kRepeatedRows,
                                text + (counted_once_ > 0 ? ", and count once" : "") + advice)
                            .With("rows", static_cast<double>(count)));
    return {};
  }

 private:
  std::unordered_map<std::string, std::size_t> first_of_;  // Bits of readings -> their first pose.
  std::size_t last_ = 0;                                   // The previous row's value in first_of_.
  // `held_`: rows that repeat the previous row, as a slow sensor's readings do in a fast log.
  std::int64_t counted_once_ = 0, held_ = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> lines_;  // Lines of a row and its repetition.
};

/// Leaves out readings that are impossible at rest: 0, 0, 0, since neither gravity nor the magnetic
/// field is zero, and readings far larger than most others (error words, misplaced decimal points).
class ImpossibleReadings {
 public:
  void TakeZeros(std::int64_t line, StaticPose* pose) {
    ++rows_;
    for (const Triad triad : kVectorTriads) {
      auto& reading = pose->triads[triad];
      if (!reading || !reading->mean_raw.isZero(0.0)) continue;
      reading.reset();
      zeros_[triad].Count(line);
    }
  }

  /// `lines`: the line of each of `poses`.
  void TakeFar(const std::vector<std::int64_t>& lines, std::vector<StaticPose>* poses) {
    for (const Triad triad : kVectorTriads) {
      std::vector<double> lengths;
      for (const StaticPose& pose : *poses) {
        if (pose.triads[triad]) lengths.push_back(pose.triads[triad]->mean_raw.norm());
      }
      if (lengths.size() < kFewestReadings) continue;
      const double limit = kFar * LowerQuantile(std::move(lengths), kUsualShare);
      for (std::size_t k = 0; k < poses->size(); ++k) {
        auto& reading = (*poses)[k].triads[triad];
        if (!reading || !(reading->mean_raw.norm() > limit)) continue;
        reading.reset();
        far_[triad].Count(lines[k]);
      }
    }
  }

  Findings Left() const {
    Findings findings;
    for (const Triad triad : kVectorTriads) {
      AddFinding(triad, zeros_[triad], "0, 0, 0", &findings);
      AddFinding(triad, far_[triad], "more than ten times as much as most other rows", &findings);
    }
    return findings;
  }

 private:
  static constexpr Triad kVectorTriads[] = {Triad::kAccelerometer, Triad::kMagnetometer};
  /// A reading is left out if its length is more than this factor times the length that four of
  /// five readings stay below. An offset lengthens all readings, not a single one.
  static constexpr double kFar = 10.0;
  static constexpr double kUsualShare = 0.8;         // One of five readings may be far off.
  static constexpr std::size_t kFewestReadings = 6;  // One per face; fewer show no usual length.

  struct LeftOut {
    std::int64_t rows = 0, first_line = 0;
    void Count(std::int64_t line) {
      if (++rows == 1) first_line = line;
    }
  };

  void AddFinding(Triad triad,
                  const LeftOut& left,
                  const std::string& what,
                  Findings* findings) const {
    if (left.rows == 0) return;
    const std::string subject = std::string(TriadName(triad)) + ": " + Counted(left.rows, "row");
    const std::string line = " line " + std::to_string(left.first_line);
    findings->push_back(
        Finding(FindingCode::kImpossibleRows,
                left.rows == 1
                    ? subject + " reads " + what +
                          ", which is impossible at rest, and is left out:" + line
                    : subject + " read " + what +
                          ", which is impossible at rest, and are left out; the first is" + line,
                "check how the table was made")
            .About(triad)
            .With("rows", static_cast<double>(left.rows))
            .With("share", static_cast<double>(left.rows) / static_cast<double>(rows_)));
  }

  PerTriad<LeftOut> zeros_, far_;
  std::int64_t rows_ = 0;
};

void Extend(const StaticPose& pose, StreamSummary* stream) {
  const Boxed<TriadPose>& reading = pose.triads[stream->triad];
  if (!reading) {
    ++stream->dropped_empty;
    return;
  }
  const bool first = stream->samples++ == 0;
  const Eigen::Vector3d& mean = reading->mean_raw;
  stream->minimum_raw = first ? mean : stream->minimum_raw.cwiseMin(mean);
  stream->maximum_raw = first ? mean : stream->maximum_raw.cwiseMax(mean);
}

void ExtendTemperature(const StaticPose& pose, PoseSet* poses) {
  if (!pose.temperature_degc) return;
  const double degc = *pose.temperature_degc;
  Eigen::Vector2d range = poses->temperature_range_degc.value_or(Eigen::Vector2d(degc, degc));
  poses->temperature_range_degc = {std::min(range[0], degc), std::max(range[1], degc)};
}

/// If the readings of an axis repeatedly equal their extreme, this is the range limit of the
/// sensor, and they are refused. `read`: number of rows read, including rows that repeat a pose.
Status RejectClipped(const PoseSet& poses, std::int64_t read) {
  // Up to three equal readings may come from a stuck sensor or copied rows, for which there are
  // other findings.
  constexpr std::int64_t kLeastRows = 4;
  // Without clipping, at most one row in six has the extreme, as on the six faces of a block.
  constexpr double kLeastShare = 0.2;
  for (const StreamSummary& stream : poses.streams) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (stream.minimum_raw[axis] == stream.maximum_raw[axis]) continue;
      for (const double limit : {stream.minimum_raw[axis], stream.maximum_raw[axis]}) {
        const auto rows =
            std::count_if(poses.poses.begin(), poses.poses.end(), [&](const StaticPose& pose) {
              return pose.triads[stream.triad] &&
                     pose.triads[stream.triad]->mean_raw[axis] == limit;
            });
        if (rows < kLeastRows ||
            static_cast<double>(rows) < kLeastShare * static_cast<double>(read)) {
          continue;
        }
        std::string message = std::string(TriadName(stream.triad)) + " axis ";
        message += AxisLetter(axis);
        message += " is clipped: it reads exactly " + std::to_string(limit) + " in " +
                   std::to_string(rows) + " of " + std::to_string(read) +
                   " rows; set a larger full-scale range and record again";
        return Error(ErrorCode::kStuckSensor, {poses.source}, message);
      }
    }
  }
  return {};
}

}  // namespace

Result<bool> IsPoseTable(const std::string& path) {
  if (IsManifest(path)) return false;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<CsvReader> csv, CsvReader::OpenHead(path));
  bool is_log = csv->header().empty();
  for (const std::string& field : csv->header()) {
    const std::string name = LowerCase(ParseHeaderColumn(field).name);
    if (name.find("_sigma") != std::string::npos ||
        std::find(kAttitude.begin(), kAttitude.end(), name) != kAttitude.end()) {
      return true;
    }
    is_log = is_log || name == "pose" || SeeminglyCalled(name) == "time";
  }
  return !is_log;
}

Result<PoseTable> ReadPoseTable(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<CsvReader> opened, CsvReader::Open(path, {}));
  CsvReader& csv = *opened;
  PoseTable table;
  PoseSet& poses = table.poses;
  TRUETRIAD_ASSIGN_OR_RETURN(const Columns columns, ReadColumns(csv, &poses));
  TRUETRIAD_RETURN_IF_ERROR(MapColumns(columns, &csv));
  poses.source = path;
  poses.has_time = columns.time.kind != TimeColumn::Kind::kNone;
  poses.static_share = 1.0;
  poses.how = "every row";

  DuplicateFinder duplicates;
  ImpossibleReadings impossible;
  std::vector<std::int64_t> lines;  // Line in the file of each pose in poses.poses.
  const auto is_empty = [&](const StaticPose& pose) {
    return !columns.triads.empty() &&
           std::none_of(pose.triads.begin(), pose.triads.end(), [](const auto& triad) {
             return triad.has_value();
           });
  };
  const auto extend = [&](const StaticPose& pose) {
    for (StreamSummary& stream : poses.streams) Extend(pose, &stream);
  };
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t count, csv.Read());
    if (count == 0) break;
    for (std::size_t i = 0; i < count; ++i) {
      const Row row(csv, columns, i);
      TRUETRIAD_ASSIGN_OR_RETURN(StaticPose pose, row.Read());
      impossible.TakeZeros(row.line(), &pose);
      if (is_empty(pose)) {
        extend(pose);
        continue;
      }
      // Only readings show that rows are stuck or copied. In a table of attitudes alone, attitudes
      // may recur.
      if (!columns.triads.empty() &&
          duplicates.CountsAlready(pose, row.line(), poses.poses, lines)) {
        continue;
      }
      poses.poses.push_back(std::move(pose));
      lines.push_back(row.line());
    }
    if (poses.poses.size() > kMaxPoses) {
      return Error(ErrorCode::kTooMany,
                   {path},
                   "has more than " + std::to_string(kMaxPoses) +
                       " rows but no time column; add `time[s]`, or state the rate in a manifest");
    }
  }
  impossible.TakeFar(lines, &poses.poses);
  for (Finding& left : impossible.Left()) poses.findings.push_back(std::move(left));
  for (const StaticPose& pose : poses.poses) extend(pose);
  for (StreamSummary& stream : poses.streams) {
    stream.resolution_raw.setConstant(StepOfRows(stream.triad, poses.poses));
  }
  std::erase_if(poses.poses, is_empty);
  poses.poses.shrink_to_fit();
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    ExtendTemperature(poses.poses[k], &poses);
    poses.poses[k].number = static_cast<int>(k) + 1;
  }
  const auto rows = static_cast<std::int64_t>(poses.poses.size()) + duplicates.counted_once();
  TRUETRIAD_RETURN_IF_ERROR(duplicates.Judge(rows, path, &poses.findings));
  TRUETRIAD_RETURN_IF_ERROR(RejectClipped(poses, rows));
  if (poses.has_time && !poses.poses.empty()) {
    const auto [first, last] = std::minmax_element(
        poses.poses.begin(), poses.poses.end(), [](const StaticPose& a, const StaticPose& b) {
          return a.start_ns < b.start_ns;
        });
    poses.duration_s = static_cast<double>(last->end_ns - first->start_ns) * 1e-9;
  }
  table.inputs.push_back({path, csv.Sha256(), csv.rows_read()});
  return table;
}

}  // namespace truetriad

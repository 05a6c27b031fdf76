// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/common/recording_folder.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <glog/logging.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/input_guard.h"
#include "io/tags_yaml.h"
#include "io/whole_file.h"
#include "io/yaml_text.h"
#include "tools/convert/common/converter.h"
#include "tools/truetriad/interruption.h"
#include "truetriad/base/triad.h"

namespace truetriad::convert {
namespace {

namespace fs = std::filesystem;

// Column names have no units; the manifest states them. A CSV that is opened without its manifest,
// and so without its corrections, is therefore refused.
constexpr std::string_view kTimeColumn = "time_ns";
constexpr std::string_view kTemperatureColumn = "temperature";
constexpr std::string_view kManifest = "recording.yaml";
constexpr std::string_view kPoses = "poses.yaml";
constexpr std::size_t kChunk = std::size_t{1} << 18U;  // Bytes written at once.
constexpr std::size_t kLongestNumber = 32;             // A double has 24 characters, a time 20.

std::string Column(const TriadColumns& triad, char axis) {
  return std::string(TriadPrefix(triad.triad)) + "_" + axis;
}

/// Limits that no sensor reaches: 1e4 g, about 1e6 turns a minute (1e5 rad/s), 100 T. Larger
/// readings come from damage in a log without checksums.
double LargestReading(const TriadColumns& columns) {
  constexpr PerTriad<double> kLargest = {{1e5, 1e5, 1e8}};
  // Above 2^53 = 9e15 a double does not represent every integer.
  constexpr double kLargestCount = 1e15;
  const Result<Unit> unit = ParseTriadUnit(columns.triad, columns.unit);
  CHECK(unit) << columns.unit;
  return unit->is_counts ? kLargestCount : kLargest[columns.triad] / unit->truth_per_raw;
}

/// Whether no magnitude of the three values is above `largest`; false for NaN.
bool AllBelow(double largest, const double* values) {
  return std::abs(values[0]) <= largest && std::abs(values[1]) <= largest &&
         std::abs(values[2]) <= largest;
}

/// Half of the range of 64-bit nanoseconds (to the year 2116), so that differences do not overflow.
constexpr std::int64_t kLastTimeNs = std::numeric_limits<std::int64_t>::max() / 2;

/// A larger jump of the clock (over one day) near either end of a recording is damage.
constexpr std::int64_t kLongestJumpNs = 86'400'000'000'000;

}  // namespace

Table::Table(const std::string& folder,
             std::string file,
             std::vector<TriadColumns> triads,
             TableColumns columns)
    : file_name_(std::move(file)),
      triads_(std::move(triads)),
      columns_(columns),
      output_(folder + "/" + file_name_) {
  CHECK_LE(3 * triads_.size() + (columns.has_temperature ? 1 : 0), kMostColumns);
  for (const TriadColumns& triad : triads_) largest_.push_back(LargestReading(triad));
  std::string header;
  if (columns.has_time) header.append(",").append(kTimeColumn);
  for (const TriadColumns& triad : triads_) {
    for (const char axis : {'x', 'y', 'z'}) header.append(",").append(Column(triad, axis));
  }
  if (columns.has_temperature) header.append(",").append(kTemperatureColumn);
  output_.Write(header.substr(1) + "\n");
  text_.resize(kChunk + kLongestNumber * (kMostColumns + 1));
}

void Table::Add(std::int64_t time_ns, const double* readings, unsigned present) {
  if (IsInterrupted()) throw Interrupted();
  Row row;
  row.time_ns = time_ns;
  bool any = false;
  std::size_t column = 0;
  for (std::size_t index = 0; index < triads_.size(); ++index) {
    const bool is_present = ((present >> index) & 1U) != 0;
    const bool whole = is_present && AllBelow(largest_[index], readings + column);
    for (std::size_t i = 0; i < 3; ++i, ++column) {
      row.values[column] = whole ? readings[column] : std::numeric_limits<double>::quiet_NaN();
    }
    if (is_present && !whole) ++triads_[index].without_numbers;
    any = any || whole;
  }
  if (!any) {
    if (rows_ == 0 && waiting_.empty()) {
      first_time_ns_ = std::clamp(time_ns, -kLastTimeNs, kLastTimeNs);
    }
    return;
  }
  if (columns_.has_temperature) {
    // A temperature is valid from absolute zero to 1000 degC, which no electronics survive; NaN is
    // not.
    const bool is_one = temperature_degc_ >= kAbsoluteZeroDegc && temperature_degc_ <= 1000.0;
    row.values[column] = is_one ? temperature_degc_ : std::numeric_limits<double>::quiet_NaN();
  }
  if ((rows_ > 0 && time_ns < last_time_ns_) || time_ns > kLastTimeNs || time_ns < -kLastTimeNs) {
    ++too_late_;
    return;
  }
  if (waiting_.empty() || waiting_.back().time_ns <= time_ns) {
    waiting_.push_back(row);
  } else {
    const auto place = std::upper_bound(
        waiting_.begin(), waiting_.end(), time_ns, [](std::int64_t t, const Row& r) {
          return t < r.time_ns;
        });
    waiting_.insert(place, row);
  }
  if (waiting_.size() > kReach) WriteFirst();
}

void Table::WriteFirst() {
  const Row& row = waiting_.front();
  if (columns_.is_unchecked && rows_ == 0 && waiting_.size() > 1 &&
      waiting_[1].time_ns - row.time_ns > kLongestJumpNs) {
    ++too_late_;
    waiting_.pop_front();
    return;
  }
  if (rows_ == 0) first_time_ns_ = row.time_ns;
  last_time_ns_ = row.time_ns;
  ++rows_;
  for (std::size_t i = 0; i < triads_.size(); ++i) {
    if (!std::isnan(row.values[3 * i])) ++triads_[i].rows;
  }
  if (columns_.has_temperature && !std::isnan(row.values[3 * triads_.size()])) ++with_temperature_;
  filled_ = static_cast<std::size_t>(WriteRow(row, text_.data() + filled_) - text_.data());
  waiting_.pop_front();
  if (filled_ >= kChunk) {
    output_.Write({text_.data(), filled_});
    filled_ = 0;
  }
}

char* Table::WriteRow(const Row& row, char* text) const {
  if (columns_.has_time) text = std::to_chars(text, text + kLongestNumber, row.time_ns).ptr;
  const std::size_t columns = 3 * triads_.size() + (columns_.has_temperature ? 1 : 0);
  for (std::size_t i = 0; i < columns; ++i) {
    if (i > 0 || columns_.has_time) *text++ = ',';
    if (!std::isnan(row.values[i])) {
      text = std::to_chars(text, text + kLongestNumber, row.values[i]).ptr;
    }
  }
  *text++ = '\n';
  return text;
}

/// Removes the last rows if they follow a jump of the clock: rows with far too late times are
/// sorted to the end.
void Table::LeaveOutLastAfterAJump() {
  for (std::size_t i = 1; i < waiting_.size(); ++i) {
    if (waiting_[i].time_ns - waiting_[i - 1].time_ns <= kLongestJumpNs) continue;
    if (2 * i <= waiting_.size() && rows_ == 0) continue;
    too_late_ += waiting_.size() - i;
    waiting_.resize(i);
  }
}

bool Table::IsSeen() const {
  return std::any_of(
      triads_.begin(), triads_.end(), [](const TriadColumns& triad) { return triad.IsSeen(); });
}

Status Table::Commit() {
  if (columns_.is_unchecked) LeaveOutLastAfterAJump();
  while (!waiting_.empty()) WriteFirst();
  output_.Write({text_.data(), filled_});
  filled_ = 0;
  if (rows_ == 0 && IsSeen()) {
    // A table without valid readings gets an empty row, so that opening the recording reports this.
    Row row;
    row.time_ns = first_time_ns_;
    row.values.fill(std::numeric_limits<double>::quiet_NaN());
    const char* const end = WriteRow(row, text_.data());
    output_.Write({text_.data(), static_cast<std::size_t>(end - text_.data())});
  }
  return output_.Commit();
}

RecordingFolder::RecordingFolder(std::string directory, std::string temporary)
    : directory_(std::move(directory)), temporary_(std::move(temporary)) {}

Result<std::unique_ptr<RecordingFolder>> RecordingFolder::Create(const std::string& directory) {
  fs::path target = fs::absolute(directory).lexically_normal();
  if (!target.has_filename()) target = target.parent_path();
  std::error_code failure;
  if (fs::exists(target, failure) && !fs::is_directory(target, failure)) {
    return Error(ErrorCode::kOutputInTheWay, {directory}, "is a file; give the name of a folder");
  }
  fs::create_directories(target.parent_path(), failure);
  const std::string temporary =
      TemporaryNameBeside((target.parent_path() / ("." + target.filename().string())).string());
  if (failure || mkdir(temporary.c_str(), 0755) != 0) {
    return Error(ErrorCode::kCannotWrite,
                 {directory},
                 "cannot be written: cannot create a folder beside it");
  }
  NoteInterruptions();
  return std::unique_ptr<RecordingFolder>(new RecordingFolder(directory, temporary));
}

RecordingFolder::~RecordingFolder() {
  tables_.clear();
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

Table* RecordingFolder::AddTable(std::string file,
                                 std::vector<TriadColumns> triads,
                                 TableColumns columns) {
  tables_.push_back(
      std::make_unique<Table>(temporary_, std::move(file), std::move(triads), columns));
  recordings_[current_].tables.push_back(tables_.back().get());
  return tables_.back().get();
}

void RecordingFolder::BeginRecording(int instance) {
  const std::string manifest = "recording-" + std::to_string(instance) + ".yaml";
  const auto known = std::find_if(recordings_.begin(), recordings_.end(), [&](const auto& r) {
    return r.manifest == manifest;
  });
  current_ = static_cast<std::size_t>(known - recordings_.begin());
  const Recording& last = recordings_.back();
  const bool is_unused = last.manifest.empty() && last.tables.empty() && last.source.empty();
  if (known == recordings_.end() && is_unused) --current_;
  recordings_.resize(std::max(recordings_.size(), current_ + 1));
  recordings_[current_].manifest = manifest;
}

void RecordingFolder::SetOrigin(const std::string& format, const std::vector<std::string>& paths) {
  std::string names;
  for (const std::string& path : paths)
    names += (names.empty() ? "" : ", ") + fs::path(path).filename().string();
  SetSource("format", format);
  if (!paths.empty()) SetSource("file", names);
  SetSource("converter", ProgramName() + " " TRUETRIAD_VERSION);
}

void RecordingFolder::SetSource(const std::string& key, const std::string& value) {
  recordings_[current_].source.emplace_back(key, value);
}

std::string RecordingFolder::Manifest(const Recording& recording) const {
  const Tags& device = recording.device;
  Tags held;
  held.firmware = device.firmware;
  YamlText applied;
  YamlText streams;
  for (const Triad triad : kTriads) {
    for (const Table* const table : recording.tables) {
      for (const TriadColumns& columns : table->triads()) {
        if (columns.triad != triad || !columns.IsSeen()) continue;
        for (const auto of : {&Tags::device_ids, &Tags::device_slots, &Tags::thermal_slots}) {
          (held.*of)[triad] = (device.*of)[triad];
        }
        held.idle_thermal_slots[triad] = device.idle_thermal_slots[triad];
        if (triad == Triad::kMagnetometer) {
          held.magnetometer_turn_deg = device.magnetometer_turn_deg;
          held.magnetometer_mount_deg = device.magnetometer_mount_deg;
        }
        if (!columns.applied.empty()) {
          applied << "  " << TriadName(triad) << ":" << columns.applied;
        }
        streams << "  " << TriadName(triad) << ":\n    file: " << table->file() << "\n";
        if (table->has_time()) streams << "    time: {column: " << kTimeColumn << ", unit: ns}\n";
        for (const char axis : {'x', 'y', 'z'}) {
          streams << "    " << std::string_view(&axis, 1) << ": " << Column(columns, axis) << "\n";
        }
        streams << "    unit: " << columns.unit << "\n";
        if (columns.si_per_count) streams << "    si_per_count: " << *columns.si_per_count << "\n";
        if (table->states_temperature()) {
          streams << "    temperature: {column: " << kTemperatureColumn << ", unit: degC}\n";
        }
      }
    }
  }
  YamlText yaml;
  yaml << "recording: 1\n";
  if (!recording.serial.empty())
    yaml << "serial: " << Quoted{PrintableLine(recording.serial)} << "\n";
  if (const std::string tags = DeviceTagsText(held); !tags.empty()) {
    yaml << "device: {" << tags << " }\n";
  }
  yaml << "source:\n";
  for (const auto& [key, value] : recording.source) {
    yaml << "  " << key << ": " << Quoted{PrintableLine(value)} << "\n";
  }
  if (!recording.frame.empty()) yaml << "frame: " << Quoted{PrintableLine(recording.frame)} << "\n";
  yaml << (applied.str().empty() ? "applied: none\n" : "applied:\n" + applied.str());
  yaml << "streams:\n" << streams.str();
  const bool has_time =
      std::any_of(tables_.begin(), tables_.end(), [](const auto& t) { return t->has_time(); });
  if (!poses_.empty()) {
    yaml << "poses: {file: " << kPoses << "}\n";
  } else if (!has_time) {
    yaml << "poses: every_row\n";
  }
  return yaml.str();
}

Status RecordingFolder::MoveIntoPlace() {
  std::error_code failure;
  // This succeeds if the directory is missing or empty.
  fs::rename(temporary_, directory_, failure);
  if (!failure) {
    temporary_.clear();
    return {};
  }
  std::vector<std::string> files;
  for (const auto& table : tables_) {
    if (table->IsSeen()) files.push_back(table->file());
  }
  if (!poses_.empty()) files.emplace_back(kPoses);
  for (const Recording& recording : recordings_) files.push_back(recording.manifest);
  for (const std::string& file : files) {
    const std::string target = (fs::path(directory_) / file).string();
    if (InputGuard::Holds(target)) return InputGuard::Refusal(target);
  }
  for (const std::string& file : files) {
    fs::rename(fs::path(temporary_) / file, fs::path(directory_) / file, failure);
    if (failure)
      return Error(
          ErrorCode::kCannotWrite, {directory_}, "cannot be written: " + failure.message());
  }
  return {};
}

Status RecordingFolder::Commit() {
  bool has_rows = false;
  for (const auto& table : tables_) {
    TRUETRIAD_RETURN_IF_ERROR(table->Commit());
    std::error_code ignored;
    if (!table->IsSeen()) fs::remove(fs::path(temporary_) / table->file(), ignored);
    has_rows = has_rows || table->rows() > 0;
  }
  std::erase_if(recordings_, [](const Recording& recording) {
    return std::none_of(recording.tables.begin(), recording.tables.end(), [](const Table* table) {
      return table->IsSeen();
    });
  });
  if (!has_rows)
    return Error(ErrorCode::kNoReadings,
                 "the log contains no complete reading; nothing was written");
  recordings_.front().manifest = kManifest;
  if (!poses_.empty()) {
    WholeFile poses(temporary_ + "/" + std::string(kPoses));
    poses.Write(poses_);
    TRUETRIAD_RETURN_IF_ERROR(poses.Commit());
  }
  for (const Recording& recording : recordings_) {
    WholeFile manifest(temporary_ + "/" + recording.manifest);
    manifest.Write(Manifest(recording));
    TRUETRIAD_RETURN_IF_ERROR(manifest.Commit());
  }
  TRUETRIAD_RETURN_IF_ERROR(MoveIntoPlace());
  SayWhatIsHeld();
  return {};
}

void RecordingFolder::SayWhatIsHeld() const {
  for (const auto& table : tables_) {
    for (const TriadColumns& columns : table->triads()) {
      std::string line = (recordings_.size() > 1 ? table->file() + ", " : "") +
                         std::string(TriadName(columns.triad)) + ": " +
                         Counted(columns.rows, "sample");
      if (columns.rows > 0 && table->has_time()) {
        char span[32];
        std::snprintf(span,
                      sizeof span,
                      " over %.3f s",
                      (static_cast<double>(table->last_time_ns()) -
                       static_cast<double>(table->first_time_ns())) *
                          1e-9);
        line += span;
      }
      if (columns.without_numbers > 0) {
        line += "; " + Counted(columns.without_numbers, "row") +
                " skipped (fewer than three valid numbers)";
      }
      if (table->too_late() > 0) {
        line += "; " + Counted(table->too_late(), "row") +
                " skipped (time stamp far out of order, or not valid)";
      }
      Note(line);
    }
  }
  for (const Recording& recording : recordings_) {
    std::printf("%s\n", (fs::path(directory_) / recording.manifest).c_str());
  }
}

}  // namespace truetriad::convert

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>

#include "io/burst_windows.h"
#include "io/manifest_stream.h"
#include "io/recording_layout.h"
#include "io/tags_yaml.h"
#include "io/text_file.h"
#include "io/yaml_reader.h"
#include "truetriad/base/triad.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

struct Manifest {
  std::string sha256;
  std::string serial;
  Tags tags;
  std::vector<ManifestStream> streams;
  std::optional<PoseSelection> poses;
  std::string pose_file;  ///< The file that `poses` names; empty if none.
  std::optional<ColumnReference> pose_column;
};

std::string Resolved(const std::string& manifest_path, const std::string& file) {
  return (std::filesystem::path(manifest_path).parent_path() / file).lexically_normal().string();
}

/// A kind of value: the name or the number of a column.
struct Column {};
bool ReadAs(Column, YamlReader reader, ColumnReference* column) {
  column->stated.emplace(reader);
  return reader.Read(&column->text);
}
Json SchemaOf(Column, const ColumnReference*) {
  return SchemaOf(kAnyText, static_cast<const std::string*>(nullptr));
}

/// The column that `key` names; a missing key is recorded as an error.
ColumnReference ColumnField(auto& visit, std::string_view key) {
  visit.Require(key);
  ColumnReference column;
  visit(key, column, Column());
  return column;
}

struct TimeUnit {};
Json SchemaOf(TimeUnit, const int*) { return WordSchema({"s", "ms", "us", "ns"}); }
bool ReadAs(TimeUnit, YamlReader reader, int* power) {
  std::string unit;
  if (!reader.Read(&unit)) return false;
  const std::optional<int> known = TimePower(unit);
  if (!known) {
    reader.Fail("`" + unit + "` is not a unit of time; expected s, ms, us, ns or samples");
  }
  *power = known.value_or(*power);
  return known.has_value();
}

void TimeFields(auto& visit, ManifestStream& stream) {
  static const std::string kWindows = "1 to " + std::to_string(BurstWindows::kMost) + " samples";
  TimeColumn& layout = stream.layout.time;
  const bool counts_rows = visit.Says("unit", "samples");
  visit.Require("unit");
  if (counts_rows) {
    visit.Require("rate_hz");
    visit("rate_hz", layout.rate_hz, kPositive);
  } else {
    visit("unit", layout.power, TimeUnit());
  }
  visit("window_samples",
        stream.layout.info.window_samples,
        Range{1.0, static_cast<double>(BurstWindows::kMost), kWindows});
  visit.Expect(!counts_rows || visit.Has("column"),
               "needs a column with the time of each window; state `column` and its `unit`",
               "window_samples");
  if (counts_rows && !visit.Has("column")) {
    layout.kind = TimeColumn::Kind::kRowNumber;
  } else {
    layout.kind = TimeColumn::Kind::kColumn;
    stream.time = ColumnField(visit, "column");
  }
}

constexpr NamedValues<CsvLayout::Header, 3> kHeaders = {{
    {CsvLayout::Header::kPresent, "true"},
    {CsvLayout::Header::kAbsent, "false"},
    {CsvLayout::Header::kAuto, "auto"},
}};
constexpr NamedValues<bool, 2> kRagged = {{{true, "allow"}, {false, "refuse"}}};

struct Separator {};
Json SchemaOf(Separator, const char*) { return WordSchema({",", ";", "tab", "\t", "blank", " "}); }
bool ReadAs(Separator, YamlReader reader, char* separator) {
  std::string text;
  if (!reader.Read(&text)) return false;
  const std::string one = text == "tab" ? "\t" : text == "blank" ? " " : text;
  if (one == "," || one == ";" || one == "\t" || one == " ") {
    *separator = one[0];
    return true;
  }
  reader.Fail("`" + text + "` is not among \",\" \";\" tab blank");
  return false;
}

/// The conversion of a chip's temperature register: `scale` is the number of units per count,
/// `offset` the temperature at 0 counts.
void RegisterFields(auto& visit, TemperatureColumn& temperature) {
  double scale = 1.0, offset = 0.0;
  visit("scale", scale, kAnyNumber);
  visit.Expect(scale != 0.0, "must be a number other than zero", "scale");
  visit("offset", offset, kAnyNumber);
  visit("wrap_bits", temperature.wrap_bits, Range{8.0, 32.0, "8 to 32 bits, the register's size"});
  visit("signed", temperature.is_signed, Flag());
  visit.Expect(temperature.wrap_bits > 0, "applies only with `wrap_bits`; remove it", "signed");
  TemperatureUnit& unit = temperature.unit;
  unit = {unit.scale * scale, unit.scale * offset + unit.offset};
}

struct DegreesUnit {};
Json SchemaOf(DegreesUnit, const TemperatureUnit*) {
  return WordSchema({"degC", "C", "\u00b0C", "K"});
}
bool ReadAs(DegreesUnit, YamlReader reader, TemperatureUnit* unit) {
  std::string name;
  if (!reader.Read(&name)) return false;
  const std::optional<TemperatureUnit> known = ParseTemperatureUnit(name);
  if (!known) reader.Fail("`" + name + "` is neither degC nor K");
  *unit = known.value_or(*unit);
  return known.has_value();
}

/// Reads `{ column, unit, scale, offset, wrap_bits, signed }`. The column is resolved later.
bool TemperatureField(auto& visit,
                      std::string_view key,
                      std::optional<ColumnReference>* column,
                      std::optional<TemperatureColumn>* temperature) {
  visit.Map(key, [&](auto& in) {
    *column = ColumnField(in, "column");
    in.Require("unit");
    in("unit", temperature->emplace().unit, DegreesUnit());
    RegisterFields(in, **temperature);
  });
  return temperature->has_value();
}

/// Reads `applied:`, the corrections that were applied to the readings already: one word, or an
/// entry per triad.
void ReadApplied(YamlReader applied,
                 const PerTriad<bool>& left_out,
                 std::vector<ManifestStream>* streams) {
  if (!applied) return;
  if (!applied.IsMap()) {
    ReadAppliedCorrection(applied);
    return;
  }
  for (const Triad triad : kTriads) {
    YamlReader entry = applied.Child(TriadName(triad));
    if (left_out[triad]) continue;
    const std::optional<AppliedCorrection> correction = ReadAppliedCorrection(entry);
    for (ManifestStream& stream : *streams) {
      if (stream.layout.info.triad != triad || !correction) continue;
      if (correction->thermal && !stream.temperature) {
        entry.Child("thermal").Fail(
            "needs the temperature of the readings; add `temperature` to the stream");
      }
      stream.layout.applied = correction;
    }
  }
  applied.RejectUnknown();
}

void SelectionFields(auto& visit, Manifest& manifest) {
  PoseSelection& selection = *manifest.poses;
  if (visit("every", selection.every, Range{.lowest = 1.0, .expected = "at least 1 row"})) {
    selection.kind = PoseSelectionKind::kEveryN;
  }
  if (visit.Has("column")) {
    selection.kind = PoseSelectionKind::kColumn;
    manifest.pose_column = ColumnField(visit, "column");
  }
  if (visit("file", manifest.pose_file, kAnyText)) selection.kind = PoseSelectionKind::kRanges;
}

Status ReadPoses(YamlReader poses, Manifest* manifest) {
  if (!poses) return {};
  PoseSelection& selection = manifest->poses.emplace();
  if (std::string text; poses.IsScalar() && poses.Read(&text)) {
    selection.kind = PoseSelectionKind::kEveryRow;
    if (text != "every_row") poses.Fail("`" + text + "` is unknown; did you mean every_row?");
    return {};
  }
  FieldReader::ReadMap(poses, [&](FieldReader& visit) {
    SelectionFields(visit, *manifest);
    visit.Expect(poses.IsMap() && poses.Keys().size() == 1,
                 "expected one of every_row, {every: N}, {column: name}, {file: poses.yaml}");
  });
  if (selection.kind != PoseSelectionKind::kRanges) return {};
  manifest->pose_file = Resolved(poses.file(), manifest->pose_file);
  TRUETRIAD_ASSIGN_OR_RETURN(selection.ranges, ReadPoseRanges(manifest->pose_file));
  return {};
}

void IdentityFields(auto& visit, std::string& serial, Tags& tags) {
  visit("serial", serial, kName);
  visit.Map("device", [&](auto& device) { DeviceTagFields(device, tags); });
  visit.Map("run", [&](auto& run) { RunFields(run, tags); });
}

/// All keys but `applied` and `poses`; `path` is that of the manifest.
void ManifestFields(auto& visit, const std::string& path, Manifest& manifest) {
  for (const char* key : {"recording", "streams"}) visit.Require(key);
  int version = kVersion;
  visit("recording", version, FormatVersion());
  IdentityFields(visit, manifest.serial, manifest.tags);
  for (const char* for_people : {"source", "frame"}) visit.Has(for_people);
  visit.Map("streams", [&](auto& streams) {
    for (const Triad triad : kTriads) {
      streams.Map(TriadName(triad), [&](auto& in) {
        ManifestStream& stream = manifest.streams.emplace_back();
        std::string& file_name = stream.layout.info.file;
        in.Require("file");
        if (in("file", file_name, kAnyText)) file_name = Resolved(path, file_name);
        StreamFields(in, triad, stream);
      });
    }
    streams.Expect(!manifest.streams.empty(),
                   "expected at least one of accelerometer, gyroscope, magnetometer");
  });
}

Result<Manifest> ReadManifest(const std::string& path, const PerTriad<bool>& left_out = {}) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, ReadSmallFile(path));
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromText(text, path));
  YamlReader& yaml = file;
  if (yaml.IsMap() && yaml.Child("experiment")) {
    return Error(ErrorCode::kWrongFormat,
                 {path},
                 "is an experiment, not a recording; give it with --config");
  }
  if (yaml.IsMap() && yaml.Child("format")) {
    return Error(ErrorCode::kWrongFormat,
                 {path},
                 "is a result of truetriad (it states `format`), not a recording");
  }
  Manifest manifest;
  manifest.sha256 = Sha256Hex(text);
  Status poses;
  FieldReader::ReadMap(yaml, [&](FieldReader& visit) {
    ManifestFields(visit, path, manifest);
    std::erase_if(manifest.streams,
                  [&](const ManifestStream& stream) { return left_out[stream.layout.info.triad]; });
    ReadApplied(visit.Child("applied"), left_out, &manifest.streams);
    const auto has_time = [](const ManifestStream& stream) {
      return stream.layout.time.kind != TimeColumn::Kind::kNone;
    };
    const auto with_time =
        std::count_if(manifest.streams.begin(), manifest.streams.end(), has_time);
    visit.Expect(with_time == 0 || with_time == std::ssize(manifest.streams),
                 "some streams have a `time` and some do not; state it for all or for none",
                 "streams");
    poses = ReadPoses(visit.Child("poses"), &manifest);
  });
  TRUETRIAD_RETURN_IF_ERROR(poses);
  TRUETRIAD_RETURN_IF_ERROR(yaml.status());
  return manifest;
}

Result<std::size_t> ResolveColumn(const CsvReader& csv, const ColumnReference& reference) {
  const std::vector<std::size_t> found = csv.ColumnsCalled(reference.text);
  if (found.size() == 1) return found[0];
  std::string names;
  for (const std::string& name : csv.header()) names += (names.empty() ? "" : ", ") + name;
  const std::string text = (found.empty() ? "has no column `" : "has more than one column `") +
                           reference.text + "`; " +
                           (names.empty() ? "it has no header" : "its header is " + names) +
                           "; use one of these names, or a column number from 0 to " +
                           std::to_string(csv.column_count() - 1);
  return reference.stated
             ? reference.stated->ErrorHere(ErrorCode::kMissingColumn, csv.path() + " " + text)
             : Error(ErrorCode::kMissingColumn, {csv.path()}, text);
}

/// Finds the indices of the stream's columns in its open file.
Status ResolveColumns(const CsvReader& csv, ManifestStream* stream) {
  StreamLayout& layout = stream->layout;
  for (std::size_t axis = 0; axis < layout.axes.size(); ++axis) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t column, ResolveColumn(csv, stream->axes[axis]));
    layout.axes[axis] = column;
    for (std::size_t other = 0; other < axis; ++other) {
      if (layout.axes[other] == column) {
        return stream->axes[axis].stated->ErrorHere(
            ErrorCode::kDuplicateColumn, "is the same column as another axis; correct one of them");
      }
    }
  }
  if (stream->time) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t column, ResolveColumn(csv, *stream->time));
    layout.time.column = column;
  }
  for (const auto& [reference, temperature] : {std::pair(&stream->temperature, &layout.temperature),
                                               std::pair(&stream->ambient, &layout.ambient)}) {
    if (!*reference) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t column, ResolveColumn(csv, **reference));
    (*temperature)->column = column;
  }
  return {};
}

/// Returns the file that holds `stream`. If the file is new, opens it, adds it to `files` and adds
/// its layout to `stated`.
Result<FileLayout*> FileOf(const ManifestStream& stream,
                           std::vector<CsvLayout>* stated,
                           std::vector<FileLayout>* files) {
  for (std::size_t i = 0; i < files->size(); ++i) {
    FileLayout& file = (*files)[i];
    if (file.csv->path() != stream.layout.info.file) continue;
    if ((*stated)[i] != stream.csv) {
      return stream.stated->ErrorHere(
          ErrorCode::kDoesNotMatch,
          "is in the same file (" + file.csv->path() +
              ") as another stream; state the same separator, skip_lines, header and ragged for "
              "both");
    }
    return &file;
  }
  Result<std::unique_ptr<CsvReader>> csv = CsvReader::Open(stream.layout.info.file, stream.csv);
  if (!csv) return stream.stated->ErrorHere(csv.error().code, csv.error().message);
  stated->push_back(stream.csv);
  files->push_back({std::move(*csv), {}});
  return &files->back();
}

}  // namespace

template <typename Visit>
void StreamFields(Visit& visit, Triad triad, ManifestStream& stream) {
  StreamInfo& info = stream.layout.info;
  if constexpr (Visit::kReads) stream.stated = visit.map();
  info.triad = triad;
  visit.Require("unit");
  visit.Map("time", [&](auto& time) { TimeFields(time, stream); });
  for (std::size_t axis = 0; axis < kAxisLetters.size(); ++axis) {
    stream.axes[axis] = ColumnField(visit, kAxisLetters.substr(axis, 1));
  }
  visit("unit", info.unit, ReadingsUnit{triad});
  info.has_temperature =
      TemperatureField(visit, "temperature", &stream.temperature, &stream.layout.temperature);
  info.has_ambient =
      TemperatureField(visit, "ambient_temperature", &stream.ambient, &stream.layout.ambient);
  visit("si_per_count", info.si_per_count, kPositive);
  visit.Expect(info.unit.is_counts, "needs `unit: counts`", "si_per_count");
  visit("separator", stream.csv.separator, Separator());
  visit("skip_lines", stream.csv.skip_lines, kNotNegative);
  visit("header", stream.csv.header, kHeaders);
  visit("ragged", stream.csv.ragged, kRagged);
}
template void StreamFields(FieldReader&, Triad, ManifestStream&);
template void StreamFields(FieldSchema&, Triad, ManifestStream&);

Json RecordingSchema() {
  return FieldSchema::OfFile("A recording of truetriad", [](FieldSchema& visit) {
    Manifest manifest;
    ManifestFields(visit, "", manifest);
    visit.Map("applied",
              [](FieldSchema& in) {
                for (const Triad triad : kTriads) AppliedSchema(TriadName(triad), in);
              },
              {.words = {{"none"}}});
    manifest.poses.emplace();
    visit.Map("poses",
              [&](FieldSchema& poses) { SelectionFields(poses, manifest); },
              {.words = {{"every_row"}}});
  });
}

bool IsManifest(const std::string& path) {
  return path.ends_with(".yaml") || path.ends_with(".yml");
}

bool IsFace(std::string_view text) {
  return text.size() == 2 && (text[0] == '+' || text[0] == '-') && text[1] >= 'x' && text[1] <= 'z';
}

Result<std::vector<std::string>> FilesOfManifest(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Manifest manifest, ReadManifest(path));
  std::vector<std::string> files;
  for (const ManifestStream& stream : manifest.streams) {
    const std::string& table = stream.layout.info.file;
    if (std::find(files.begin(), files.end(), table) == files.end()) files.push_back(table);
  }
  if (!manifest.pose_file.empty()) files.push_back(manifest.pose_file);
  return files;
}

RecordingInfo IdentityInManifest(const std::string& path) {
  RecordingInfo info;
  info.path = path;
  const Result<std::string> text = ReadSmallFile(path);
  if (!text) return info;
  Result<YamlReader> yaml = YamlReader::FromText(*text, path);
  if (!yaml || !yaml->IsMap()) return info;
  FieldReader visit(*yaml);
  IdentityFields(visit, info.serial, info.tags);
  return info;
}

Result<RecordingLayout> OpenManifest(const std::string& path, const OpenRecordingOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(Manifest manifest, ReadManifest(path, options.left_out));
  RecordingLayout layout;
  layout.manifest = InputFile{path, manifest.sha256, 0};
  layout.info.path = path;
  layout.info.serial = manifest.serial;
  layout.info.tags = manifest.tags;
  std::vector<CsvLayout> stated;
  for (ManifestStream& stream : manifest.streams) {
    TRUETRIAD_ASSIGN_OR_RETURN(FileLayout * file, FileOf(stream, &stated, &layout.files));
    TRUETRIAD_RETURN_IF_ERROR(ResolveColumns(*file->csv, &stream));
    layout.info.has_time = stream.layout.time.kind != TimeColumn::Kind::kNone;
    file->streams.push_back(std::move(stream.layout));
  }
  const bool leaves_out = std::any_of(layout.files.begin(), layout.files.end(), [](const auto& f) {
    return f.csv->has_unnamed_count();
  });
  if (leaves_out) layout.info.ignored_columns.emplace_back(kUnnamedRowNumbers);

  // At least one file of a recording must have the column of pose numbers.
  std::optional<ColumnReference> pose = manifest.pose_column;
  if (!options.pose_column.empty()) pose = ColumnReference{options.pose_column, std::nullopt};
  bool found = false;
  for (FileLayout& file : layout.files) {
    for (StreamLayout& stream : file.streams) {
      if (pose && file.csv->ColumnsCalled(pose->text).size() == 1) {
        stream.pose = file.csv->ColumnsCalled(pose->text)[0];
        stream.info.has_pose_column = found = true;
      }
      layout.info.streams.push_back(stream.info);
    }
  }
  if (pose && !found) return ResolveColumn(*layout.files[0].csv, *pose).error();
  return layout;
}

Result<std::optional<PoseSelection>> ManifestPoseSelection(const std::string& path) {
  if (!IsManifest(path)) return std::optional<PoseSelection>();
  TRUETRIAD_ASSIGN_OR_RETURN(Manifest manifest, ReadManifest(path));
  return std::move(manifest.poses);
}

Result<std::vector<PoseRange>> ReadPoseRanges(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromFile(path));
  std::vector<PoseRange> ranges;
  for (const YamlReader& item : file.RequireChild("poses").Items()) {
    FieldReader::ReadMap(item, [&ranges](FieldReader& visit) {
      PoseRange range;
      for (const char* key : {"first", "last"}) visit.Require(key);
      const bool has_first = visit("first", range.first, kAnyNumber);
      if (visit("last", range.last, kAnyNumber) && has_first) {
        visit.Expect(range.first >= 0 && range.last >= range.first,
                     "rows " + std::to_string(range.first) + " to " + std::to_string(range.last) +
                         " are not a range; expected 0 <= first <= last");
        visit.Expect(ranges.empty() || range.first > ranges.back().last,
                     "begins at row " + std::to_string(range.first) +
                         ", inside or before the previous range; list the poses in file order");
      }
      visit("id", range.id, kAnyText);
      visit("face", range.face_up, kAnyText);
      visit.Expect(
          IsFace(range.face_up), "`" + range.face_up + "` is not among +x -x +y -y +z -z", "face");
      ranges.push_back(std::move(range));
    });
  }
  file.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  if (ranges.empty())
    return Error(ErrorCode::kMissingKey, {path}, "`poses` is empty; list at least one pose");
  return ranges;
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "io/burst_windows.h"
#include "io/recording_layout.h"
#include "io/tags_yaml.h"
#include "io/text_file.h"
#include "io/yaml_reader.h"
#include "truetriad/base/triad.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// A column as a manifest names it, and where it does.
struct ColumnReference {
  std::string text;                  ///< A header name or a 0-based index.
  std::optional<YamlReader> stated;  ///< Unset where the call names it.
};

struct ManifestStream {
  StreamLayout layout;  ///< Columns not resolved yet.
  CsvLayout csv;
  std::optional<YamlReader> stated;
  std::optional<ColumnReference> time;
  std::array<ColumnReference, 3> axes;
  std::optional<ColumnReference> temperature, ambient;
};

struct Manifest {
  std::string sha256;
  std::string serial;
  Tags tags;
  std::vector<ManifestStream> streams;
  std::optional<PoseSelection> poses;
  std::string pose_file;  ///< That `poses` are read from.
  std::optional<ColumnReference> pose_column;
};

std::string Resolved(const std::string& manifest_path, const std::string& file) {
  return (std::filesystem::path(manifest_path).parent_path() / file).lexically_normal().string();
}

/// The column that `key` names; an error is recorded when there is none.
ColumnReference ReadColumn(YamlReader* yaml, std::string_view key) {
  ColumnReference column;
  YamlReader value = yaml->RequireChild(key);
  value.Read(&column.text);
  column.stated = value;
  return column;
}

void ReadTime(YamlReader time, ManifestStream* stream) {
  if (!time) return;
  TimeColumn& layout = stream->layout.time;
  std::string unit;
  if (time.Require("unit", &unit)) {
    if (unit == "samples") {
      if (time.Require("rate_hz", &layout.rate_hz) && !(layout.rate_hz > 0.0)) {
        time.Fail("rate_hz must be above zero");
      }
    } else if (const std::optional<int> power = TimePower(unit)) {
      layout.power = *power;
    } else {
      time.Child("unit").Fail("`" + unit +
                              "` is not a unit of time; expected s, ms, us, ns or samples");
    }
  }
  std::int64_t& window_samples = stream->layout.info.window_samples;
  if (time.Optional("window_samples", &window_samples)) {
    if (window_samples < 1 || window_samples > BurstWindows::kMost) {
      time.Child("window_samples").Fail("must be from 1 to " + std::to_string(BurstWindows::kMost));
      window_samples = 1;
    }
    if (unit == "samples" && !time.Child("column")) {
      time.Child("window_samples").Fail("needs the time of each window; state its column and unit");
    }
  }
  if (unit == "samples" && !time.Child("column")) {
    layout.kind = TimeColumn::Kind::kRowNumber;
  } else {
    layout.kind = TimeColumn::Kind::kColumn;
    stream->time = ReadColumn(&time, "column");
  }
  time.RejectUnknown();
}

void ReadCsvLayout(YamlReader* yaml, CsvLayout* layout) {
  std::string text;
  if (yaml->Optional("separator", &text)) {
    if (text == "," || text == ";" || text == "\t" || text == " ") {
      layout->separator = text[0];
    } else if (text == "tab") {
      layout->separator = '\t';
    } else if (text == "blank") {
      layout->separator = ' ';
    } else {
      yaml->Child("separator").Fail("`" + text + "` is not among \",\" \";\" tab blank");
    }
  }
  if (yaml->Optional("skip_lines", &layout->skip_lines) && layout->skip_lines < 0) {
    yaml->Child("skip_lines").Fail("must not be negative");
  }
  if (yaml->Optional("header", &text)) {
    if (text == "true" || text == "false") {
      layout->header = text == "true" ? CsvLayout::Header::kPresent : CsvLayout::Header::kAbsent;
    } else if (text != "auto") {
      yaml->Child("header").Fail("`" + text + "` is not among true, false, auto");
    }
  }
  if (yaml->Optional("ragged", &text)) {
    layout->ragged = text == "allow";
    if (text != "allow" && text != "refuse") {
      yaml->Child("ragged").Fail("`" + text + "` is neither allow nor refuse");
    }
  }
}

/// How a chip's register states a temperature: `scale` units a count, 0 counts at `offset`.
void ReadRegister(YamlReader* reader, TemperatureColumn* temperature) {
  constexpr int kMostBits = 32;
  double scale = 1.0, offset = 0.0;
  if (reader->Optional("scale", &scale) && (!std::isfinite(scale) || scale == 0.0)) {
    reader->Child("scale").Fail("must be a number other than zero");
  }
  if (reader->Optional("offset", &offset) && !std::isfinite(offset)) {
    reader->Child("offset").Fail("must be a number");
  }
  if (reader->Optional("wrap_bits", &temperature->wrap_bits) &&
      (temperature->wrap_bits < 8 || temperature->wrap_bits > kMostBits)) {
    reader->Child("wrap_bits").Fail("must be from 8 to 32, the bits of the register");
  }
  if (bool is_signed = false; reader->Optional("signed", &is_signed)) {
    temperature->is_signed = is_signed;
    if (temperature->wrap_bits == 0) {
      reader->Child("signed").Fail("needs `wrap_bits`; a number has its sign otherwise");
    }
  }
  TemperatureUnit& unit = temperature->unit;
  unit = {unit.scale * scale, unit.scale * offset + unit.offset};
}

/// `{ column, unit, scale, offset, wrap_bits, signed }`. The column is found when the file is open.
std::optional<ColumnReference> ReadTemperature(YamlReader reader,
                                               std::optional<TemperatureColumn>* temperature) {
  if (!reader) return std::nullopt;
  ColumnReference reference = ReadColumn(&reader, "column");
  temperature->emplace();
  std::string name;
  if (reader.Require("unit", &name)) {
    const std::optional<TemperatureUnit> unit = ParseTemperatureUnit(name);
    if (!unit) reader.Child("unit").Fail("`" + name + "` is neither degC nor K");
    (*temperature)->unit = unit.value_or(TemperatureUnit{});
  }
  ReadRegister(&reader, &**temperature);
  reader.RejectUnknown();
  return reference;
}

ManifestStream ReadStream(YamlReader yaml, Triad triad) {
  ManifestStream stream;
  StreamInfo& info = stream.layout.info;
  stream.stated = yaml;
  info.triad = triad;
  std::string file;
  if (yaml.Require("file", &file)) info.file = Resolved(yaml.file(), file);
  ReadTime(yaml.Child("time"), &stream);
  for (std::size_t axis = 0; axis < kAxisLetters.size(); ++axis) {
    stream.axes[axis] = ReadColumn(&yaml, kAxisLetters.substr(axis, 1));
  }
  std::string unit_name;
  if (yaml.Require("unit", &unit_name)) {
    const Result<Unit> unit = ParseTriadUnit(triad, unit_name);
    if (unit) {
      info.unit = *unit;
    } else {
      yaml.Child("unit").Fail(unit.error().message);
    }
  }
  stream.temperature = ReadTemperature(yaml.Child("temperature"), &stream.layout.temperature);
  info.has_temperature = stream.temperature.has_value();
  stream.ambient = ReadTemperature(yaml.Child("ambient_temperature"), &stream.layout.ambient);
  info.has_ambient = stream.ambient.has_value();
  double si_per_count = 0.0;
  if (yaml.Optional("si_per_count", &si_per_count)) {
    if (!(si_per_count > 0.0)) yaml.Child("si_per_count").Fail("must be above zero");
    if (!info.unit.is_counts) yaml.Child("si_per_count").Fail("needs `unit: counts`");
    info.si_per_count = si_per_count;
  }
  ReadCsvLayout(&yaml, &stream.csv);
  yaml.RejectUnknown();
  return stream;
}

/// Which corrections the readings already have, one entry for all triads or one a triad.
void ReadApplied(YamlReader applied, std::vector<ManifestStream>* streams) {
  if (!applied) return;
  if (!applied.IsMap()) {
    ReadAppliedCorrection(applied);
    return;
  }
  for (const Triad triad : kTriads) {
    YamlReader entry = applied.Child(TriadName(triad));
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

Status ReadPoses(YamlReader poses, Manifest* manifest) {
  if (!poses) return {};
  PoseSelection selection;
  std::string text;
  if (poses.IsScalar()) {
    poses.Read(&text);
    selection.kind = PoseSelectionKind::kEveryRow;
    if (text != "every_row") poses.Fail("`" + text + "` is unknown; did you mean every_row?");
  } else {
    YamlReader file = poses.Child("file");
    if (poses.Optional("every", &selection.every)) {
      selection.kind = PoseSelectionKind::kEveryN;
      if (selection.every < 1) poses.Child("every").Fail("must be at least 1");
    }
    if (poses.Child("column")) {
      selection.kind = PoseSelectionKind::kColumn;
      manifest->pose_column = ReadColumn(&poses, "column");
    }
    poses.RejectUnknown();
    if (poses.IsMap() && poses.Keys().size() != 1) {
      poses.Fail("expected one of every_row, {every: N}, {column: name}, {file: poses.yaml}");
    }
    if (file.Read(&text)) {
      selection.kind = PoseSelectionKind::kRanges;
      manifest->pose_file = Resolved(poses.file(), text);
      TRUETRIAD_ASSIGN_OR_RETURN(std::vector<PoseRange> ranges,
                                 ReadPoseRanges(manifest->pose_file));
      selection.ranges = std::move(ranges);
    }
  }
  manifest->poses = std::move(selection);
  return {};
}

void ReadIdentity(YamlReader* yaml, std::string* serial, Tags* tags) {
  yaml->Child("serial").ReadName(serial);
  if (YamlReader device = yaml->Child("device")) {
    ReadDeviceTags(&device, tags);
    device.RejectUnknown();
  }
  ReadRunTags(yaml->Child("run"), tags);
}

Result<Manifest> ReadManifest(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, ReadSmallFile(path));
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromText(text, path));
  YamlReader& yaml = file;
  if (yaml.IsMap() && yaml.Child("experiment")) {
    return Error(ErrorCode::kWrongFormat,
                 {path},
                 "is an experiment, not a recording; give it with --config");
  }
  if (yaml.IsMap() && yaml.Child("format")) {
    return Error(ErrorCode::kWrongFormat, {path}, "is a result of truetriad, not a recording");
  }
  Manifest manifest;
  manifest.sha256 = Sha256Hex(text);
  int version = 0;
  if (yaml.Require("recording", &version) && version != 1) {
    yaml.Child("recording").Fail("this program reads version 1 of recording manifests");
  }
  ReadIdentity(&yaml, &manifest.serial, &manifest.tags);
  yaml.Child("source");  // For people; nothing depends on them.
  yaml.Child("frame");
  YamlReader applied = yaml.Child("applied");
  YamlReader streams = yaml.RequireChild("streams");
  for (const Triad triad : kTriads) {
    if (YamlReader stream = streams.Child(TriadName(triad))) {
      manifest.streams.push_back(ReadStream(stream, triad));
    }
  }
  streams.RejectUnknown();
  if (streams.IsMap() && manifest.streams.empty()) {
    streams.Fail("expected at least one of accelerometer, gyroscope, magnetometer");
  }
  ReadApplied(applied, &manifest.streams);
  for (const ManifestStream& stream : manifest.streams) {
    if ((stream.layout.time.kind == TimeColumn::Kind::kNone) !=
        (manifest.streams[0].layout.time.kind == TimeColumn::Kind::kNone)) {
      streams.Fail("some streams have a `time` and some do not; state it for all or for none");
      break;
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(ReadPoses(yaml.Child("poses"), &manifest));
  yaml.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(yaml.status());
  return manifest;
}

/// The columns called `text`, or the one at that 0-based index.
std::vector<std::size_t> FindColumns(const CsvReader& csv, const std::string& text) {
  std::vector<std::size_t> found;
  for (std::size_t column = 0; column < csv.header().size(); ++column) {
    if (csv.header()[column] == text) found.push_back(column);
  }
  std::size_t index = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, index);
  if (found.empty() && error == std::errc() && stop == end && index < csv.column_count()) {
    found.push_back(index);
  }
  return found;
}

Result<std::size_t> ResolveColumn(const CsvReader& csv, const ColumnReference& reference) {
  const std::vector<std::size_t> found = FindColumns(csv, reference.text);
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

/// Fills in the columns of `stream`, now that its file is open.
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

/// The file of the layout that holds `stream`, opened at its first use.
Result<FileLayout*> FileOf(const ManifestStream& stream,
                           std::vector<CsvLayout>* stated,
                           std::vector<FileLayout>* files) {
  for (std::size_t i = 0; i < files->size(); ++i) {
    FileLayout& file = (*files)[i];
    if (file.csv->path() != stream.layout.info.file) continue;
    if ((*stated)[i] != stream.csv) {
      return stream.stated->ErrorHere(
          ErrorCode::kDoesNotMatch,
          "shares " + file.csv->path() +
              " with another stream; state the same separator, skip_lines, header and "
              "ragged for both");
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
  if (yaml && yaml->IsMap()) ReadIdentity(&*yaml, &info.serial, &info.tags);
  return info;
}

Result<RecordingLayout> OpenManifest(const std::string& path, const std::string& pose_column) {
  TRUETRIAD_ASSIGN_OR_RETURN(Manifest manifest, ReadManifest(path));
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

  // Not every file of a recording needs to number the poses, but one has to.
  std::optional<ColumnReference> pose = manifest.pose_column;
  if (!pose_column.empty()) pose = ColumnReference{pose_column, std::nullopt};
  bool found = false;
  for (FileLayout& file : layout.files) {
    for (StreamLayout& stream : file.streams) {
      if (pose && FindColumns(*file.csv, pose->text).size() == 1) {
        stream.pose = FindColumns(*file.csv, pose->text)[0];
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
  for (YamlReader& item : file.RequireChild("poses").Items()) {
    PoseRange range;
    if (item.Require("first", &range.first) && item.Require("last", &range.last)) {
      if (range.first < 0 || range.last < range.first) {
        item.Fail("rows " + std::to_string(range.first) + " to " + std::to_string(range.last) +
                  " are not a range; expected 0 <= first <= last");
      } else if (!ranges.empty() && range.first <= ranges.back().last) {
        item.Fail("begins at row " + std::to_string(range.first) +
                  ", inside or before the previous range; list the poses in file order");
      }
    }
    item.Optional("id", &range.id);
    if (item.Optional("face", &range.face_up) && !IsFace(range.face_up)) {
      item.Child("face").Fail("`" + range.face_up + "` is not among +x -x +y -y +z -z");
    }
    item.RejectUnknown();
    ranges.push_back(std::move(range));
  }
  file.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  if (ranges.empty())
    return Error(ErrorCode::kMissingKey, {path}, "`poses` is empty; list at least one pose");
  return ranges;
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "io/mapping.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "io/csv_reader.h"
#include "io/text_file.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

struct ColumnUnit {
  std::string column, unit;
  std::vector<std::pair<std::string, double>> more;  ///< Keys that a manifest has, too.
  std::optional<bool> is_signed;                     ///< A register.
};

/// One way in which a file may hold a triad.
struct Candidate {
  Triad triad = Triad::kAccelerometer;
  int input = 1;                   ///< 1-based.
  std::optional<ColumnUnit> time;  ///< None: rows.
  std::array<std::string, 3> axes;
  std::string unit;
  std::optional<double> si_per_count;
  std::optional<ColumnUnit> temperature, ambient_temperature;
  std::string separator, header;  ///< Empty: found.
};

struct Mapping {
  MappingInfo info;
  std::string first_line;
  std::vector<Candidate> candidates;
};

std::optional<ColumnUnit> ReadColumnUnit(YamlReader yaml,
                                         const std::vector<std::string>& more_keys) {
  if (!yaml) return std::nullopt;
  ColumnUnit read;
  yaml.Require("column", &read.column);
  yaml.Require("unit", &read.unit);
  for (const std::string& key : more_keys) {
    if (key == "signed") {
      if (bool is_signed = false; yaml.Optional(key, &is_signed)) read.is_signed = is_signed;
    } else if (double value = 0.0; yaml.Optional(key, &value)) {
      read.more.emplace_back(key, value);
    }
  }
  yaml.RejectUnknown();
  return read;
}

Candidate ReadCandidate(YamlReader yaml, Triad triad, int input_count) {
  const std::vector<std::string> register_keys = {"scale", "offset", "wrap_bits", "signed"};
  Candidate candidate;
  candidate.triad = triad;
  if (yaml.Optional("input", &candidate.input) &&
      (candidate.input < 1 || candidate.input > input_count)) {
    yaml.Child("input").Fail("is not among the inputs, which are counted from 1");
    candidate.input = 1;
  }
  candidate.time = ReadColumnUnit(yaml.Child("time"), {"rate_hz", "window_samples"});
  for (std::size_t axis = 0; axis < 3; ++axis)
    yaml.Require(kAxisLetters.substr(axis, 1), &candidate.axes[axis]);
  yaml.Require("unit", &candidate.unit);
  if (double value = 0.0; yaml.Optional("si_per_count", &value)) candidate.si_per_count = value;
  candidate.temperature = ReadColumnUnit(yaml.Child("temperature"), register_keys);
  candidate.ambient_temperature = ReadColumnUnit(yaml.Child("ambient_temperature"), register_keys);
  yaml.Optional("separator", &candidate.separator);
  yaml.Optional("header", &candidate.header);
  yaml.RejectUnknown();
  return candidate;
}

Result<Mapping> ReadMapping(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromText(text, name));
  YamlReader& yaml = file;
  Mapping mapping;
  int version = 0;
  if (yaml.Require("mapping", &version) && version != 1) {
    yaml.Child("mapping").Fail("this program reads version 1 of mappings");
  }
  yaml.Require("about", &mapping.info.about);
  for (YamlReader& item : yaml.RequireChild("inputs").Items()) {
    std::string input;
    item.Read(&input);
    mapping.info.inputs.push_back(input);
  }
  yaml.Optional("first_line", &mapping.first_line);
  for (YamlReader& item : yaml.RequireChild("streams").Items()) {
    for (const Triad triad : kTriads) {
      if (YamlReader stream = item.Child(TriadName(triad))) {
        mapping.candidates.push_back(
            ReadCandidate(stream, triad, static_cast<int>(mapping.info.inputs.size())));
      }
    }
    item.RejectUnknown();
  }
  yaml.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(yaml.status());
  return mapping;
}

CsvLayout LayoutOf(const Candidate& candidate) {
  CsvLayout layout;
  if (candidate.separator == "blank") {
    layout.separator = ' ';
  } else if (candidate.separator == "tab") {
    layout.separator = '\t';
  } else if (!candidate.separator.empty()) {
    layout.separator = candidate.separator[0];
  }
  if (candidate.header == "false") layout.header = CsvLayout::Header::kAbsent;
  if (candidate.header == "true") layout.header = CsvLayout::Header::kPresent;
  return layout;
}

Status CheckFirstLine(const std::string& expected, const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<TextFile> file, TextFile::Open(path));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string_view lines, file->Next());
  if (lines.starts_with(expected)) return {};
  constexpr std::size_t kShownOfLine = 80;
  const std::string_view seen = lines.substr(0, std::min(lines.find('\n'), kShownOfLine));
  return Error(ErrorCode::kWrongFormat,
               path + ":1: `" + std::string(seen) +
                   "` is not the expected first line of this format, `" + expected + "…`");
}

/// Whether the file has the candidate's columns.
Result<bool> Fits(const Candidate& candidate, const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<CsvReader> csv,
                             CsvReader::Open(path, LayoutOf(candidate)));
  std::vector<std::string> columns(candidate.axes.begin(), candidate.axes.end());
  for (const auto* other :
       {&candidate.time, &candidate.temperature, &candidate.ambient_temperature}) {
    if (*other) columns.push_back((*other)->column);
  }
  return std::all_of(columns.begin(), columns.end(), [&](const std::string& column) {
    return !csv->ColumnsCalled(column).empty();
  });
}

void WriteStream(const Candidate& candidate, const std::string& path, YamlText* yaml) {
  *yaml << "  " << TriadName(candidate.triad) << ":\n    file: " << Quoted{path} << "\n";
  const auto write = [&](std::string_view key, const std::optional<ColumnUnit>& what) {
    if (!what) return;
    *yaml << "    " << key << ": {column: " << Quoted{what->column} << ", unit: " << what->unit;
    for (const auto& [more_key, value] : what->more) *yaml << ", " << more_key << ": " << value;
    if (what->is_signed) *yaml << ", signed: " << (*what->is_signed ? "true" : "false");
    *yaml << "}\n";
  };
  write("time", candidate.time);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    *yaml << "    " << kAxisLetters.substr(axis, 1) << ": " << Quoted{candidate.axes[axis]} << "\n";
  }
  *yaml << "    unit: " << candidate.unit << "\n";
  if (candidate.si_per_count) *yaml << "    si_per_count: " << *candidate.si_per_count << "\n";
  write("temperature", candidate.temperature);
  write("ambient_temperature", candidate.ambient_temperature);
  if (!candidate.separator.empty())
    *yaml << "    separator: " << Quoted{candidate.separator} << "\n";
  if (!candidate.header.empty()) *yaml << "    header: " << candidate.header << "\n";
}

}  // namespace

Result<MappingInfo> ReadMappingInfo(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(Mapping mapping, ReadMapping(text, name));
  return std::move(mapping.info);
}

Result<std::string> ReadMappingFile(const std::string& path) { return ReadSmallFile(path); }

Result<std::string> ManifestFromMapping(const std::string& text,
                                        const std::string& name,
                                        const std::vector<std::string>& inputs,
                                        const std::string& directory) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Mapping mapping, ReadMapping(text, name));
  if (inputs.size() != mapping.info.inputs.size()) {
    std::string expected;
    for (const std::string& input : mapping.info.inputs) {
      expected += (expected.empty() ? "" : ",") + input;
    }
    return Error(ErrorCode::kMissingArgument,
                 "--input: " + name + " needs " + std::to_string(mapping.info.inputs.size()) +
                     (mapping.info.inputs.size() == 1 ? " file" : " files, separated by a comma") +
                     ": " + expected);
  }
  if (!mapping.first_line.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(CheckFirstLine(mapping.first_line, inputs[0]));
  }
  YamlText yaml;
  yaml << "recording: 1\nsource: {format: " << Quoted{name} << "}\napplied: none\nstreams:\n";
  bool any = false, has_time = false;
  std::string wanted;
  for (const Triad triad : kTriads) {
    for (const Candidate& candidate : mapping.candidates) {
      if (candidate.triad != triad) continue;
      const std::string& input = inputs[static_cast<std::size_t>(candidate.input - 1)];
      TRUETRIAD_ASSIGN_OR_RETURN(const bool fits, Fits(candidate, input));
      if (!fits) {
        wanted += (wanted.empty() ? "" : ", ") + candidate.axes[0];
        continue;
      }
      namespace fs = std::filesystem;
      std::error_code failure;
      fs::path path = fs::relative(fs::absolute(input), fs::absolute(directory), failure);
      if (failure || path.empty()) path = fs::absolute(input);
      WriteStream(candidate, path.string(), &yaml);
      any = true;
      has_time = has_time || candidate.time;
      break;
    }
  }
  if (!any) {
    return Error(ErrorCode::kMissingColumn,
                 {inputs[0]},
                 "has none of the columns of " + name + ": " + wanted);
  }
  // What has no time has no rests that could be found.
  if (!has_time) yaml << "poses: every_row\n";
  return yaml.str();
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "io/mapping.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "io/csv_reader.h"
#include "io/manifest_stream.h"
#include "io/text_file.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// One possible layout of a triad in a file, described like a stream of a manifest.
struct Candidate {
  int input = 1;  ///< Number of the input, from 1.
  ManifestStream stream;
};

struct Mapping {
  MappingInfo info;
  std::string first_line;
  std::vector<Candidate> candidates;
};

void CandidateFields(FieldReader& visit, Triad triad, Mapping& mapping) {
  Candidate& candidate = mapping.candidates.emplace_back();
  const std::size_t inputs = mapping.info.inputs.size();
  const std::string expected = "an input, from 1 to " + std::to_string(inputs);
  visit("input", candidate.input, Range{1.0, static_cast<double>(inputs), expected});
  StreamFields(visit, triad, candidate.stream);
}

Result<Mapping> ReadMapping(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromText(text, name));
  Mapping mapping;
  FieldReader::ReadMap(file, [&mapping](FieldReader& visit) {
    for (const char* key : {"mapping", "about", "inputs", "streams"}) visit.Require(key);
    int version = kVersion;
    visit("mapping", version, FormatVersion());
    visit("about", mapping.info.about, kAnyText);
    visit("inputs", mapping.info.inputs, ListOf{kAnyText});
    visit("first_line", mapping.first_line, kAnyText);
    for (const YamlReader& item : visit.Child("streams").Items()) {
      FieldReader::ReadMap(item, [&mapping](FieldReader& streams) {
        for (const Triad triad : kTriads) {
          streams.Map(TriadName(triad), [&mapping, triad](FieldReader& candidate) {
            CandidateFields(candidate, triad, mapping);
          });
        }
      });
    }
  });
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  return mapping;
}

Status CheckFirstLine(const std::string& expected, const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<TextFile> file, TextFile::Open(path));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string_view lines, file->Next());
  if (lines.starts_with(expected)) return {};
  constexpr std::size_t kShownOfLine = 80;  // The width of a terminal.
  const std::string_view seen = lines.substr(0, std::min(lines.find('\n'), kShownOfLine));
  return Error(ErrorCode::kWrongFormat,
               path + ":1: `" + std::string(seen) +
                   "` is not the expected first line of this format, `" + expected + "…`");
}

/// Whether the file has the stream's columns.
Result<bool> Fits(const ManifestStream& stream, const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<CsvReader> csv,
                             CsvReader::Open(path, stream.csv));
  const auto has = [&csv](const ColumnReference& column) {
    return !csv->ColumnsCalled(column.text).empty();
  };
  return std::ranges::all_of(stream.axes, has) &&
         std::ranges::all_of(std::array{&stream.time, &stream.temperature, &stream.ambient},
                             [&](const auto* other) { return !*other || has(**other); });
}

/// Writes a value as it is; names of columns and separators are quoted.
void WriteValue(std::string_view key, YamlReader value, YamlText* yaml) {
  constexpr std::array<std::string_view, 5> kTexts = {"column", "x", "y", "z", "separator"};
  std::string text;
  value.Read(&text);
  if (std::ranges::find(kTexts, key) != kTexts.end()) {
    *yaml << key << ": " << Quoted{text};
  } else {
    *yaml << key << ": " << text;
  }
}

void WriteStream(const ManifestStream& stream, const std::string& path, YamlText* yaml) {
  *yaml << "  " << TriadName(stream.layout.info.triad) << ":\n    file: " << Quoted{path} << "\n";
  YamlReader stated = *stream.stated;
  for (const std::string& key : stated.Keys()) {
    if (key == "input") continue;
    YamlReader value = stated.Child(key);
    *yaml << "    ";
    if (value.IsMap()) {
      *yaml << key << ": {";
      for (const std::string& part : value.Keys()) {
        *yaml << (part == value.Keys().front() ? "" : ", ");
        WriteValue(part, value.Child(part), yaml);
      }
      *yaml << "}\n";
    } else {
      WriteValue(key, value, yaml);
      *yaml << "\n";
    }
  }
}

}  // namespace

Result<MappingInfo> ReadMappingInfo(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(Mapping mapping, ReadMapping(text, name));
  return std::move(mapping.info);
}

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
    for (const auto& [number, stream] : mapping.candidates) {
      if (stream.layout.info.triad != triad) continue;
      const std::string& input = inputs[static_cast<std::size_t>(number - 1)];
      TRUETRIAD_ASSIGN_OR_RETURN(const bool fits, Fits(stream, input));
      if (!fits) {
        wanted += (wanted.empty() ? "" : ", ") + stream.axes[0].text;
        continue;
      }
      namespace fs = std::filesystem;
      std::error_code failure;
      fs::path path = fs::relative(fs::absolute(input), fs::absolute(directory), failure);
      if (failure || path.empty()) path = fs::absolute(input);
      WriteStream(stream, path.string(), &yaml);
      any = true;
      has_time |= stream.layout.time.kind != TimeColumn::Kind::kNone;
      break;
    }
  }
  if (!any) {
    return Error(ErrorCode::kMissingColumn,
                 {inputs[0]},
                 "has none of the columns of " + name + ": " + wanted);
  }
  // Rests cannot be detected without time.
  if (!has_time) yaml << "poses: every_row\n";
  return yaml.str();
}

}  // namespace truetriad

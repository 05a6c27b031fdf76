// SPDX-License-Identifier: Apache-2.0
#include <deque>

#include "io/row_writer.h"
#include "io/yaml_text.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// Adds to the manifest the entry of a stream whose readings are in the file `name`.
void DescribeStream(const std::string& name, const StreamInfo& stream, YamlText* manifest) {
  *manifest << "  " << TriadName(stream.triad) << ":\n    file: " << name
            << "\n    time: {column: \"time[s]\", unit: s}\n";
  for (const char axis : kAxisLetters) {
    *manifest << "    " << std::string_view(&axis, 1) << ": " << Quoted{ColumnOf(stream, axis)}
              << "\n";
  }
  *manifest << "    unit: " << stream.unit.name << "\n";
  if (stream.si_per_count) *manifest << "    si_per_count: " << *stream.si_per_count << "\n";
  if (stream.has_temperature) {
    *manifest << "    temperature: {column: \"" << kTemperatureColumn << "\", unit: degC}\n";
  }
  if (stream.has_ambient) {
    *manifest << "    ambient_temperature: {column: \"" << kAmbientColumn << "\", unit: degC}\n";
  }
}

}  // namespace

Result<std::string> WriteRecording(SampleSource& source,
                                   const RecordingFormat& format,
                                   const std::string& directory,
                                   const ProgressCallback& progress) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(directory));
  YamlText manifest;
  manifest << "recording: 1\n";
  if (!source.info().serial.empty()) manifest << "serial: " << Quoted{source.info().serial} << "\n";
  manifest << "applied: none\nstreams:\n";
  std::deque<RowWriter> files;
  for (StreamInfo stream : source.info().streams) {
    stream.has_pose_column = false;  // The manifest names no column of poses.
    std::string name(format.one_file ? "recording" : TriadName(stream.triad));
    name += ".csv";
    if (files.empty() || !format.one_file) {
      files.emplace_back(directory + "/" + name, format, /*has_time=*/true);
    }
    files.back().AddStream(stream);
    DescribeStream(name, stream, &manifest);
  }
  for (RowWriter& file : files) file.WriteHeader();
  std::vector<SampleBlock> blocks;
  for (bool at_end = false; !at_end;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source.Next(&blocks));
    at_end = !more;
    for (RowWriter& file : files) {
      for (const SampleBlock& block : blocks) file.Add(block);
      TRUETRIAD_RETURN_IF_ERROR(file.WriteRows(at_end));
    }
    if (progress) progress(source.progress());
  }
  for (RowWriter& file : files) TRUETRIAD_RETURN_IF_ERROR(file.Commit());
  std::string path = directory + "/recording.yaml";
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(path, manifest.str()));
  return path;
}

std::string PoseRangesToYaml(const std::vector<PoseRange>& ranges) {
  YamlText yaml;
  yaml << (ranges.empty() ? "poses: []\n" : "poses:\n");
  for (const PoseRange& range : ranges) {
    yaml << "  - { first: " << range.first << ", last: " << range.last;
    if (!range.face_up.empty()) yaml << ", face: " << Quoted{range.face_up};
    if (!range.id.empty()) yaml << ", id: " << Quoted{range.id};
    yaml << " }\n";
  }
  return yaml.str();
}

}  // namespace truetriad

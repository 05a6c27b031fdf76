// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 bags (.bag) to a recording. docs/converting.md.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/ros/bag_recording.h"
#include "tools/convert/ros1/rosbag.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

void SayWhatIsDamaged(const Rosbag& bag, const std::string& path) {
  if (bag.damaged_chunks() + bag.damaged_records() == 0) return;
  Note(path + ": damaged: " + Count(bag.damaged_chunks(), "chunk", "chunks") + " and " +
       Count(bag.damaged_records(), "record", "records") + " incomplete, " +
       Count(bag.skipped_bytes(), "byte", "bytes") + " skipped");
}

/// One bag of the recording.
struct Part {
  std::string path;
  std::unique_ptr<Rosbag> survey;
  std::vector<std::size_t> topics;  ///< Where its topics are in those of all.
};

/// A bag lists its topics as it goes, so it is read twice: once for what it holds.
Result<std::vector<Part>> Survey(const Arguments& arguments, BagTopics* topics) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> paths, InputFiles(arguments, ".bag"));
  std::vector<Part> parts;
  for (const std::string& path : paths) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Rosbag> survey, Rosbag::Open(path));
    survey->Read([](const Rosbag::Message&) {}, {});
    SayWhatIsDamaged(*survey, path);
    std::vector<std::size_t> places = topics->Add(survey->topics());
    parts.push_back({path, std::move(survey), std::move(places)});
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return BeginOf(a.survey->topics()) < BeginOf(b.survey->topics());
  });
  return parts;
}

Status Run(const Arguments& arguments) {
  BagTopics topics;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Part> parts, Survey(arguments, &topics));
  if (arguments.list) {
    ListTopics(topics.all());
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<BagRecording> recording,
                             BagRecording::Create(topics.all(),
                                                  arguments,
                                                  Encoding::kRos1,
                                                  "ros1-bag",
                                                  "truetriad-convert-ros1 " TRUETRIAD_VERSION,
                                                  ReadRos1Message));
  std::uint64_t damaged_chunks = 0, damaged_records = 0;
  for (const Part& part : parts) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Rosbag> bag, Rosbag::Open(part.path));
    bag->UseConnectionsOf(*part.survey);
    ProgressLine line("Converting");
    bag->Read(
        [&](const Rosbag::Message& message) {
          if (message.topic >= part.topics.size()) return;
          const std::size_t topic = part.topics[message.topic];
          if (recording->Wants(topic)) recording->Take(topic, message.received_ns, message.data);
        },
        line.callback());
    damaged_chunks += bag->damaged_chunks();
    damaged_records += bag->damaged_records();
  }
  if (parts.size() > 1) recording->SetSource("bags", std::to_string(parts.size()));
  if (damaged_chunks > 0) recording->SetSource("incomplete chunks", std::to_string(damaged_chunks));
  if (damaged_records > 0)
    recording->SetSource("incomplete records", std::to_string(damaged_records));
  return recording->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  const std::string details =
      "\nReads topics of type sensor_msgs/Imu, MagneticField and Temperature. By default the "
      "only\nImu and the only MagneticField topic are converted; if there are several, choose "
      "with\n--topic=A,B. A Temperature topic is converted only if named. Times are those of "
      "the\nmessage headers. Bags that were not closed (.bag.active) or cut short are read as "
      "far as\nthey are complete.\n" +
      std::string(truetriad::convert::LaidOutHelp());
  const truetriad::convert::Converter converter = {.format = "ros1",
                                                   .input = "a ROS 1 bag (.bag, version 2.0)",
                                                   .details = details,
                                                   .takes_several = true,
                                                   .takes_topics = true,
                                                   .others = {"columns", "units", "layout"},
                                                   .run = truetriad::convert::Run};
  return truetriad::convert::RunConverter(converter, argc, argv);
}

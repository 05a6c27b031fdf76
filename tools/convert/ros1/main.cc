// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 bags (.bag) to a recording. docs/converting.md.
#include <memory>
#include <string>

#include "tools/convert/common/converter.h"
#include "tools/convert/ros/imu_log.h"
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

/// A bag lists its topics as it goes, so it is read twice: once for what it holds.
Status Run(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Rosbag> survey, Rosbag::Open(arguments.input));
  survey->Read([](const Rosbag::Message&) {}, {});
  SayWhatIsDamaged(*survey, arguments.input);
  const std::vector<Topic>& topics = survey->topics();
  if (arguments.list) {
    ListTopics(topics);
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const TopicChoice choice, ChooseTopics(topics, arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ImuRecording> recording, ImuRecording::Create(
      choice, arguments, "ros1-bag", "truetriad-convert-ros1 " TRUETRIAD_VERSION));
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Rosbag> bag, Rosbag::Open(arguments.input));
  bag->UseConnectionsOf(*survey);
  {
    ProgressLine line("Converting");
    bag->Read(
        [&](const Rosbag::Message& message) {
          const Role role = message.topic < topics.size()
                                ? choice.RoleOfTopic(&topics[message.topic])
                                : Role::kNone;
          if (role == Role::kNone) return;
          const std::optional<ImuMessage> read = ReadRos1Message(role, message.data);
          if (read) {
            recording->Add(role, message.received_ns, *read);
          } else {
            recording->CountDamaged();
          }
        },
        line.callback());
  }
  if (bag->damaged_chunks() > 0) {
    recording->SetSource("incomplete chunks", std::to_string(bag->damaged_chunks()));
  }
  if (bag->damaged_records() > 0) {
    recording->SetSource("incomplete records", std::to_string(bag->damaged_records()));
  }
  return recording->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  const truetriad::convert::Converter converter = {
      .format = "ros1",
      .input = "a ROS 1 bag (.bag, version 2.0)",
      .details =
          "\nReads topics of type sensor_msgs/Imu, MagneticField and Temperature. By default the "
          "only\nImu and the only MagneticField topic are converted; if there are several, choose "
          "with\n--topic=A,B. A Temperature topic is converted only if named. Times are those of "
          "the\nmessage headers. Bags that were not closed (.bag.active) or cut short are read as "
          "far as\nthey are complete.\n",
      .takes_topics = true,
      .takes_instance = false,
      .others = {},
      .run = truetriad::convert::Run};
  return truetriad::convert::RunConverter(converter, argc, argv);
}

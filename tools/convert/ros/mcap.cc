// SPDX-License-Identifier: Apache-2.0
//
// ROS 2 bags in MCAP to a recording; a script in Node reads the container. docs/converting.md.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/node/node_log.h"
#include "tools/convert/ros/bag_recording.h"

namespace truetriad::convert {
namespace {

class McapBag : public Bag {
 public:
  static Result<std::unique_ptr<Bag>> Open(const std::string& path) {
    std::unique_ptr<McapBag> bag(new McapBag(path));
    TRUETRIAD_RETURN_IF_ERROR(bag->ReadAll(Json(), {}));
    return std::unique_ptr<Bag>(std::move(bag));
  }

  Status Read(const Wants& wants, const Take& take) override {
    Json names = Json::array();
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      if (wants(i)) names.push_back({topics_[i].name, topics_[i].type, i});
    }
    return ReadAll(names, take);
  }

  std::map<std::string, std::uint64_t> Damage() const override { return damage_; }

 private:
  explicit McapBag(std::string path) : path_(std::move(path)) {}

  /// `wanted`: [name, type, number] of the topics whose messages are taken; null: their topics are.
  Status ReadAll(const Json& wanted, const Take& take) {
    const Json request = {{"format", "mcap"}, {"input", path_}, {"wanted", wanted}};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<NodeLog> log, NodeLog::Start(request));
    for (;;) {
      TRUETRIAD_ASSIGN_OR_RETURN(const NodeLog::Frame frame, log->Next());
      if (frame.kind == '\0') return {};
      if (frame.kind == 'P') {
        ByteCursor message(frame.body);
        const auto topic = message.Take<std::uint16_t>();
        const auto received_ns = message.Take<std::int64_t>();
        take(topic, received_ns, message.left());
        continue;
      }
      const Json said = Json::parse(frame.body);
      if (frame.kind == 'C') {
        topics_.push_back({.name = said.at("name"),
                           .type = said.at("type"),
                           .messages = said.at("messages"),
                           .first_ns = said.at("first"),
                           .last_ns = said.at("last"),
                           .definition = said.at("definition")});
      } else {
        damage_ = said;
      }
    }
  }

  std::string path_;
  std::map<std::string, std::uint64_t> damage_;
};

constexpr BagFormat kFormat = {.converter = "mcap",
                               .input = "a ROS 2 bag (.mcap)",
                               .source = "mcap",
                               .ending = ".mcap",
                               .encoding = Encoding::kCdr,
                               .open = McapBag::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunBagConverter(truetriad::convert::kFormat, argc, argv);
}

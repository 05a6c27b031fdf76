// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::convert {

/// The serialisation of messages in a bag.
enum class Encoding {
  kRos1,  ///< Fields one after another, little-endian.
  kCdr,   ///< ROS 2: 4 bytes that state the byte order, then aligned fields.
};

/// The short name of a type: "pkg/Name" of "pkg/msg/Name".
std::string TypeName(std::string_view type);

/// A field of a message.
struct LaidOutField {
  enum class Kind { kNumber, kSigned, kUnsigned, kString, kTime, kMessage };
  enum class Array { kNone, kFixed, kSequence };

  std::string name;
  Kind kind = Kind::kNumber;
  std::size_t size = 0;  ///< Bytes of a number, if it is one.
  std::string type;      ///< The type, for kMessage: "geometry_msgs/Vector3".
  Array array = Array::kNone;
  std::uint32_t count = 1;  ///< Number of elements, for kFixed.
};

/// The fields of messages in order, as `.msg` files define them.
class MessageLayouts {
 public:
  /// Knows from the start the types of std_msgs, geometry_msgs and sensor_msgs that hold readings.
  explicit MessageLayouts(Encoding encoding);

  /// Parses the definition of `type`: lines of `type name`. Other types may follow, each after a
  /// line of `=` and a line `MSG: NAME`. If `type` is empty, the text must name each type. Error:
  /// an invalid field, with its line.
  Status Define(const std::string& type, std::string_view text);

  /// The fields of a type ("pkg/msg/Name" is "pkg/Name"); null if it is not defined.
  const std::vector<LaidOutField>* Find(std::string_view type) const;

  /// Error: a type is not defined or contains itself; the message states how to define it.
  Status Check(const std::string& type) const;

 private:
  Encoding encoding_;
  std::map<std::string, std::vector<LaidOutField>, std::less<>> types_;
};

/// The requested numbers of one message.
///
/// A path names a number: "vector.x"; in an array, "data.3" is the element of index 3 (from 0).
class MessageNumbers {
 public:
  /// `layouts` and `type` must be valid, and outlive this object.
  MessageNumbers(const MessageLayouts* layouts, std::string type, Encoding encoding);

  /// The paths of three numbers of a message.
  struct Three {
    std::vector<std::string> paths;
    std::string sequence;  ///< If set: an array of variable length that must hold just these three.
  };

  /// The three numbers that a user names by "acc", "vector", "gx+gy+gz" or "data:4-6" (counted from
  /// 1). Empty `reference`: the only field with three numbers. Error (usage): no such numbers; the
  /// message lists the fields.
  Result<Three> Vector(const std::string& reference) const;
  /// The number that a user names by "temp" or "data:7". Error (usage): as Vector.
  Result<std::string> Single(const std::string& reference) const;
  /// The path of the time in the message's header, or of its only field of type time; empty: none.
  std::string Stamp() const;
  /// The path of the frame name in the message's header; empty: none.
  std::string Frame() const;
  bool IsTime(const std::string& path) const;

  /// Requests a number; returns its index for operator[].
  std::size_t Ask(const std::string& path);
  std::array<std::size_t, 3> Ask(const Three& three);

  struct Number {
    double value = 0.0;
    std::int64_t integer = 0;    ///< The value of an integer; times in nanoseconds.
    std::string_view text = {};  ///< The value of a string; valid as long as the message.
  };
  /// Reads a message. False: the message is of another type, an array is too short, or an array
  /// that must have three numbers has another length.
  bool Read(std::string_view bytes);
  /// Whether the last message was rejected because an array did not have exactly three numbers.
  bool WasNotThree() const { return was_not_three_; }
  const Number& operator[](std::size_t place) const { return numbers_[place]; }

 private:
  struct Asked {
    std::optional<std::size_t> place;
    bool has_three = false;  ///< Must be an array with exactly three numbers.
    std::map<std::string, Asked, std::less<>> parts;
  };
  class Walk;

  Asked* Find(const std::string& path);
  const LaidOutField* FieldAt(const std::string& path) const;
  /// The path of a part of kind `kind` in the message's header; empty: none.
  std::string InHeader(std::string_view part, LaidOutField::Kind kind) const;
  /// "ax, acc.x, data": the numeric fields.
  std::string Fields() const;

  const MessageLayouts* layouts_;
  std::string type_;
  Encoding encoding_;
  Asked asked_;
  std::vector<Number> numbers_;
  std::vector<bool> found_;
  bool was_not_three_ = false;
};

}  // namespace truetriad::convert

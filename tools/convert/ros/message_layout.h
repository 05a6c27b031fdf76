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

/// How messages lie in a bag.
enum class Encoding {
  kRos1,  ///< Fields one after another, little-endian.
  kCdr,   ///< ROS 2: 4 bytes that state the byte order, then fields aligned from there on.
};

/// "pkg/Name" of "pkg/msg/Name".
std::string TypeName(std::string_view type);

/// A field of a message.
struct LaidOutField {
  enum class Kind { kNumber, kSigned, kUnsigned, kString, kTime, kMessage };
  enum class Array { kNone, kFixed, kSequence };

  std::string name;
  Kind kind = Kind::kNumber;
  std::size_t size = 0;  ///< Bytes of a number.
  std::string type;      ///< Of kMessage: "geometry_msgs/Vector3".
  Array array = Array::kNone;
  std::uint32_t count = 1;  ///< Of kFixed.
};

/// Which fields messages have, in their order, as `.msg` files define it.
class MessageLayouts {
 public:
  /// With the types of std_msgs and geometry_msgs that hold readings.
  explicit MessageLayouts(Encoding encoding);

  /// Takes a definition of `type`: lines of `type name`, and behind lines of `=` and `MSG: NAME`
  /// those of other types. Where `type` is empty the text has to name each.
  /// Error: what is no field, with its line.
  Status Define(const std::string& type, std::string_view text);

  /// The fields of a type ("pkg/msg/Name" is "pkg/Name"); null where it is not defined.
  const std::vector<LaidOutField>* Find(std::string_view type) const;

  /// Error: a type that is not defined, or that holds itself; says how to define it.
  Status Check(const std::string& type) const;

 private:
  Encoding encoding_;
  std::map<std::string, std::vector<LaidOutField>, std::less<>> types_;
};

/// The numbers of one message that are asked for.
///
/// A number is named by its path, "vector.x"; of an array by its position from 0, "data.3".
class MessageNumbers {
 public:
  /// `layouts` and `type` must have been checked, and live longer.
  MessageNumbers(const MessageLayouts* layouts, std::string type, Encoding encoding);

  /// Three numbers of a message.
  struct Three {
    std::vector<std::string> paths;
    std::string sequence;  ///< The array that they are the whole of, of any length by its type.
  };

  /// The three numbers that a user calls "acc", "vector", "gx+gy+gz" or "data:4-6" (counted from
  /// 1); empty: the only field with three. Error (usage): says which fields there are.
  Result<Three> Vector(const std::string& reference) const;
  /// The one number that a user calls "temp" or "data:7". Error (usage): as Vector.
  Result<std::string> Single(const std::string& reference) const;
  /// The path of the time in the message's header, or of its only field of a time; empty: none.
  std::string Stamp() const;
  /// The path of the name of the frame in the message's header; empty: none.
  std::string Frame() const;
  bool IsTime(const std::string& path) const;

  /// Reads a number from now on; its place in what Read gives.
  std::size_t Ask(const std::string& path);
  std::array<std::size_t, 3> Ask(const Three& three);

  struct Number {
    double value = 0.0;
    std::int64_t integer = 0;    ///< Where it is one; nanoseconds of a time.
    std::string_view text = {};  ///< Where it is a string; valid as long as the message.
  };
  /// False where the bytes are no such message, or an array is too short, or has not the three
  /// numbers that are asked for.
  bool Read(std::string_view bytes);
  /// The last message was refused for an array of not three numbers.
  bool WasNotThree() const { return was_not_three_; }
  const Number& operator[](std::size_t place) const { return numbers_[place]; }

 private:
  struct Asked {
    std::optional<std::size_t> place;
    bool has_three = false;  ///< Of an array: no more and no less.
    std::map<std::string, Asked, std::less<>> parts;
  };
  class Walk;

  Asked* Find(const std::string& path);
  const LaidOutField* FieldAt(const std::string& path) const;
  /// The path of a part of the message's header, which is of `kind`; empty: none.
  std::string InHeader(std::string_view part, LaidOutField::Kind kind) const;
  /// "ax, acc.x, data": what has numbers.
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

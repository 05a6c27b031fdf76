// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros/message_layout.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <set>
#include <utility>

#include "tools/convert/common/converter.h"

namespace truetriad::convert {
namespace {

using Kind = LaidOutField::Kind;
using Array = LaidOutField::Array;

/// Types that are known without a definition, since bags and other definitions may omit them.
constexpr std::string_view kKnownTypes =
    "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    "MSG: geometry_msgs/Vector3Stamped\nstd_msgs/Header header\ngeometry_msgs/Vector3 vector\n"
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    "MSG: geometry_msgs/Accel\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"
    "MSG: geometry_msgs/AccelStamped\nstd_msgs/Header header\ngeometry_msgs/Accel accel\n"
    "MSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"
    "MSG: geometry_msgs/TwistStamped\nstd_msgs/Header header\ngeometry_msgs/Twist twist\n"
    "MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n"
    "MSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n"
    "MSG: std_msgs/Float32MultiArray\nstd_msgs/MultiArrayLayout layout\nfloat32[] data\n"
    "MSG: std_msgs/Float64MultiArray\nstd_msgs/MultiArrayLayout layout\nfloat64[] data\n"
    "MSG: std_msgs/Int16MultiArray\nstd_msgs/MultiArrayLayout layout\nint16[] data\n"
    "MSG: std_msgs/Int32MultiArray\nstd_msgs/MultiArrayLayout layout\nint32[] data\n"
    "MSG: sensor_msgs/Imu\nstd_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
    "float64[9] linear_acceleration_covariance\n"
    "MSG: sensor_msgs/MagneticField\nstd_msgs/Header header\n"
    "geometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n"
    "MSG: sensor_msgs/Temperature\nstd_msgs/Header header\nfloat64 temperature\n"
    "float64 variance\n";
constexpr std::string_view kRos1Header =
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
constexpr std::string_view kRos2Header =
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";

constexpr std::uint32_t kMostElements = 1'000'000;  // Of a fixed array; more are rejected.

struct Primitive {
  std::string_view name;
  Kind kind;
  std::size_t size;
};
constexpr std::array<Primitive, 17> kPrimitives = {{{"bool", Kind::kUnsigned, 1},
                                                    {"byte", Kind::kSigned, 1},
                                                    {"char", Kind::kUnsigned, 1},
                                                    {"int8", Kind::kSigned, 1},
                                                    {"uint8", Kind::kUnsigned, 1},
                                                    {"int16", Kind::kSigned, 2},
                                                    {"uint16", Kind::kUnsigned, 2},
                                                    {"int32", Kind::kSigned, 4},
                                                    {"uint32", Kind::kUnsigned, 4},
                                                    {"int64", Kind::kSigned, 8},
                                                    {"uint64", Kind::kUnsigned, 8},
                                                    {"float32", Kind::kNumber, 4},
                                                    {"float64", Kind::kNumber, 8},
                                                    {"string", Kind::kString, 0},
                                                    {"time", Kind::kTime, 4},
                                                    {"duration", Kind::kTime, 4},
                                                    {"builtin_interfaces/Time", Kind::kTime, 4}}};

std::string_view Trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

bool IsFieldName(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// Parses a line `float32[3] acc`, `int32 count 0` or `Header header`. `package`: the package of
/// the type that has this field. Unset: the line is not a field.
std::optional<LaidOutField> ParseField(std::string_view line,
                                       const std::string& package,
                                       Encoding encoding) {
  const std::size_t blank = line.find_first_of(" \t");
  if (blank == std::string_view::npos) return std::nullopt;
  std::string_view type = line.substr(0, blank);
  const std::string_view rest = Trimmed(line.substr(blank));
  LaidOutField field;
  field.name = rest.substr(0, rest.find_first_of(" \t"));
  if (!IsFieldName(field.name)) return std::nullopt;
  if (const std::size_t open = type.find('['); open != std::string_view::npos) {
    if (!type.ends_with(']')) return std::nullopt;
    const std::string_view length = type.substr(open + 1, type.size() - open - 2);
    field.array = length.empty() || length.starts_with("<=") ? Array::kSequence : Array::kFixed;
    if (field.array == Array::kFixed) {
      const std::optional<std::uint32_t> count = WholeNumber(length);
      if (!count || *count > kMostElements) return std::nullopt;
      field.count = *count;
    }
    type = type.substr(0, open);
  }
  type = type.substr(0, type.find("<="));  // As in string<=10.
  std::string name = TypeName(type);
  if (name == "Header") name = "std_msgs/Header";
  if (name == "builtin_interfaces/Duration") name = "builtin_interfaces/Time";
  for (const Primitive& primitive : kPrimitives) {
    if (primitive.name != name) continue;
    field.kind = primitive.kind;
    field.size = primitive.size;
    // In ROS 1 `byte` means int8, in ROS 2 uint8.
    if (name == "byte" && encoding == Encoding::kCdr) field.kind = Kind::kUnsigned;
    return field;
  }
  field.kind = Kind::kMessage;
  field.type = name.find('/') == std::string::npos ? package + name : name;
  return field;
}

}  // namespace

std::string TypeName(std::string_view type) {
  std::string name(type);
  if (const std::size_t at = name.find("/msg/"); at != std::string::npos) name.erase(at, 4);
  return name;
}

MessageLayouts::MessageLayouts(Encoding encoding) : encoding_(encoding) {
  for (const std::string_view text :
       {encoding == Encoding::kRos1 ? kRos1Header : kRos2Header, kKnownTypes}) {
    static_cast<void>(Define("", text));
  }
}

Status MessageLayouts::Define(const std::string& type, std::string_view text) {
  std::string current = TypeName(type);
  if (!current.empty()) types_[current].clear();
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    const std::size_t comment = line.find('#');
    line = Trimmed(line.substr(0, comment));
    if (line.empty() || line.find_first_not_of('=') == std::string_view::npos) continue;
    if (line.starts_with("MSG:")) {
      current = TypeName(Trimmed(line.substr(4)));
      types_[current].clear();
      continue;
    }
    // A constant, with its value after `=`, is no field.
    if (line.substr(0, line.find_first_of("\"'")).find('=') != std::string_view::npos &&
        line.find("<=") == std::string_view::npos) {
      continue;
    }
    const std::string package = current.substr(0, current.find('/') + 1);
    const std::optional<LaidOutField> field = ParseField(line, package, encoding_);
    if (!field || current.empty()) {
      return Error(ErrorCode::kWrongFormat,
                   (current.empty() ? "the layout" : "the layout of " + PrintableLine(current)) +
                       ", line " + std::to_string(number) + ": `" +
                       PrintableLine(line.substr(0, 60)) +
                       (current.empty() ? "`: begin with `MSG: package/Type`"
                                        : "` is not a field, as `float32[3] acc` is"));
    }
    types_[current].push_back(*field);
  }
  return {};
}

const std::vector<LaidOutField>* MessageLayouts::Find(std::string_view type) const {
  const bool is_short = type.find("/msg/") == std::string_view::npos;
  const auto found = is_short ? types_.find(type) : types_.find(TypeName(type));
  return found == types_.end() ? nullptr : &found->second;
}

Status MessageLayouts::Check(const std::string& type) const {
  constexpr std::size_t kDeepest = 20;  // Messages in use are at most 5 deep.
  std::set<std::string> around;
  Status status;
  const auto check = [&](const auto& self, const std::string& name) -> void {
    const std::vector<LaidOutField>* const fields = Find(name);
    if (fields == nullptr) {
      status = Error(
          ErrorCode::kMissingArgument,
          "the fields of " + PrintableLine(name) +
              " are not known; give its definition with --layout=FILE.msg, below a line `MSG: " +
              PrintableLine(name) + "`");
      return;
    }
    if (around.size() >= kDeepest || !around.insert(TypeName(name)).second) {
      status = Error(
          ErrorCode::kWrongFormat,
          "the layout of " + PrintableLine(name) + " contains itself, or is nested too deeply");
      return;
    }
    for (const LaidOutField& field : *fields) {
      if (field.kind == Kind::kMessage && status) self(self, field.type);
    }
    around.erase(TypeName(name));
  };
  check(check, type);
  return status;
}

MessageNumbers::MessageNumbers(const MessageLayouts* layouts, std::string type, Encoding encoding)
    : layouts_(layouts), type_(std::move(type)), encoding_(encoding) {}

const LaidOutField* MessageNumbers::FieldAt(const std::string& path) const {
  const std::vector<LaidOutField>* fields = layouts_->Find(type_);
  const LaidOutField* field = nullptr;
  std::string_view rest = path;
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('.'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    if (fields == nullptr) return nullptr;
    const auto found = std::find_if(
        fields->begin(), fields->end(), [&](const LaidOutField& f) { return f.name == part; });
    if (found == fields->end()) return nullptr;
    field = &*found;
    if (field->array != Array::kNone && !rest.empty()) {
      const std::string_view index = rest.substr(0, rest.find('.'));
      if (!WholeNumber(index)) return nullptr;
      rest.remove_prefix(std::min(index.size() + 1, rest.size()));
    }
    fields = field->kind == Kind::kMessage ? layouts_->Find(field->type) : nullptr;
  }
  return field;
}

std::string MessageNumbers::Fields() const {
  constexpr std::size_t kMost = 40;  // Names listed in a message.
  std::vector<std::string> names;
  const auto list =
      [&](const auto& self, std::string_view type, const std::string& prefix) -> void {
    for (const LaidOutField& field : *layouts_->Find(type)) {
      if (names.size() > kMost) return;
      const std::string name = prefix + field.name;
      if (field.kind == Kind::kMessage && field.array == Array::kNone) {
        self(self, field.type, name + ".");
      } else if (field.kind != Kind::kString) {
        names.push_back(name + (field.array == Array::kNone ? "" : "[]"));
      }
    }
  };
  list(list, type_, "");
  return ListOf(names, kMost);
}

Result<std::string> MessageNumbers::Single(const std::string& reference) const {
  std::string path = reference;
  if (const std::size_t colon = path.find(':'); colon != std::string::npos) {
    const std::optional<std::uint32_t> index =
        WholeNumber(std::string_view(path).substr(colon + 1));
    if (index && *index > 0) path = path.substr(0, colon) + '.' + std::to_string(*index - 1);
  }
  const LaidOutField* const field = FieldAt(path);
  const bool has_index = !path.empty() && path.back() >= '0' && path.back() <= '9' &&
                         WholeNumber(path.substr(path.rfind('.') + 1));
  const bool is_one = field != nullptr && (field->array == Array::kNone || has_index) &&
                      field->kind != Kind::kString && field->kind != Kind::kMessage;
  const bool is_there = is_one && (field->array != Array::kFixed ||
                                   *WholeNumber(path.substr(path.rfind('.') + 1)) < field->count);
  if (is_there) return path;
  return Error(ErrorCode::kUnknownName,
               "--columns: `" + PrintableLine(reference) + "` is not a number of " +
                   PrintableLine(type_) + ", which has " + Fields());
}

Result<MessageNumbers::Three> MessageNumbers::Vector(const std::string& reference) const {
  const auto of_parts = [&](const std::vector<std::string>& parts) -> Result<Three> {
    Three three;
    for (const std::string& part : parts) {
      TRUETRIAD_ASSIGN_OR_RETURN(std::string path, Single(part));
      three.paths.push_back(std::move(path));
    }
    return three;
  };
  if (const auto parts = Split(reference, '+'); parts.size() == 3) return of_parts(parts);
  const std::size_t colon = std::min(reference.find(':'), reference.size());
  const auto range =
      ParseRange(std::string_view(reference).substr(std::min(colon + 1, reference.size())));
  if (range && range->second == range->first + 2) {
    std::vector<std::string> elements;
    for (std::uint32_t element = range->first; element <= range->second; ++element)
      elements.push_back(reference.substr(0, colon + 1) + std::to_string(element));
    return of_parts(elements);
  }
  std::vector<Three> found;
  const auto consider = [&](const LaidOutField& field, const std::string& path) {
    if (field.array != Array::kNone && field.kind != Kind::kString &&
        field.kind != Kind::kMessage) {
      const bool is_sequence = field.array == Array::kSequence;
      if (is_sequence || field.count == 3)
        found.push_back({{path + ".0", path + ".1", path + ".2"}, is_sequence ? path : ""});
    } else if (field.kind == Kind::kMessage && field.array == Array::kNone) {
      const auto parts = of_parts({path + ".x", path + ".y", path + ".z"});
      if (parts && layouts_->Find(field.type)->size() == 3) found.push_back(*parts);
    }
  };
  if (reference.empty()) {
    if (const auto parts = of_parts({"x", "y", "z"})) return *parts;
    for (const LaidOutField& field : *layouts_->Find(type_)) consider(field, field.name);
  } else if (const LaidOutField* const field = FieldAt(reference)) {
    consider(*field, reference);
  }
  if (found.size() == 1) return found[0];
  return Error(ErrorCode::kUnknownName,
               "--columns: " +
                   (reference.empty() ? "name the three readings of " + PrintableLine(type_)
                                      : "`" + PrintableLine(reference) +
                                            "` is not three numbers of " + PrintableLine(type_)) +
                   ", which has " + Fields() + "; expected names as in acc, gx+gy+gz or data:4-6");
}

std::string MessageNumbers::InHeader(std::string_view part, Kind kind) const {
  for (const LaidOutField& field : *layouts_->Find(type_)) {
    if (field.array != Array::kNone || TypeName(field.type) != "std_msgs/Header") continue;
    // The user's layout may define another header, which may lack the part.
    const std::string path = field.name + "." + std::string(part);
    const LaidOutField* const found = FieldAt(path);
    if (found != nullptr && found->kind == kind && found->array == Array::kNone) return path;
  }
  return "";
}

std::string MessageNumbers::Frame() const { return InHeader("frame_id", Kind::kString); }

std::string MessageNumbers::Stamp() const {
  std::string stamp = InHeader("stamp", Kind::kTime);
  if (!stamp.empty()) return stamp;
  std::vector<std::string> times;
  for (const LaidOutField& field : *layouts_->Find(type_)) {
    if (field.array == Array::kNone && field.kind == Kind::kTime) times.push_back(field.name);
  }
  return times.size() == 1 ? times[0] : "";
}

bool MessageNumbers::IsTime(const std::string& path) const {
  const LaidOutField* const field = FieldAt(path);
  return field != nullptr && field->kind == Kind::kTime;
}

MessageNumbers::Asked* MessageNumbers::Find(const std::string& path) {
  Asked* asked = &asked_;
  std::string_view rest = path;
  while (!rest.empty()) {
    const std::string part(rest.substr(0, rest.find('.')));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    asked = &asked->parts[part];
  }
  return asked;
}

std::size_t MessageNumbers::Ask(const std::string& path) {
  Asked* const asked = Find(path);
  if (!asked->place) {
    asked->place = numbers_.size();
    numbers_.emplace_back();
  }
  return *asked->place;
}

std::array<std::size_t, 3> MessageNumbers::Ask(const Three& three) {
  std::array<std::size_t, 3> places{};
  for (std::size_t axis = 0; axis < 3; ++axis) places[axis] = Ask(three.paths[axis]);
  if (!three.sequence.empty()) Find(three.sequence)->has_three = true;
  return places;
}

/// Decodes one message.
class MessageNumbers::Walk {
 public:
  Walk(MessageNumbers* numbers, std::string_view bytes) : numbers_(numbers), left_(bytes) {}

  /// False: the bytes are not a message of the type.
  bool Run() {
    if (numbers_->encoding_ == Encoding::kCdr) {
      constexpr std::size_t kHead = 4;  // Representation and options of CDR.
      // 0: big-endian, 1: little-endian; other values mean another byte order or alignment.
      if (left_.size() < kHead || left_[0] != 0 || (left_[1] != 0 && left_[1] != 1)) return false;
      is_swapped_ = left_[1] == 0;
      left_.remove_prefix(kHead);
      is_aligned_ = true;
    }
    Message(numbers_->type_, &numbers_->asked_);
    // If bytes are left over, the message has other fields; but CDR writers may pad to a full word.
    constexpr std::size_t kMostFill = 7;
    return !failed_ && left_.size() <= (is_aligned_ ? kMostFill : 0);
  }

 private:
  void Message(std::string_view type, const Asked* asked) {
    const std::vector<LaidOutField>& fields = *numbers_->layouts_->Find(type);
    if (fields.empty() && is_aligned_) Skip(1, 1);  // In ROS 2 an empty message has one byte.
    for (const LaidOutField& field : fields) {
      if (failed_) return;
      Field(field, Part(asked, field.name));
    }
  }

  static const Asked* Part(const Asked* asked, std::string_view name) {
    if (asked == nullptr) return nullptr;
    const auto found = asked->parts.find(name);
    return found == asked->parts.end() ? nullptr : &found->second;
  }

  void Field(const LaidOutField& field, const Asked* asked) {
    if (field.array == Array::kNone) {
      Element(field, asked);
      return;
    }
    std::uint64_t count = field.count;
    if (field.array == Array::kSequence) {
      count = Load(4);
      // An element has at least one byte.
      if (count > left_.size()) failed_ = true;
      if (!failed_ && asked != nullptr && asked->has_three && count != 3)
        numbers_->was_not_three_ = failed_ = true;
    }
    if (field.size > 0 && field.kind != Kind::kTime) {
      Numbers(field, count, asked);
      return;
    }
    for (std::uint64_t i = 0; i < count && !failed_; ++i) {
      Element(field, asked == nullptr ? nullptr : Part(asked, std::to_string(i)));
    }
  }

  /// Reads the requested elements of an array of numbers, and skips the others.
  void Numbers(const LaidOutField& field, std::uint64_t count, const Asked* asked) {
    if (count == 0 || failed_) return;
    Skip(field.size, 0);
    const std::string_view begin = left_;
    const std::size_t offset = offset_;
    static const Asked nothing;
    for (const auto& [index, part] : (asked == nullptr ? nothing : *asked).parts) {
      const std::uint64_t place = WholeNumber(index).value_or(count);
      if (place >= count || failed_) continue;
      Skip(1, place * field.size);
      if (!failed_) Element(field, &part);
      left_ = begin;
      offset_ = offset;
    }
    Skip(1, count * field.size);
  }

  void Element(const LaidOutField& field, const Asked* asked) {
    // A definition can turn few bytes into many empty fields, so their number is limited.
    constexpr std::size_t kMostFields = 4'000'000;
    if (++fields_ > kMostFields) failed_ = true;
    if (failed_) return;
    Number number;
    switch (field.kind) {
      case Kind::kMessage:
        Message(field.type, asked);
        return;
      case Kind::kString: {
        const std::uint64_t size = Load(4);
        number.text = left_.substr(0, size);
        Skip(1, size);
        number.text = number.text.substr(0, number.text.find('\0'));
        break;
      }
      case Kind::kTime: {
        const std::uint64_t seconds = Load(4);
        const std::uint64_t nanoseconds = Load(4);
        // The seconds are signed in ROS 2.
        const std::int64_t signed_seconds =
            is_aligned_ ? static_cast<std::int32_t>(seconds) : static_cast<std::int64_t>(seconds);
        number.integer = signed_seconds * 1'000'000'000 + static_cast<std::int64_t>(nanoseconds);
        number.value = static_cast<double>(number.integer);
        break;
      }
      case Kind::kNumber: {
        const std::uint64_t bits = Load(field.size);
        number.value = field.size == 8 ? std::bit_cast<double>(bits)
                                       : std::bit_cast<float>(static_cast<std::uint32_t>(bits));
        break;
      }
      case Kind::kUnsigned: {
        const std::uint64_t bits = Load(field.size);
        number.integer = static_cast<std::int64_t>(bits);
        number.value = static_cast<double>(bits);
        break;
      }
      case Kind::kSigned: {
        const auto shift = static_cast<unsigned>(64 - 8 * field.size);
        number.integer = static_cast<std::int64_t>(Load(field.size) << shift) >> shift;
        number.value = static_cast<double>(number.integer);
        break;
      }
    }
    if (failed_ || asked == nullptr || !asked->place) return;
    numbers_->numbers_[*asked->place] = number;
    numbers_->found_[*asked->place] = true;
  }

  void Skip(std::size_t alignment, std::uint64_t size) {
    if (is_aligned_) {
      const std::size_t padding = (alignment - offset_ % alignment) % alignment;
      if (padding > left_.size()) {
        failed_ = true;
        return;
      }
      left_.remove_prefix(padding);
      offset_ += padding;
    }
    if (size > left_.size()) {
      failed_ = true;
      return;
    }
    left_.remove_prefix(size);
    offset_ += size;
  }

  /// The bits of an integer of `size` bytes; 0 if fewer bytes are left.
  std::uint64_t Load(std::size_t size) {
    const std::string_view before = left_;
    Skip(size, size);
    if (failed_) return 0;
    const std::string_view bytes = before.substr(before.size() - left_.size() - size, size);
    std::array<char, 8> raw{};
    std::copy(bytes.begin(), bytes.end(), raw.begin());
    if (is_swapped_) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    std::uint64_t value = 0;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

  MessageNumbers* numbers_;
  std::string_view left_;
  std::size_t offset_ = 0;
  std::size_t fields_ = 0;
  bool is_aligned_ = false;
  bool is_swapped_ = false;
  bool failed_ = false;
};

bool MessageNumbers::Read(std::string_view bytes) {
  found_.assign(numbers_.size(), false);
  was_not_three_ = false;
  Walk walk(this, bytes);
  return walk.Run() && std::find(found_.begin(), found_.end(), false) == found_.end();
}

}  // namespace truetriad::convert

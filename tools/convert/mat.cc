// SPDX-License-Identifier: Apache-2.0
//
// Converts MATLAB files (.mat) to a recording. docs/converting.md.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <hdf5.h>
#include <zlib.h>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/common/unpack.h"

namespace truetriad::convert {
namespace {

constexpr int kDeepest = 8;  ///< Levels of nested structs whose fields get a name.
constexpr char kIncomplete[] =
    "is damaged: a variable is incomplete, and later ones may be missing";

/// Classes of a matrix. Version 5 states the number, version 7.3 the word of kKinds.
enum Kind : std::uint32_t {
  kStruct = 2,
  kObject,
  kText,
  kSparse,
  kDouble,
  kUint64 = 15,
  kCount = 17
};
constexpr std::array<std::string_view, kCount> kKinds = {"",
                                                         "cell",
                                                         "struct",
                                                         "object",
                                                         "char",
                                                         "sparse",
                                                         "double",
                                                         "single",
                                                         "int8",
                                                         "uint8",
                                                         "int16",
                                                         "uint16",
                                                         "int32",
                                                         "uint32",
                                                         "int64",
                                                         "uint64",
                                                         "function_handle"};
constexpr bool IsNumeric(std::uint32_t kind) { return kind >= kDouble && kind <= kUint64; }

/// An object found in a file.
struct Found {
  std::string name = {};
  std::uint32_t kind = 0;
  bool is_complex = false;
  std::vector<std::size_t> dimensions = {};
};

/// Adds a real numeric matrix or vector to the variables, anything else to the others. `read`:
/// reads the numbers of a variable.
template <typename Read>
void Add(const Found& found, const Read& read, VariableFile* file) {
  const auto& [name, kind, is_complex, dimensions] = found;
  const bool is_empty = std::count(dimensions.begin(), dimensions.end(), 0U) > 0;
  if (IsNumeric(kind) && !is_complex && dimensions.size() == 2 && !is_empty) {
    Variable variable{name, std::string(kKinds[kind]), dimensions[0], dimensions[1]};
    Variable& added = file->variables.emplace_back(variable);
    added.read = [read, variable] { return read(variable); };
    return;
  }
  std::string& what = file->others[name];
  if (kind == kText) {
    what = "text";
  } else if (kind == kSparse) {
    what = "a sparse matrix";
  } else if (kind == kStruct) {
    what = "a struct or an array of structs; name one of its fields";
  } else if (!IsNumeric(kind)) {
    what = "no array of numbers";
  } else if (is_complex) {
    what = "complex";
  } else {
    what = dimensions.size() == 2
               ? "empty"
               : "an array of " + std::to_string(dimensions.size()) + " dimensions";
  }
}

Error Damaged(const std::string& path, const std::string& name) {
  return Error(
      ErrorCode::kDamagedFile, {path}, "variable " + name + " is incomplete or inconsistent");
}

// -------------------------------------------------------------------------------------- version 5

constexpr std::size_t kTag = 8;        ///< Type and size of an element: two words.
constexpr std::size_t kHeader5 = 128;  ///< Text, version and byte order of the file.
constexpr int kDeepestCell = 64;       ///< Most nested cells: bounds the depth of recursion.
constexpr std::uint32_t kMatrix = 14, kCompressed = 15;  // Two types of elements.
constexpr std::size_t kChunk = std::size_t{1} << 14U;    ///< Most bytes read at once.

/// Most cells and elements of structs in all variables together. Without this limit a small file
/// could need much memory: a cell takes eight bytes of zeros, which compress to almost nothing.
constexpr int kMostCells = 250'000;

/// A type of numbers in a file, and how to read one.
struct NumberType {
  std::uint32_t type;
  std::size_t size;
  double (*value)(std::string_view bytes);
};
template <typename T>
constexpr NumberType TypeOf(std::uint32_t type) {
  return {type, sizeof(T), [](std::string_view bytes) {
            return static_cast<double>(LoadNumber<T>(bytes, 0));
          }};
}
constexpr std::array<NumberType, 10> kNumberTypes = {{TypeOf<std::int8_t>(1),
                                                      TypeOf<std::uint8_t>(2),
                                                      TypeOf<std::int16_t>(3),
                                                      TypeOf<std::uint16_t>(4),
                                                      TypeOf<std::int32_t>(5),
                                                      TypeOf<std::uint32_t>(6),
                                                      TypeOf<float>(7),
                                                      TypeOf<double>(9),
                                                      TypeOf<std::int64_t>(12),
                                                      TypeOf<std::uint64_t>(13)}};

std::uint32_t WordAt(std::string_view bytes, std::size_t offset, bool is_swapped) {
  const auto word = LoadNumber<std::uint32_t>(bytes, offset);
  return is_swapped ? __builtin_bswap32(word) : word;
}

/// The unpacked data; if they are damaged or truncated, the part before the damage.
std::string Inflated(std::string_view packed) {
  z_stream stream{};
  std::string content;
  if (inflateInit(&stream) != Z_OK) return content;
  const auto step = [&](std::string_view* rest, char* room, std::size_t* produced) {
    std::string some(rest->substr(0, kChunk));
    stream.next_in = reinterpret_cast<Bytef*>(some.data());
    stream.avail_in = static_cast<unsigned>(some.size());
    stream.next_out = reinterpret_cast<Bytef*>(room);
    stream.avail_out = static_cast<unsigned>(*produced);
    const bool goes_on = inflate(&stream, Z_NO_FLUSH) == Z_OK;
    rest->remove_prefix(some.size() - stream.avail_in);
    *produced -= stream.avail_out;
    return goes_on;
  };
  UnpackBy(step, packed, content.max_size(), &content);
  inflateEnd(&stream);
  return content;
}

/// Walks through a matrix and the matrices in it. A matrix is sound if it is complete, has the
/// bytes for each of its numbers or cells, and holds only sound matrices.
class Walk {
 public:
  /// `cells`: how many more cells are allowed. `wanted`: the matrix whose numbers are read; empty:
  /// none.
  Walk(ByteStream* content, bool is_swapped, int* cells, std::string wanted = "")
      : content_(content), is_swapped_(is_swapped), cells_(cells), wanted_(std::move(wanted)) {}

  /// Named objects in the order of the file.
  const std::vector<Found>& found() const { return found_; }
  std::vector<double>& numbers() { return numbers_; }

  /// Whether the next element of the file is sound.
  bool IsSound() {
    std::uint64_t left = content_->left();
    return IsSoundElement(&left, 0, "");
  }

 private:
  static constexpr std::uint32_t kComplexFlag = 0x800U;   // In the array flags.
  static constexpr std::size_t kLongestText = 1U << 20U;  // All field names of a struct.

  /// Whether an element is sound. Subtracts its size, at most `left` bytes, from `left`.
  bool IsSoundElement(std::uint64_t* left, int depth, const std::optional<std::string>& name) {
    const auto words = TakeWords(2, left);
    if (words.empty() || words[0] != kMatrix || words[1] > *left) return false;
    *left -= words[1];
    return IsSoundMatrix(words[1], depth, name);
  }

  /// Whether the matrix after a tag is sound. `name`: the name to use; empty: the matrix's own;
  /// nullopt: it has none, as in a list.
  bool IsSoundMatrix(std::uint64_t size, int depth, std::optional<std::string> name) {
    if (size == 0) {
      if (name) found_.push_back({.name = *name});
      return true;
    }
    if (depth > kDeepestCell) return false;
    const auto flags = TakeNumbers(&size);
    if (flags.empty()) return false;
    Found matrix{.kind = flags[0] & 0xFFU, .is_complex = (flags[0] & kComplexFlag) != 0};
    if (matrix.kind == 0 || matrix.kind >= kCount) return Skip(size);
    const auto dimensions = TakeNumbers(&size);
    const std::optional<std::string> own = TakeText(&size);
    if (dimensions.empty() || !own) return false;
    matrix.dimensions.assign(dimensions.begin(), dimensions.end());
    matrix.name = name && name->empty() ? *own : name.value_or("");
    if (name) found_.push_back(matrix);
    if (matrix.kind == kText || matrix.kind == kSparse) return Skip(size);
    const bool is_wanted = name && !wanted_.empty() && matrix.name == wanted_;
    const bool is_sound = IsNumeric(matrix.kind)
                              ? AreSoundNumbers(matrix, is_wanted, &size)
                              : AreSoundCells(matrix, depth, name.has_value(), &size);
    return is_sound && Skip(size);
  }

  /// Whether cells, or the fields of structs and objects, are sound.
  bool AreSoundCells(const Found& list, int depth, bool has_name, std::uint64_t* left) {
    if (list.kind == kObject && !TakeText(left)) return false;  // The object's class name.
    std::uint64_t count = 1;
    std::vector<std::string> fields;
    if (list.kind == kStruct || list.kind == kObject) {
      const auto length = TakeNumbers(left);
      const std::optional<std::string> names = TakeText(left);
      if (length.empty() || length[0] == 0 || !names) return false;
      count = names->size() / length[0];
      for (std::uint64_t i = 0; i < count; ++i)
        fields.emplace_back(names->substr(i * length[0], length[0]).c_str());
    }
    const bool is_single = list.dimensions == std::vector<std::size_t>{1, 1};
    const bool is_named = list.kind == kStruct && has_name && is_single && depth < kDeepest;
    if (std::count(list.dimensions.begin(), list.dimensions.end(), 0U) > 0) count = 0;
    for (const std::size_t dimension : list.dimensions) {
      if (count > 0 && dimension > *left / kTag / count) return false;
      count *= dimension;
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      std::optional<std::string> name;
      if (is_named) name = list.name + "." + fields[i];
      if (--*cells_ < 0 || !IsSoundElement(left, depth + 1, name)) return false;
    }
    return true;
  }

  /// Whether each part (real, imaginary) has as many numbers as the matrix states, of a numeric
  /// type.
  bool AreSoundNumbers(const Found& matrix, bool are_wanted, std::uint64_t* left) {
    std::uint64_t count = 1;
    for (const std::size_t dimension : matrix.dimensions) {
      if (dimension != 0 && count > *left / dimension) return false;
      count *= dimension;
    }
    if (count == 0) return true;
    for (int parts = matrix.is_complex ? 2 : 1; parts > 0; --parts) {
      const auto tag = TakePlainTag(left);
      const auto* const type =
          std::find_if(kNumberTypes.begin(), kNumberTypes.end(), [&](const auto& t) {
            return tag && t.type == tag->type;
          });
      if (type == kNumberTypes.end() || tag->size != count * type->size) return false;
      *left -= tag->stored();
      if (!(are_wanted ? ReadNumbers(*type, *tag) : Skip(tag->stored()))) return false;
    }
    return true;
  }

  /// The next `count` bytes; nullopt if there are fewer.
  std::optional<std::string> Take(std::size_t count) {
    std::string bytes(content_->Peek(count));
    if (!Skip(count)) return std::nullopt;
    return bytes;
  }
  bool Skip(std::uint64_t count) {
    if (count > content_->left()) return false;
    content_->Skip(count);
    return true;
  }

  std::vector<std::uint32_t> TakeWords(std::size_t count, std::uint64_t* left) {
    const std::size_t size = sizeof(std::uint32_t) * count;
    const std::optional<std::string> bytes = size > *left ? std::nullopt : Take(size);
    if (!bytes) return {};
    *left -= size;
    std::vector<std::uint32_t> words;
    for (std::size_t i = 0; i < count; ++i) {
      words.push_back(WordAt(*bytes, sizeof(std::uint32_t) * i, is_swapped_));
    }
    return words;
  }

  /// The tag of an element of numbers. It states the number of bytes that follow, padded to whole
  /// tags. Up to four bytes may be inside the tag; its upper half-word then states their number.
  struct PlainTag {
    std::uint32_t type = 0;
    std::uint64_t size = 0;
    std::optional<std::string> inside = {};
    std::uint64_t stored() const { return inside ? 0 : (size + kTag - 1) / kTag * kTag; }
  };
  std::optional<PlainTag> TakePlainTag(std::uint64_t* left) {
    const std::optional<std::string> bytes = kTag > *left ? std::nullopt : Take(kTag);
    if (!bytes) return std::nullopt;
    *left -= kTag;
    const std::uint32_t first = WordAt(*bytes, 0, is_swapped_);
    PlainTag tag{first, WordAt(*bytes, sizeof first, is_swapped_)};
    if (const std::uint32_t size = first >> 16U; size != 0) {
      tag = {first & 0xFFFFU, size, bytes->substr(sizeof first)};
    }
    if (tag.stored() > *left || (tag.inside && tag.size > tag.inside->size())) return std::nullopt;
    return tag;
  }

  std::optional<std::string> TakeText(std::uint64_t* left) {
    const auto tag = TakePlainTag(left);
    if (!tag || tag->size > kLongestText) return std::nullopt;
    *left -= tag->stored();
    const std::optional<std::string> text = tag->inside ? tag->inside : Take(tag->stored());
    if (!text) return std::nullopt;
    return text->substr(0, tag->size);
  }

  /// The integers of an element; empty if there are none, or more than a matrix has dimensions.
  std::vector<std::uint32_t> TakeNumbers(std::uint64_t* left) {
    constexpr std::size_t kMost = 32;  // NumPy's limit; MATLAB states no limit.
    const auto tag = TakePlainTag(left);
    if (!tag) return {};
    if (tag->inside) return {WordAt(*tag->inside, 0, is_swapped_)};
    const std::size_t count = tag->size / sizeof(std::uint32_t);
    if (count == 0 || count > kMost) return {};
    std::vector<std::uint32_t> words = TakeWords(tag->stored() / sizeof(std::uint32_t), left);
    words.resize(std::min(count, words.size()));
    return words;
  }

  bool ReadNumbers(const NumberType& type, const PlainTag& tag) {
    for (std::uint64_t left = tag.size; left > 0;) {
      const std::size_t size = std::min<std::uint64_t>(left, kChunk);
      std::optional<std::string> bytes = tag.inside ? tag.inside : Take(size);
      if (!bytes) return false;
      for (std::size_t at = 0; at < size; at += type.size) {
        if (is_swapped_) std::reverse(bytes->data() + at, bytes->data() + at + type.size);
        numbers_.push_back(type.value(std::string_view(*bytes).substr(at)));
      }
      left -= size;
    }
    return Skip(tag.stored() - (tag.inside ? 0 : tag.size));
  }

  ByteStream* content_;
  bool is_swapped_;
  int* cells_;
  std::string wanted_;
  std::vector<Found> found_;
  std::vector<double> numbers_;
};

/// Whether a variable has more than 2 GB of numbers, beyond any recording of a sensor.
bool IsTooLarge(const Variable& variable) {
  constexpr std::size_t kMostElements = std::size_t{1} << 28U;  // 2 GiB of doubles.
  return variable.columns > 0 && variable.rows > kMostElements / variable.columns;
}

/// Reads the next element of a file and passes its Walk to `take`. `wanted`: as in Walk. False: the
/// element is not sound.
bool ReadElement(ByteStream* bytes,
                 bool is_swapped,
                 int* cells,
                 const std::string& wanted,
                 const std::function<void(Walk* walk)>& take) {
  const std::string_view tag = bytes->Peek(kTag);
  if (tag.size() < kTag) return false;
  const std::uint32_t type = WordAt(tag, 0, is_swapped);
  const std::uint64_t size = WordAt(tag, sizeof type, is_swapped);
  if (size > bytes->left() - kTag) return false;
  const std::uint64_t end = bytes->position() + kTag + size;
  std::unique_ptr<ByteStream> inflated;
  if (type == kCompressed && size <= ByteStream::kLookAhead - kTag)
    inflated = ByteStream::Of(Inflated(bytes->Peek(kTag + size).substr(kTag)));
  Walk walk(inflated ? inflated.get() : bytes, is_swapped, cells, wanted);
  if (!walk.IsSound()) return false;
  bytes->Skip(end - bytes->position());
  take(&walk);
  return true;
}

/// A file of version 5: one element for each variable, plain or compressed. Reading stops at an
/// unsound element.
VariableFile Open5(const std::string& path, ByteStream* bytes, bool is_swapped) {
  VariableFile file;
  bytes->Skip(kHeader5);
  int cells = kMostCells;
  while (!bytes->at_end()) {
    const auto read = [path, is_swapped, position = bytes->position()](
                          const Variable& variable) -> Result<Matrix> {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<ByteStream> again, ByteStream::Open(path));
      again->Skip(position);
      Matrix matrix{.rows = variable.rows, .columns = variable.columns, .values = {}};
      int most = kMostCells;
      if (IsTooLarge(variable)) return Damaged(path, variable.name);
      ReadElement(again.get(), is_swapped, &most, variable.name, [&](Walk* walk) {
        matrix.values = std::move(walk->numbers());
      });
      if (matrix.values.size() == matrix.rows * matrix.columns) return matrix;
      return Damaged(path, variable.name);
    };
    const bool is_sound = ReadElement(bytes, is_swapped, &cells, "", [&](Walk* walk) {
      for (const Found& found : walk->found()) Add(found, read, &file);
    });
    if (is_sound) continue;
    file.damage = cells >= 0 ? kIncomplete
                             : "has more than " + std::to_string(kMostCells) +
                                   " cells and elements of structs: variables from there on are "
                                   "not read; save the variables you need in another file";
    break;
  }
  return file;
}

// ------------------------------------------------------------------------------------ version 7.3

/// An open object of the HDF5 library.
class Handle {
 public:
  explicit Handle(hid_t id) : id_(id) {}
  ~Handle() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  hid_t operator*() const { return id_; }
  bool is_open() const { return id_ >= 0; }

 private:
  hid_t id_;
};

/// The class that MATLAB states as an attribute. If another program wrote the file, which states no
/// class, returns the type of the numbers.
std::uint32_t KindOf(hid_t object, hid_t type) {
  std::string word;
  if (H5Aexists(object, "MATLAB_class") > 0) {
    const Handle attribute(H5Aopen(object, "MATLAB_class", H5P_DEFAULT));
    const Handle text(H5Aget_type(*attribute));
    constexpr std::size_t kLongest = 64;  // "function_handle" has 15.
    const std::size_t size = H5Tget_size(*text);
    if (H5Tget_class(*text) != H5T_STRING || H5Tis_variable_str(*text) != 0 || size > kLongest ||
        H5Sget_simple_extent_npoints(*Handle(H5Aget_space(*attribute))) != 1) {
      return 0;
    }
    word.resize(size);
    if (H5Aread(*attribute, *text, word.data()) < 0) return 0;
    word = word.c_str();
    if (word == "logical") word = "uint8";
  } else {
    const std::size_t size = H5Tget_size(type);
    word = (H5Tget_sign(type) == H5T_SGN_NONE ? "uint" : "int") + std::to_string(8 * size);
    if (H5Tget_class(type) == H5T_FLOAT) word = size == sizeof(float) ? "single" : "double";
  }
  const auto* const found = std::find(kKinds.begin(), kKinds.end(), word);
  return found == kKinds.end() ? 0 : static_cast<std::uint32_t>(found - kKinds.begin());
}

/// The numbers of a dataset in a file of the given size.
Result<Matrix> Read73(const Handle& file,
                      const std::string& path,
                      std::uint64_t file_size,
                      const Variable& variable) {
  std::string place = variable.name;
  std::replace(place.begin(), place.end(), '.', '/');
  const Handle dataset(H5Dopen2(*file, place.c_str(), H5P_DEFAULT));
  // A number has at least one byte, and zlib compresses at most 1032 to 1.
  constexpr std::size_t kDensest = 1032;
  const std::size_t count = variable.rows * variable.columns;
  if (!dataset.is_open() || IsTooLarge(variable) || count / kDensest > file_size) {
    return Damaged(path, variable.name);
  }
  // The name with a dot may belong to another dataset, which is in a group.
  const auto held = H5Sget_simple_extent_npoints(*Handle(H5Dget_space(*dataset)));
  if (held < 0 || static_cast<std::size_t>(held) != count) return Damaged(path, variable.name);
  Matrix matrix{.rows = variable.rows, .columns = variable.columns, .values = {}};
  matrix.values.resize(count);
  if (H5Dread(*dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, matrix.values.data()) < 0)
    return Damaged(path, variable.name);
  return matrix;
}

/// Collects the contents of an HDF5 group in a file of version 7.3: a variable is a dataset, a
/// struct a group.
struct Group {
  const std::function<Result<Matrix>(const Variable& variable)>& read;
  VariableFile* file;
  std::string prefix = {};
  int depth = 0;

  /// False: the group is unreadable from some point on.
  bool Collect(hid_t group) {
    const auto take = [](hid_t in, const char* name, const auto* /*link*/, void* self) {
      return static_cast<herr_t>(static_cast<const Group*>(self)->Take(in, name) ? 0 : -1);
    };
    return H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, take, this) >= 0;
  }

  bool Take(hid_t group, const std::string& own_name) const {
    // A damaged file may contain cycles.
    constexpr std::size_t kMostVariables = 100'000;
    if (file->variables.size() + file->others.size() > kMostVariables) return false;
    if (own_name.starts_with('#')) return true;  // MATLAB's store of cell elements.
    const Handle object(H5Oopen(group, own_name.c_str(), H5P_DEFAULT));
    if (!object.is_open()) return PassOver();
    Found found{.name = prefix + own_name};
    if (H5Iget_type(*object) == H5I_GROUP) {
      found.kind = H5Aexists(*object, "MATLAB_sparse") > 0 ? kSparse : kStruct;
      Add(found, read, file);
      Group inner{read, file, found.name + ".", depth + 1};
      return found.kind == kSparse || depth >= kDeepest || inner.Collect(*object);
    }
    if (H5Iget_type(*object) != H5I_DATASET) return true;
    const Handle type(H5Dget_type(*object)), space(H5Dget_space(*object));
    std::array<hsize_t, H5S_MAX_RANK> extents{};
    const int rank = H5Sget_simple_extent_dims(*space, extents.data(), nullptr);
    if (rank < 0) return PassOver();
    // HDF5's order of dimensions is the reverse of MATLAB's.
    found.dimensions.assign(extents.rend() - rank, extents.rend());
    if (H5Aexists(*object, "MATLAB_empty") > 0) found.dimensions = {0, 0};
    const H5T_class_t stored = H5Tget_class(*type);
    found.is_complex = stored == H5T_COMPOUND;
    if (found.is_complex || stored == H5T_INTEGER || stored == H5T_FLOAT)
      found.kind = KindOf(*object, *type);
    Add(found, read, file);
    return true;
  }

  bool PassOver() const {
    file->damage = kIncomplete;
    return true;
  }
};

/// Nullopt: not an HDF5 file.
std::optional<VariableFile> Open73(const std::string& path, std::uint64_t size) {
  H5dont_atexit();                              // The library's state may be damaged.
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // The library prints nothing.
  const auto handle = std::make_shared<Handle>(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (!handle->is_open()) return std::nullopt;
  const std::function<Result<Matrix>(const Variable& variable)> read =
      [=](const Variable& variable) { return Read73(*handle, path, size, variable); };
  VariableFile file;
  if (!Group{read, &file}.Collect(**handle)) file.damage = kIncomplete;
  return file;
}

/// Real numeric matrices and vectors of a .mat file, including those in (nested) 1×1 structs.
/// Error: unreadable, or not a .mat file.
Result<VariableFile> Open(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  // The first bytes identify the version. Version 4 has no signature and cannot be verified.
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";
  constexpr std::size_t kUserBlock = 512;  // MATLAB's header before the HDF5 data.
  constexpr std::string_view kLittle("\0\1IM", 4);
  constexpr std::string_view kBig("\1\0MI", 4);
  const std::string_view beginning = bytes->Peek(kUserBlock + kHdf5.size());
  if (beginning.starts_with(kHdf5) ||
      (beginning.size() > kUserBlock && beginning.substr(kUserBlock) == kHdf5)) {
    if (std::optional<VariableFile> file = Open73(path, bytes->size())) return *std::move(file);
  } else if (beginning.size() >= kHeader5) {
    const std::string mark(beginning.substr(kHeader5 - 4, 4));
    if (mark == kLittle || mark == kBig) return Open5(path, bytes.get(), mark == kBig);
  }
  return Error(ErrorCode::kWrongFormat,
               {path},
               "is not a .mat file of version 5 or 7.3, or its header is damaged; in "
               "MATLAB, write one with save(…, '-v7')");
}

constexpr NamedFormat kFormat = {.name = "mat", .open = Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunNamedReadingsConverter(truetriad::convert::kFormat, argc, argv);
}

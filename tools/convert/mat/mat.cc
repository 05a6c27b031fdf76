// SPDX-License-Identifier: Apache-2.0
//
// MATLAB files (.mat) to a recording. docs/converting.md.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <matio.h>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/mat/mat_elements.h"

namespace truetriad::convert {
namespace {

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using OwnedVariable = std::unique_ptr<matvar_t, FreeVariable>;

constexpr int kDeepest = 8;                                   ///< Structs in structs.
constexpr std::size_t kMostElements = std::size_t{1} << 28U;  ///< Of one matrix: 2 GiB of doubles.

/// Empty for what is no array of numbers.
std::string ClassName(matio_classes type) {
  static const std::map<matio_classes, std::string> names = {{MAT_C_DOUBLE, "double"},
                                                             {MAT_C_SINGLE, "single"},
                                                             {MAT_C_INT8, "int8"},
                                                             {MAT_C_UINT8, "uint8"},
                                                             {MAT_C_INT16, "int16"},
                                                             {MAT_C_UINT16, "uint16"},
                                                             {MAT_C_INT32, "int32"},
                                                             {MAT_C_UINT32, "uint32"},
                                                             {MAT_C_INT64, "int64"},
                                                             {MAT_C_UINT64, "uint64"}};
  const auto found = names.find(type);
  return found == names.end() ? "" : found->second;
}

bool IsMatrix(const matvar_t& variable) {
  return !ClassName(variable.class_type).empty() && variable.isComplex == 0 && variable.rank == 2 &&
         variable.dims != nullptr && variable.dims[0] > 0 && variable.dims[1] > 0;
}

/// What is there where no matrix is.
std::string WhatElse(const matvar_t& variable) {
  if (variable.class_type == MAT_C_CHAR) return "text";
  if (variable.class_type == MAT_C_SPARSE) return "a sparse matrix";
  if (variable.class_type == MAT_C_STRUCT) return "a struct or an array of them; name a field";
  if (ClassName(variable.class_type).empty()) return "no array of numbers";
  if (variable.isComplex != 0) return "complex";
  if (variable.rank != 2) return "an array of " + std::to_string(variable.rank) + " dimensions";
  return "empty";
}

bool IsSingleStruct(const matvar_t& variable) {
  return variable.class_type == MAT_C_STRUCT && variable.rank == 2 && variable.dims != nullptr &&
         variable.dims[0] == 1 && variable.dims[1] == 1;
}

matvar_t* Field(const matvar_t& variable, unsigned index) {
  // The library takes a pointer to what it does not change.
  return Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&variable), index, 0);
}

/// Null where there is none: of a damaged file what has a name in its list may be no structure
/// where it is read.
const matvar_t* FieldNamed(const matvar_t& variable, const std::string& name) {
  if (!IsSingleStruct(variable) || variable.data == nullptr) return nullptr;
  const unsigned count = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
  char* const* const names = Mat_VarGetStructFieldnames(&variable);
  for (unsigned i = 0; names != nullptr && i < count; ++i) {
    if (names[i] != nullptr && name == names[i]) return Field(variable, i);
  }
  return nullptr;
}

template <typename T>
bool CopyIf(matio_types type,
            const matvar_t& variable,
            std::size_t count,
            std::vector<double>* to) {
  const T* const numbers = static_cast<const T*>(variable.data);
  if (variable.data_type == type) to->assign(numbers, numbers + count);
  return variable.data_type == type;
}

bool CopyNumbers(const matvar_t& of, std::size_t count, std::vector<double>* to) {
  if (of.data == nullptr || of.data_size <= 0 ||
      of.nbytes < count * static_cast<std::size_t>(of.data_size)) {
    return false;
  }
  return CopyIf<double>(MAT_T_DOUBLE, of, count, to) ||
         CopyIf<float>(MAT_T_SINGLE, of, count, to) ||
         CopyIf<std::int8_t>(MAT_T_INT8, of, count, to) ||
         CopyIf<std::uint8_t>(MAT_T_UINT8, of, count, to) ||
         CopyIf<std::int16_t>(MAT_T_INT16, of, count, to) ||
         CopyIf<std::uint16_t>(MAT_T_UINT16, of, count, to) ||
         CopyIf<std::int32_t>(MAT_T_INT32, of, count, to) ||
         CopyIf<std::uint32_t>(MAT_T_UINT32, of, count, to) ||
         CopyIf<std::int64_t>(MAT_T_INT64, of, count, to) ||
         CopyIf<std::uint64_t>(MAT_T_UINT64, of, count, to);
}

/// What the first bytes say; the library would also take a file for one of version 4, which has no
/// signature, and then believe its lengths.
enum class Version { kNone, k5, k73 };
Version VersionOf(ByteStream* file) {
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";
  constexpr std::size_t kUserBlock = 512;  // That of MATLAB, before HDF5.
  const std::string_view beginning = file->Peek(kUserBlock + kHdf5.size());
  if (beginning.starts_with(kHdf5)) return Version::k73;
  if (beginning.size() > kUserBlock && beginning.substr(kUserBlock) == kHdf5) return Version::k73;
  if (beginning.size() < kHeader5) return Version::kNone;
  const std::string_view mark = beginning.substr(kHeader5 - 4, 4);
  constexpr std::string_view kLittle("\0\1IM", 4);
  constexpr std::string_view kBig("\1\0MI", 4);
  return mark == kLittle || mark == kBig ? Version::k5 : Version::kNone;
}

/// A .mat file of version 5 (plain or compressed) or 7.3, through libmatio: real numeric matrices
/// and vectors, those in (nested) 1×1 structs included.
class MatFile : public VariableFile {
 public:
  /// Error: unreadable, or no .mat file.
  static Result<std::unique_ptr<VariableFile>> Open(const std::string& path);

  Result<Matrix> Read(const Variable& variable) override;

 private:
  struct CloseFile {
    void operator()(mat_t* file) const { Mat_Close(file); }
  };
  MatFile(std::string path, mat_t* file) : path_(std::move(path)), file_(file) {}
  void Collect(const matvar_t& variable, const std::string& name, int depth);
  bool IsPlausible(const matvar_t& variable, int depth) const;

  std::string path_;
  std::unique_ptr<mat_t, CloseFile> file_;
  std::size_t file_size_ = 0;
  bool is_hdf5_ = false;
};

Result<std::unique_ptr<VariableFile>> MatFile::Open(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  const Version version = VersionOf(bytes.get());
  mat_t* const handle =
      version == Version::kNone ? nullptr : Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  if (handle == nullptr) {
    return Error(ErrorCode::kWrongFormat,
                 {path},
                 "is not a .mat file of version 5 or 7.3, or its header is damaged; in "
                 "MATLAB, write one with save(…, '-v7')");
  }
  std::unique_ptr<MatFile> file(new MatFile(path, handle));
  file->file_size_ = bytes->size();
  file->is_hdf5_ = version == Version::k73;
  constexpr char kIncomplete[] =
      "is damaged: a variable is incomplete, and later ones may be missing";
  // A damaged file may go round in a circle.
  constexpr int kMostVariables = 100'000;
  int most = kMostVariables;
  if (version == Version::k5) {
    const bool is_swapped = bytes->Peek(kHeader5)[kHeader5 - 2] == 'M';
    const Elements5 elements = ElementsOf5(bytes.get(), is_swapped);
    most = std::min(most, elements.whole);
    if (elements.rest == Elements5::Rest::kDamaged) file->damage_ = kIncomplete;
    if (elements.rest == Elements5::Rest::kTooManyCells) {
      file->damage_ = "has more than " + std::to_string(kMostCells) +
                      " cells and elements of structs: variables from there on are not read; save "
                      "the variables you need in another file";
    }
  }
  int count = 0;
  for (; count < most; ++count) {
    const OwnedVariable variable(Mat_VarReadNextInfo(handle));
    if (!variable) break;
    if (variable->name != nullptr) file->Collect(*variable, variable->name, 0);
  }
  if (file->damage_.empty() && most < kMostVariables && count < most) file->damage_ = kIncomplete;
  return std::unique_ptr<VariableFile>(std::move(file));
}

void MatFile::Collect(const matvar_t& variable, const std::string& name, int depth) {
  if (IsMatrix(variable)) {
    variables_.push_back(
        {name, ClassName(variable.class_type), variable.dims[0], variable.dims[1]});
  } else if (IsSingleStruct(variable) && depth < kDeepest) {
    const unsigned count = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    char* const* const names = Mat_VarGetStructFieldnames(&variable);
    for (unsigned i = 0; names != nullptr && i < count; ++i) {
      const matvar_t* const field = Field(variable, i);
      if (field != nullptr && names[i] != nullptr) {
        Collect(*field, name + "." + names[i], depth + 1);
      }
    }
  }
  if (!IsMatrix(variable)) others_[name] = WhatElse(variable);
}

/// Whether so many elements can come out of a file of this size: each has a byte at least, and zlib
/// packs at most 1032 to 1.
bool MatFile::IsPlausible(const matvar_t& variable, int depth) const {
  constexpr std::size_t kDensest = 1032;  // Bytes from one, by zlib.
  std::size_t count = 1;
  for (int i = 0; i < variable.rank && variable.dims != nullptr; ++i) {
    if (variable.dims[i] != 0 && count > kMostElements / variable.dims[i]) return false;
    count *= variable.dims[i];
  }
  const std::size_t density =
      variable.compression == MAT_COMPRESSION_NONE && !is_hdf5_ ? 1 : kDensest;
  if (count / density > file_size_) return false;
  if (!IsSingleStruct(variable)) return variable.class_type != MAT_C_STRUCT || count <= kDensest;
  if (depth >= kDeepest) return false;
  const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
  for (unsigned i = 0; i < fields; ++i) {
    const matvar_t* const field = Field(variable, i);
    if (field != nullptr && !IsPlausible(*field, depth + 1)) return false;
  }
  return true;
}

Result<Matrix> MatFile::Read(const Variable& wanted) {
  const Error damaged = Error(ErrorCode::kDamagedFile,
                              {path_},
                              "variable " + wanted.name + " is incomplete or inconsistent");
  const std::size_t dot = wanted.name.find('.');
  const std::string top = wanted.name.substr(0, dot);
  const OwnedVariable variable(Mat_VarReadInfo(file_.get(), top.c_str()));
  if (!variable || !IsPlausible(*variable, 0)) return damaged;
  if (Mat_VarReadDataAll(file_.get(), variable.get()) != 0) return damaged;
  const matvar_t* at = variable.get();
  for (std::size_t begin = dot; begin != std::string::npos;) {
    const std::size_t end = wanted.name.find('.', begin + 1);
    const std::string field = wanted.name.substr(begin + 1, end - begin - 1);
    at = FieldNamed(*at, field);
    if (at == nullptr) return damaged;
    begin = end;
  }
  if (!IsMatrix(*at)) return damaged;
  Matrix matrix{.rows = at->dims[0], .columns = at->dims[1], .values = {}};
  if (matrix.rows != wanted.rows || matrix.columns != wanted.columns ||
      !CopyNumbers(*at, matrix.rows * matrix.columns, &matrix.values)) {
    return damaged;
  }
  return matrix;
}

constexpr NamedFormat kFormat = {
    .name = "mat", .input = "MATLAB files (.mat of version 5, 7 or 7.3)", .open = MatFile::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunNamedReadingsConverter(truetriad::convert::kFormat, argc, argv);
}

// SPDX-License-Identifier: Apache-2.0
// The module truetriad_matlab: MATLAB's .mat through libmatio.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <system_error>

#include <matio.h>
#include <unistd.h>

#include "formats/matlab_values.h"

namespace truetriad {
namespace {

/// A temporary file, since libmatio works only on files. The destructor removes it.
class TemporaryFile {
 public:
  TemporaryFile() {
    std::error_code ignored;
    path_ = (std::filesystem::temp_directory_path(ignored) / "truetriad_XXXXXX").string();
    const int descriptor = ::mkstemp(path_.data());
    usable_ = descriptor >= 0;
    if (usable_) ::close(descriptor);
  }
  ~TemporaryFile() {
    if (usable_) std::remove(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool usable() const { return usable_; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool usable_ = false;
};

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using VariableOwner = std::unique_ptr<matvar_t, FreeVariable>;

/// Copies the data into libmatio's variable. libmatio's types ask for mutable data, but it only
/// copies them.
VariableOwner Create(const std::string& name, const MatlabVariable& variable) {
  if (variable.numbers.size() == 0) {
    std::array<std::size_t, 2> size = {1, variable.text.size()};
    return VariableOwner(Mat_VarCreate(name.c_str(),
                                       MAT_C_CHAR,
                                       MAT_T_UTF8,
                                       2,
                                       size.data(),
                                       const_cast<char*>(variable.text.data()),
                                       0));
  }
  std::array<std::size_t, 2> size = {static_cast<std::size_t>(variable.numbers.rows()),
                                     static_cast<std::size_t>(variable.numbers.cols())};
  return VariableOwner(Mat_VarCreate(name.c_str(),
                                     MAT_C_DOUBLE,
                                     MAT_T_DOUBLE,
                                     2,
                                     size.data(),
                                     const_cast<double*>(variable.numbers.data()),
                                     0));
}

/// The content of a variable that is not a struct. It has neither numbers nor text if the variable
/// is of an unsupported type.
MatlabVariable Taken(const std::string& name, const matvar_t& variable) {
  MatlabVariable taken{name, {}, {}};
  if (variable.rank != 2 || variable.data == nullptr || variable.isComplex != 0) return taken;
  const auto rows = static_cast<Eigen::Index>(variable.dims[0]);
  const auto cols = static_cast<Eigen::Index>(variable.dims[1]);
  if (variable.class_type == MAT_C_DOUBLE && variable.data_type == MAT_T_DOUBLE) {
    taken.numbers =
        Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(variable.data), rows, cols);
  } else if (variable.class_type == MAT_C_SINGLE && variable.data_type == MAT_T_SINGLE) {
    taken.numbers =
        Eigen::Map<const Eigen::MatrixXf>(static_cast<const float*>(variable.data), rows, cols)
            .cast<double>();
  } else if (variable.class_type == MAT_C_CHAR && variable.data_size == 1) {
    taken.text.assign(static_cast<const char*>(variable.data), variable.nbytes);
  } else if (variable.class_type == MAT_C_CHAR && variable.data_size == 2) {
    const auto* const units = static_cast<const std::uint16_t*>(variable.data);
    for (std::size_t i = 0; i < variable.nbytes / 2; ++i) {
      taken.text += static_cast<char>(units[i] < 0x80 ? units[i] : '?');
    }
  }
  return taken;
}

void TakeStruct(matvar_t* variable, MatlabVariables* variables) {
  const unsigned count = Mat_VarGetNumberOfFields(variable);
  char* const* const names = Mat_VarGetStructFieldnames(variable);
  for (unsigned i = 0; i < count; ++i) {
    const matvar_t* const field = Mat_VarGetStructFieldByIndex(variable, i, 0);
    if (field != nullptr) {
      variables->push_back(Taken(std::string(variable->name) + "." + names[i], *field));
    }
  }
}

Result<std::string> Write(const MatlabVariables& variables,
                          const std::vector<std::string>& comment) {
  const Error failed = Error(ErrorCode::kCannotWrite,
                             "cannot create the .mat file in the folder for temporary files");
  const TemporaryFile temporary;
  if (!temporary.usable()) return failed;
  {
    // Replaces libmatio's own header line, whose time would make the bytes differ from run to run.
    const std::string line = "MATLAB 5.0 MAT-file, " + (comment.empty() ? "" : comment[0]);
    const std::unique_ptr<mat_t, CloseFile> file(
        Mat_CreateVer(temporary.path().c_str(), line.substr(0, 115).c_str(), MAT_FT_MAT5));
    if (!file) return failed;
    std::map<std::string, VariableOwner> structs;
    std::vector<std::string> order;
    for (const MatlabVariable& variable : variables) {
      const std::size_t dot = variable.name.find('.');
      if (dot == std::string::npos) {
        const VariableOwner single = Create(variable.name, variable);
        if (!single || Mat_VarWrite(file.get(), single.get(), MAT_COMPRESSION_NONE) != 0)
          return failed;
        continue;
      }
      const std::string owner = variable.name.substr(0, dot);
      if (!structs.contains(owner)) {
        std::array<std::size_t, 2> one = {1, 1};
        structs[owner].reset(Mat_VarCreateStruct(owner.c_str(), 2, one.data(), nullptr, 0));
        order.push_back(owner);
      }
      matvar_t* const whole = structs[owner].get();
      const std::string field = variable.name.substr(dot + 1);
      if (whole == nullptr || Mat_VarAddStructField(whole, field.c_str()) != 0) return failed;
      Mat_VarSetStructFieldByName(whole, field.c_str(), 0, Create(field, variable).release());
    }
    for (const std::string& name : order) {
      if (Mat_VarWrite(file.get(), structs[name].get(), MAT_COMPRESSION_NONE) != 0) return failed;
    }
  }
  std::ostringstream bytes;
  bytes << std::ifstream(temporary.path(), std::ios::binary).rdbuf();
  return bytes.str();
}

Result<MatlabVariables> Parse(const std::string& bytes, const std::string& name) {
  const TemporaryFile temporary;
  if (!temporary.usable())
    return Error(
        ErrorCode::kCannotWrite, {name}, "cannot create a file in the folder for temporary files");
  std::ofstream(temporary.path(), std::ios::binary) << bytes;
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(temporary.path().c_str(), MAT_ACC_RDONLY));
  if (!file)
    return Error(ErrorCode::kWrongFormat, {name}, "is not a .mat file that libmatio can read");
  MatlabVariables variables;
  while (const VariableOwner variable{Mat_VarReadNext(file.get())}) {
    if (variable->name == nullptr) continue;
    if (variable->class_type == MAT_C_STRUCT) {
      TakeStruct(variable.get(), &variables);
    } else {
      variables.push_back(Taken(variable->name, *variable));
    }
  }
  return variables;
}

}  // namespace

}  // namespace truetriad

extern "C" const truetriad::MatlabModule* TruetriadMatlabModule() {
  static constexpr truetriad::MatlabModule kModule = {truetriad::Write, truetriad::Parse};
  return &kModule;
}

// SPDX-License-Identifier: Apache-2.0
//
// Writes a .mat file with known content, for the tests of truetriad-convert-mat:
//
//   make_mat 5|5z|7.3 FILE ROWS
//
// `imu`, a struct of acc (ROWS x 3, m/s^2) and gyr (3 x ROWS, single, rad/s); `mag` (ROWS x 3
// int16, counts, in `data`, columns 2 to 4), `t` (ROWS x 1, s). Row i: acc = (i, -i, i + 0.5), gyr
// = (0.25 i, i, -i), data = (7, i, i + 1, i + 2), t = 0.01 i.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <matio.h>

namespace {

template <typename T>
matvar_t* Matrix(const char* name,
                 matio_classes type,
                 matio_types storage,
                 std::size_t rows,
                 std::size_t columns,
                 std::vector<T>* values) {
  std::size_t size[2] = {rows, columns};
  return Mat_VarCreate(name, type, storage, 2, size, values->data(), 0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 1;
  const std::string version = argv[1];
  const auto rows = static_cast<std::size_t>(std::atol(argv[3]));
  mat_t* const file =
      Mat_CreateVer(argv[2], nullptr, version == "7.3" ? MAT_FT_MAT73 : MAT_FT_MAT5);
  if (file == nullptr) return 2;
  const matio_compression packing = version == "5" ? MAT_COMPRESSION_NONE : MAT_COMPRESSION_ZLIB;
  std::vector<double> acc(3 * rows), t(rows);
  std::vector<float> gyr(3 * rows);
  std::vector<std::int16_t> data(4 * rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const double x = static_cast<double>(i);
    t[i] = 0.01 * x;
    acc[i] = x;
    acc[rows + i] = -x;
    acc[2 * rows + i] = x + 0.5;
    gyr[3 * i] = static_cast<float>(0.25 * x);
    gyr[3 * i + 1] = static_cast<float>(x);
    gyr[3 * i + 2] = static_cast<float>(-x);
    data[i] = 7;
    for (std::size_t k = 1; k < 4; ++k) {
      data[k * rows + i] = static_cast<std::int16_t>(i + k - 1);
    }
  }
  const char* names[] = {"acc", "gyr"};
  std::size_t one[2] = {1, 1};
  matvar_t* const imu = Mat_VarCreateStruct("imu", 2, one, names, 2);
  Mat_VarSetStructFieldByName(
      imu, "acc", 0, Matrix("acc", MAT_C_DOUBLE, MAT_T_DOUBLE, rows, 3, &acc));
  Mat_VarSetStructFieldByName(
      imu, "gyr", 0, Matrix("gyr", MAT_C_SINGLE, MAT_T_SINGLE, 3, rows, &gyr));
  matvar_t* const table = Matrix("data", MAT_C_INT16, MAT_T_INT16, rows, 4, &data);
  matvar_t* const time = Matrix("t", MAT_C_DOUBLE, MAT_T_DOUBLE, rows, 1, &t);
  int failures = 0;
  for (matvar_t* const variable : {time, imu, table}) {
    failures += Mat_VarWrite(file, variable, packing) == 0 ? 0 : 1;
    Mat_VarFree(variable);
  }
  Mat_Close(file);
  return failures == 0 ? 0 : 2;
}

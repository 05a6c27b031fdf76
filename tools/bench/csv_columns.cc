// SPDX-License-Identifier: Apache-2.0
// How fast a text recording becomes typed columns. For comparison, a bare std::from_chars loop over
// the same bytes in memory is measured in turns:
//
//   csv_columns FILE [RUNS]
//
// Reads all columns of FILE with all checks and the SHA-256 of the bytes: the first column as an
// integer of nanoseconds, the others as doubles. Then hashes the bytes alone, to show the share of
// hashing. Prints GB per CPU second for each run, and the medians.
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "io/csv_reader.h"
#include "io/text_file.h"

namespace {

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double sum = 0.0;  // Printed, so that nothing can be optimised away.

bool ReadColumns(const std::string& path) {
  auto csv = truetriad::CsvReader::Open(path, {});
  if (!csv) {
    std::fprintf(stderr, "%s\n", csv.error().message.c_str());
    return false;
  }
  truetriad::CsvReader& reader = **csv;
  using Kind = truetriad::CsvReader::Kind;
  for (std::size_t column = 0; column < reader.column_count(); ++column) {
    if (!reader.Map(column, column == 0 ? Kind::kTime : Kind::kNumber, 9)) return false;
  }
  for (;;) {
    const auto rows = reader.Read();
    if (!rows) {
      std::fprintf(stderr, "%s\n", rows.error().message.c_str());
      return false;
    }
    if (*rows == 0) return true;
    for (std::size_t column = 1; column < reader.column_count(); ++column) {
      sum += reader.Numbers(column)[*rows - 1];
    }
  }
}

void ConvertNumbers(const std::string& text) {
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    double number = 0.0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error == std::errc()) sum += number;
    at = next > at ? next : at + 1;
  }
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: csv_columns FILE [RUNS]\n");
    return 1;
  }
  const std::string path = argv[1];
  const int runs = argc > 2 ? std::atoi(argv[2]) : 9;
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const double gigabytes = static_cast<double>(text.size()) * 1e-9;
  std::vector<double> columns, bare, hash;
  for (int run = 0; run < std::max(runs, 1); ++run) {
    double begin = CpuSeconds();
    if (!ReadColumns(path)) return 2;
    columns.push_back(gigabytes / (CpuSeconds() - begin));
    begin = CpuSeconds();
    ConvertNumbers(text);
    bare.push_back(gigabytes / (CpuSeconds() - begin));
    begin = CpuSeconds();
    sum += truetriad::Sha256Hex(text)[0];
    hash.push_back(gigabytes / (CpuSeconds() - begin));
    std::printf("columns %.3f GB/s, from_chars %.3f GB/s, hash %.3f GB/s\n",
                columns.back(),
                bare.back(),
                hash.back());
  }
  const double without_hash = 1.0 / (1.0 / Median(columns) - 1.0 / Median(hash));
  std::printf(
      "median of %d: columns %.3f GB/s (%.3f without the hash), from_chars %.3f GB/s, hash %.3f "
      "GB/s (sum %.17g)\n",
      runs,
      Median(columns),
      without_hash,
      Median(bare),
      Median(hash),
      sum);
}

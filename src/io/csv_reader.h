// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/held_samples.h"
#include "io/text_file.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// The layout of a text table. Properties that are not stated are determined from the first lines
/// of the table.
struct CsvLayout {
  /// kAuto: the first line is a header if it holds no number; a line of column numbers, 0,1,2,…, is
  /// skipped.
  enum class Header { kAuto, kPresent, kAbsent };

  char separator = '\0';        ///< ',' ';' '\t', or ' ' for runs of blanks; 0: not stated.
  std::int64_t skip_lines = 0;  ///< Number of lines of a preamble. Range: >= 0.
  Header header = Header::kAuto;
  bool ragged = false;  ///< Rows may have fewer fields (read as empty) or more (ignored).

  bool operator==(const CsvLayout&) const = default;
};

/// A text table (CSV, TSV, blank-separated), streamed into typed column buffers.
///
/// Only mapped columns are parsed, into buffers that are reused for each block; other columns may
/// hold anything. Lines that begin with '#', empty lines and repeated headers are skipped.
class CsvReader {
 public:
  enum class Kind : std::uint8_t {
    kSkip,
    kNumber,  ///< A double; NaN if the field is empty or `nan`.
    kTime,    ///< The number * 10^power, rounded; kMissingTime if the field is empty or `nan`.
    kText,    ///< The characters, without surrounding blanks.
  };
  /// Outside of ±kFarthestTime, so that no time has this value.
  static constexpr std::int64_t kMissingTime = std::numeric_limits<std::int64_t>::min();
  /// Largest time, 2^62 - 1 ns = 146 years: the difference of two such times fits an int64, too.
  static constexpr std::int64_t kFarthestTime = (std::int64_t{1} << 62U) - 1;

  /// Opens the file and reads its header. Error: as TextFile::Open, or there are no data rows.
  static Result<std::unique_ptr<CsvReader>> Open(const std::string& path, const CsvLayout& layout);

  /// As Open with a default layout, but reads the file in small parts. For most files, one part
  /// contains the whole header.
  static Result<std::unique_ptr<CsvReader>> OpenHead(const std::string& path);

  const std::string& path() const { return file_->path(); }
  const CsvLayout& layout() const { return layout_; }  ///< With the separator that was found.
  const std::vector<std::string>& header() const { return header_; }  ///< Empty if none.
  std::int64_t header_line() const { return header_line_; }
  /// Number of columns at the end that have neither a name nor a value.
  std::size_t empty_at_end() const { return empty_at_end_; }
  /// True if each row begins with a row number that the header does not name. header() then begins
  /// with an empty name.
  bool has_unnamed_count() const { return has_unnamed_count_; }
  /// True if the first column has no name and its first numbers may be row numbers, as in a table
  /// of pandas.
  bool may_begin_with_row_numbers() const { return may_begin_with_row_numbers_; }
  std::size_t column_count() const { return columns_.size(); }
  /// Names a column in messages: "column `ax`" or, without a header, "column 3 (counted from 0)".
  std::string ColumnName(std::size_t column) const;
  /// The columns that the header calls `name`. If there are none and `name` is a number, the column
  /// with this number, from 0.
  std::vector<std::size_t> ColumnsCalled(const std::string& name) const;

  /// Selects a column to be read as `kind`. Error: the column is already mapped as something else.
  Status Map(std::size_t column, Kind kind, int power = 0);

  /// Reads the next rows and returns their number: at most kBlockSamples, 0 at the end. Error, with
  /// file:line: a field is not a finite number, or a row has the wrong number of fields.
  Result<std::size_t> Read();

  /// Values of the block that Read filled; valid until the next Read.
  const double* Numbers(std::size_t column) const { return columns_[column].numbers.data(); }
  const std::int64_t* Times(std::size_t column) const { return columns_[column].times.data(); }
  const std::string_view* Texts(std::size_t column) const { return columns_[column].texts.data(); }
  /// True when a number or time of the block is missing.
  bool AnyMissing(std::size_t column) const { return columns_[column].any_missing; }
  const std::int64_t* Rows() const { return rows_.data(); }  ///< Numbers of the rows, from 0.
  std::int64_t Line(std::size_t row_in_block) const { return lines_[row_in_block]; }
  std::int64_t rows_read() const { return rows_read_; }

  double progress() const { return file_->progress(); }
  std::string Sha256() const { return file_->Sha256(); }

 private:
  struct Column {
    Kind kind = Kind::kSkip;
    int power = 0;
    bool any_missing = false;
    std::vector<double> numbers;
    std::vector<std::int64_t> times;
    std::vector<std::string_view> texts;
  };

  CsvReader(std::unique_ptr<TextFile> file, const CsvLayout& layout);
  Status ReadHeader();
  void NameColumns(std::string_view header, const std::vector<std::string_view>& rows);
  template <bool kBlanks>
  Result<std::size_t> ReadRows();
  /// Parses the number or time at `p` into row `row`; returns its end, or null for anything else.
  const char* ParseValue(const char* p, Column* column, std::size_t row);
  /// Like ParseValue, but for a value between quotation marks. If nothing is between them, the
  /// value is missing.
  const char* ParseQuoted(const char* p, Column* column, std::size_t row);
  static void SetMissing(Column* column, std::size_t row);
  Error FieldError(const char* line_begin, std::size_t column) const;
  Error FieldCountError(const char* line_begin) const;
  Error CutOffError() const;
  /// True for a repeated header line.
  bool IsHeader(const char* line_begin) const;
  /// Whether `line` is the last line of the file and has no '\n'. If such a line is malformed, it
  /// was only half written.
  bool IsCutOff(std::string_view line) const;
  Error Fail(ErrorCode code, int column, const std::string& message) const;  ///< Error at line_.

  std::unique_ptr<TextFile> file_;
  CsvLayout layout_;
  std::vector<std::string> header_;
  std::int64_t header_line_ = 0;
  bool has_unnamed_count_ = false;
  std::size_t empty_at_end_ = 0;
  bool may_begin_with_row_numbers_ = false;
  std::vector<Column> columns_;
  std::vector<std::int64_t> rows_;
  std::vector<std::int64_t> lines_;
  const char* cursor_ = nullptr;     ///< The next line of the chunk.
  const char* chunk_end_ = nullptr;  ///< After the chunk's last '\n'.
  std::int64_t line_ = 0;            ///< Lines begun so far.
  std::int64_t rows_read_ = 0;
};

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
#include "io/csv_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "data/impossible_rows.h"
#include "io/decimal.h"
#include "io/recording_layout.h"

namespace truetriad {
namespace {

/// Logs have fewer columns; a transposed table, with one column per time, has more.
constexpr std::size_t kMostColumns = 4000;

constexpr char kBlankRuns = ' ';

bool IsBlank(char c, char separator) { return c == ' ' || (c == '\t' && separator != '\t'); }

bool IsLineEnd(const char* p) { return *p == '\n' || (*p == '\r' && p[1] == '\n'); }

/// The '\n' that ends the line at `p`; it must exist before `end`.
const char* LineEnd(const char* p, const char* end) {
  return static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p)));
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

/// The end of the field that begins with a quotation mark at `p`: the place after the closing mark;
/// a doubled mark does not close (RFC 4180). If the line has no closing mark, `p` itself.
const char* QuotedEnd(const char* p) {
  for (const char* end = p + 1; *end != '\n'; ++end) {
    if (*end != '"') continue;
    if (end[1] != '"') return end + 1;
    ++end;
  }
  return p;
}

/// The line at `begin`, without its '\n', which must exist before `end`.
std::string_view LineAt(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(LineEnd(begin, end) - begin)};
}

/// `field` without quotation marks around it.
std::string_view Unquoted(std::string_view field) {
  const bool is_quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return is_quoted ? Trimmed(field.substr(1, field.size() - 2)) : field;
}

/// The end of the first field of a line: the first separator outside of quotation marks, or npos.
/// If a quotation mark is not closed, marks are ignored.
std::size_t FieldEnd(std::string_view line, char separator) {
  bool is_quoted = false;
  const std::size_t begin = line.find_first_not_of(" \t");
  const bool may_be = begin != std::string_view::npos && line[begin] == '"';
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (may_be && line[i] == '"') is_quoted = !is_quoted;
    if (line[i] == separator && !is_quoted) return i;
  }
  return is_quoted ? line.find(separator) : std::string_view::npos;
}

/// The fields of a line, without surrounding blanks and quotation marks.
std::vector<std::string_view> SplitFields(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  if (separator == kBlankRuns) {
    constexpr std::string_view kBlanks = " \t\r";
    for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
      const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
      fields.push_back(Unquoted(line.substr(begin, end - begin)));
      begin = line.find_first_not_of(kBlanks, end);
    }
    return fields;
  }
  for (;;) {
    const std::size_t end = FieldEnd(line, separator);
    fields.push_back(Unquoted(Trimmed(line.substr(0, end))));
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

bool EqualsIgnoringCase(std::string_view text, std::string_view lower_case) {
  return std::equal(
      text.begin(), text.end(), lower_case.begin(), lower_case.end(), [](char a, char b) {
        return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
      });
}

bool IsNumber(std::string_view field) {
  if (EqualsIgnoringCase(field, "nan")) return true;
  const std::string terminated = std::string(field) + '\n';
  Decimal decimal;
  return ScanDecimal(terminated.c_str(), &decimal) && *decimal.end == '\n';
}

char FindSeparator(std::string_view line) {
  const std::string_view content = Trimmed(line);
  for (const char separator : {';', ','}) {
    if (content.find(separator) != std::string_view::npos) return separator;
  }
  if (content.find('\t') == std::string_view::npos) return kBlankRuns;
  // If splitting at all blanks gives more fields than splitting at tabs, and all are numbers, runs
  // of blanks are the separator.
  const std::vector<std::string_view> words = SplitFields(content, kBlankRuns);
  return words.size() > SplitFields(content, '\t').size() &&
                 std::all_of(words.begin(), words.end(), IsNumber)
             ? kBlankRuns
             : '\t';
}

/// The separator that a line such as `sep=;` states, which spreadsheets write as the first line; 0
/// for other lines.
char SeparatorStated(std::string_view line) {
  line = Unquoted(Trimmed(line));
  if (EqualsIgnoringCase(line, "sep=")) return '\t';  // Trimmed removed the tab.
  if (line.size() != 5 || !EqualsIgnoringCase(line.substr(0, 4), "sep=")) return '\0';
  return line.back() == ';' || line.back() == ',' || line.back() == '\t' ? line.back() : '\0';
}

/// Whether a line names columns: no field is a number. A line of data has at least one number.
bool LooksLikeHeader(const std::vector<std::string_view>& fields) {
  return std::none_of(fields.begin(), fields.end(), IsNumber) &&
         std::any_of(fields.begin(), fields.end(), [](std::string_view f) { return !f.empty(); });
}

struct TableLine {
  std::string_view text;
  std::int64_t number = 0;  ///< Line number in the file, from 1; 0: no line.
};

std::vector<std::string_view> FieldsOf(const TableLine& line) {
  return SplitFields(line.text, FindSeparator(line.text));
}

/// Finds a header that was written as a comment, as some programs do: the last comment with as many
/// names as `data` has columns; null if there is none.
const TableLine* CommentedHeader(const std::vector<TableLine>& comments, const TableLine& data) {
  const std::size_t columns = FieldsOf(data).size();
  const auto found =
      std::find_if(comments.rbegin(), comments.rend(), [&](const TableLine& comment) {
        const std::vector<std::string_view> names = FieldsOf(comment);
        return names.size() > 1 && names.size() == columns && LooksLikeHeader(names);
      });
  return found == comments.rend() ? nullptr : &*found;
}

/// Whether the fields are the column numbers 0, 1, 2, … in place of names. A column of row numbers
/// before them has an empty name.
bool CountsColumns(std::vector<std::string_view> fields) {
  constexpr std::size_t kFewestColumns = 4;  // A row 0, 1, 2 may be a reading.
  if (!fields.empty() && fields.front().empty()) fields.erase(fields.begin());
  if (fields.size() < kFewestColumns) return false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i] != std::to_string(i)) return false;
  }
  return true;
}

/// Whether the first field of each row is a row number: whole numbers that increase, at least half
/// of the steps by one (rows may have been removed). Times in whole numbers have other steps or are
/// larger.
bool NumberTheirRows(const std::vector<std::string_view>& rows, char separator) {
  constexpr std::int64_t kMostRows = 100'000'000;  // 28 h at 1 kHz; larger numbers are times.
  std::int64_t before = 0;
  std::size_t steps = 0, ones = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string_view field = SplitFields(rows[i], separator)[0];
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
    const bool is_whole = error == std::errc() && end == field.data() + field.size();
    if (!is_whole || number < 0 || number > kMostRows) return false;
    if (i > 0 && number <= before) return false;
    steps += i > 0 ? 1 : 0;
    ones += i > 0 && number == before + 1 ? 1 : 0;
    before = number;
  }
  return 2 * ones >= steps;
}

/// Whether the rows of a table begin with row numbers that the header `names` does not name, as
/// pandas and R write them. If the header lacks the last name instead, the first column is a
/// reading or a time, which does not count from 0 or 1.
bool LeavesOutRowNumbers(const std::vector<std::string_view>& names,
                         const std::vector<std::string_view>& rows,
                         char separator) {
  constexpr std::size_t kFewest = 2;  // A single row cannot show that rows are counted.
  if (rows.size() < kFewest || names.empty() ||
      SeeminglyCalled(ParseHeaderColumn(std::string(names[0])).name).empty())
    return false;
  for (const std::string_view row : rows) {
    const std::vector<std::string_view> fields = SplitFields(row, separator);
    if (fields.size() != names.size() + 1 || fields.back().empty()) return false;
  }
  const std::string_view first = SplitFields(rows[0], separator)[0];
  return (first == "0" || first == "1") && NumberTheirRows(rows, separator);
}

/// The first 40 bytes of `text` in backticks, with control characters in the form \x1b.
std::string ShownField(std::string_view text) {
  constexpr std::size_t kShownOfField = 40;  // Enough to find the field in its row.
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string quoted = "`";
  for (const char c : text.substr(0, kShownOfField)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      quoted += {'\\', 'x', kHex[byte >> 4U], kHex[byte & 15U]};
    } else {
      quoted += c;
    }
  }
  return quoted + (text.size() > kShownOfField ? "…`" : "`");
}

}  // namespace

Result<std::unique_ptr<CsvReader>> CsvReader::OpenHead(const std::string& path) {
  constexpr std::size_t kHeadBytes = 16U << 10;  // Most headers fit; for others Open reads more.
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<TextFile> file, TextFile::Open(path, kHeadBytes));
  std::unique_ptr<CsvReader> reader(new CsvReader(std::move(file), {}));
  if (!reader->ReadHeader()) return Open(path, {});  // The header may be after this part.
  return reader;
}

Result<std::unique_ptr<CsvReader>> CsvReader::Open(const std::string& path,
                                                   const CsvLayout& layout) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<TextFile> file, TextFile::Open(path));
  std::unique_ptr<CsvReader> reader(new CsvReader(std::move(file), layout));
  TRUETRIAD_RETURN_IF_ERROR(reader->ReadHeader());
  return reader;
}

CsvReader::CsvReader(std::unique_ptr<TextFile> file, const CsvLayout& layout)
    : file_(std::move(file)),
      layout_(layout),
      // A small file needs fewer rows: a row has at least one byte, its line end.
      rows_(std::min(kBlockSamples - 1, file_->MostBytes()) + 1),
      lines_(rows_.size()) {}

Status CsvReader::ReadHeader() {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string_view chunk, file_->Next());
  const char* next = chunk.data();
  chunk_end_ = next + chunk.size();
  std::int64_t number = 0;
  // The first non-empty lines, from which the layout is determined, and the comments before them.
  constexpr std::size_t kLines = 32;
  std::vector<TableLine> lines, comments;
  while (lines.size() < kLines && next != chunk_end_) {
    const TableLine line = {LineAt(next, chunk_end_), ++number};
    next += line.text.size() + 1;
    const std::string_view content = Trimmed(line.text);
    if (number <= layout_.skip_lines || content.empty()) continue;
    if (const char stated = lines.empty() ? SeparatorStated(content) : '\0'; stated != '\0') {
      if (layout_.separator == '\0') layout_.separator = stated;
    } else if (content[0] != '#') {
      lines.push_back(line);
    } else if (lines.empty()) {
      comments.push_back({Trimmed(content.substr(1)), number});
    }
  }
  TableLine header;
  if (layout_.header != CsvLayout::Header::kAbsent) {
    const bool must_be = layout_.header == CsvLayout::Header::kPresent;
    const bool looks_like_header = !lines.empty() && LooksLikeHeader(FieldsOf(lines[0]));
    if (const TableLine* commented = lines.empty() ? nullptr : CommentedHeader(comments, lines[0]);
        !looks_like_header && commented != nullptr) {
      header = *commented;
    } else if (!looks_like_header && must_be && !comments.empty()) {
      header = comments.back();
    } else if (looks_like_header || (must_be && !lines.empty())) {
      header = lines[0];
      lines.erase(lines.begin());
    }
  }
  const bool may_count = layout_.header == CsvLayout::Header::kAuto && header.number == 0;
  if (may_count && lines.size() >= 2 && CountsColumns(FieldsOf(lines[0]))) {
    lines.erase(lines.begin());
  }
  if (lines.empty()) {
    return Error(
        ErrorCode::kNoReadings,
        path() +
            (header.number > 0 ? ": has a header but no rows of numbers"
                               : ": has no rows of numbers") +
            " in its first lines; check for an empty log or a `skip_lines` that is too large");
  }
  const TableLine& data = lines[0];
  if (layout_.separator == '\0') layout_.separator = FindSeparator(data.text);
  std::vector<std::string_view> rows;
  for (const TableLine& line : lines) rows.push_back(line.text);
  if (header.number > 0) NameColumns(header.text, rows);
  header_line_ = header.number;
  columns_.resize(header_.empty() ? SplitFields(data.text, layout_.separator).size()
                                  : header_.size());
  if (columns_.size() > kMostColumns) {
    return Error(ErrorCode::kWrongFormat,
                 path() + ": has " + std::to_string(columns_.size()) +
                     " columns; expected one column per quantity and one row per time: is the "
                     "table transposed?");
  }
  cursor_ = data.text.data();
  line_ = data.number - 1;
  return {};
}

void CsvReader::NameColumns(std::string_view header, const std::vector<std::string_view>& rows) {
  // Some headers have commas between names, although the rows have blanks between numbers.
  const std::size_t fields = SplitFields(rows[0], layout_.separator).size();
  std::vector<std::string_view> names = SplitFields(header, FindSeparator(header));
  if (names.size() != fields) names = SplitFields(header, layout_.separator);
  // The header, or every row, may end in separators that no field follows.
  const auto is_empty = [&](std::size_t column) {
    return std::ranges::all_of(rows, [&](std::string_view row) {
      const std::vector<std::string_view> of_row = SplitFields(row, layout_.separator);
      return of_row.size() == fields && of_row[column].empty();
    });
  };
  while (names.size() > fields && names.back().empty()) names.pop_back();
  while (names.size() < fields && is_empty(names.size())) names.emplace_back();
  while (names.size() == fields && empty_at_end_ < fields) {
    const std::size_t last = fields - 1 - empty_at_end_;
    if (!names[last].empty() || !is_empty(last)) break;
    ++empty_at_end_;
  }
  has_unnamed_count_ = LeavesOutRowNumbers(names, rows, layout_.separator);
  if (has_unnamed_count_) header_.emplace_back();
  for (const std::string_view name : names) header_.emplace_back(name);
  may_begin_with_row_numbers_ =
      has_unnamed_count_ || (names[0].empty() && NumberTheirRows(rows, layout_.separator));
}

std::string CsvReader::ColumnName(std::size_t column) const {
  if (column < header_.size() && !header_[column].empty())
    return "column `" + header_[column] + "`";
  return "column " + std::to_string(column) + " (counted from 0)";
}

std::vector<std::size_t> CsvReader::ColumnsCalled(const std::string& name) const {
  std::vector<std::size_t> found;
  for (std::size_t column = 0; column < header_.size(); ++column) {
    if (header_[column] == name) found.push_back(column);
  }
  std::size_t index = 0;
  const char* const end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data(), end, index);
  if (found.empty() && error == std::errc() && stop == end && index < column_count()) {
    found.push_back(index);
  }
  return found;
}

Status CsvReader::Map(std::size_t column, Kind kind, int power) {
  Column& mapped = columns_[column];
  if (mapped.kind != Kind::kSkip && (mapped.kind != kind || mapped.power != power)) {
    return Error(
        ErrorCode::kDuplicateColumn,
        {path()},
        ColumnName(column) +
            " is mapped twice: as a time and as a reading, or with two units; map it once");
  }
  mapped.kind = kind;
  mapped.power = power;
  if (kind == Kind::kNumber) mapped.numbers.resize(rows_.size());
  if (kind == Kind::kTime) mapped.times.resize(rows_.size());
  if (kind == Kind::kText) mapped.texts.resize(rows_.size());
  return {};
}

Result<std::size_t> CsvReader::Read() {
  for (;;) {
    if (cursor_ == chunk_end_) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::string_view chunk, file_->Next());
      if (chunk.empty()) return 0;
      cursor_ = chunk.data();
      chunk_end_ = cursor_ + chunk.size();
    }
    for (Column& column : columns_) column.any_missing = false;
    Result<std::size_t> count =
        layout_.separator == kBlankRuns ? ReadRows<true>() : ReadRows<false>();
    if (!count || *count > 0) return count;
  }
}

template <bool kBlanks>
Result<std::size_t> CsvReader::ReadRows() {
  const char separator = layout_.separator;
  const auto skip_blanks = [separator](const char* p) {
    while (IsBlank(*p, separator)) ++p;
    return p;
  };
  const auto ends_field = [separator](const char* p) {
    return kBlanks ? IsBlank(*p, separator) || IsLineEnd(p) : *p == separator || IsLineEnd(p);
  };
  std::size_t row = 0;
  const char* p = cursor_;
  while (row < rows_.size() && p != chunk_end_) {
    const char* const line_begin = p;
    ++line_;
    p = skip_blanks(p);
    if (*p == '#' || IsLineEnd(p)) {
      p = LineEnd(p, chunk_end_) + 1;
      continue;
    }
    std::size_t column = 0;
    bool is_header = false;  // Files that were joined from several repeat the header.
    for (;;) {
      Column& target = columns_[column];
      if (target.kind == Kind::kSkip || target.kind == Kind::kText) {
        const char* const begin = p;
        if (*p == '"') p = QuotedEnd(p);
        while (!ends_field(p)) ++p;
        if (target.kind == Kind::kText) {
          target.texts[row] = Unquoted(Trimmed({begin, static_cast<std::size_t>(p - begin)}));
        }
      } else if (!kBlanks && ends_field(p)) {
        SetMissing(&target, row);
      } else {
        p = ParseValue(p, &target, row);
        if (p == nullptr) {
          if (!IsHeader(line_begin)) return FieldError(line_begin, column);
          is_header = true;
          break;
        }
      }
      const char* const value_end = p;
      p = skip_blanks(p);
      if (IsLineEnd(p)) break;
      if (kBlanks ? p == value_end : *p != separator) return FieldError(line_begin, column);
      if (!kBlanks) p = skip_blanks(p + 1);
      if (++column == columns_.size()) break;
    }
    if (is_header) {
      p = LineEnd(line_begin, chunk_end_) + 1;
      continue;
    }
    if (column != columns_.size() - 1) {
      if (!layout_.ragged) return FieldCountError(line_begin);
      for (++column; column < columns_.size(); ++column) SetMissing(&columns_[column], row);
    }
    p = LineEnd(p, chunk_end_) + 1;
    rows_[row] = rows_read_++;
    lines_[row] = line_;
    ++row;
  }
  cursor_ = p;
  return row;
}

void CsvReader::SetMissing(Column* column, std::size_t row) {
  switch (column->kind) {
    case Kind::kNumber:
      column->numbers[row] = std::numeric_limits<double>::quiet_NaN();
      break;
    case Kind::kTime:
      column->times[row] = kMissingTime;
      break;
    case Kind::kText:
      column->texts[row] = {};
      break;
    case Kind::kSkip:
      break;
  }
  column->any_missing = true;
}

const char* CsvReader::ParseValue(const char* p, Column* column, std::size_t row) {
  Decimal decimal;
  if (!ScanDecimal(p, &decimal)) {
    if (*p == '"') return ParseQuoted(p, column, row);
    p += *p == '-' || *p == '+' ? 1 : 0;
    constexpr std::string_view kNan = "nan";
    for (const char expected : kNan) {  // Stops at the '\n' at the latest.
      if (*p != expected && *p != expected - 'a' + 'A') return nullptr;
      ++p;
    }
    SetMissing(column, row);
    return p;
  }
  if (column->kind == Kind::kTime) {
    const std::optional<std::int64_t> time = ToInteger(decimal, column->power);
    if (!time || *time > kFarthestTime || *time < -kFarthestTime) return nullptr;
    column->times[row] = *time;
  } else {
    const std::optional<double> number = ToDouble(decimal);
    if (!number || std::abs(*number) > kNoSensorReads) return nullptr;
    column->numbers[row] = *number;
  }
  return decimal.end;
}

const char* CsvReader::ParseQuoted(const char* p, Column* column, std::size_t row) {
  for (++p; *p == ' ';) ++p;
  if (*p == '"') {
    SetMissing(column, row);
    return p + 1;
  }
  p = ParseValue(p, column, row);
  while (p != nullptr && *p == ' ') ++p;
  return p != nullptr && *p == '"' ? p + 1 : nullptr;
}

Error CsvReader::FieldError(const char* line_begin, std::size_t column) const {
  const std::string_view line = LineAt(line_begin, chunk_end_);
  const std::vector<std::string_view> fields = SplitFields(line, layout_.separator);
  const std::string_view field = column < fields.size() ? fields[column] : std::string_view();
  if (IsCutOff(line)) return CutOffError();
  const int number = static_cast<int>(column) + 1;
  std::string message = ColumnName(column) + ": " + ShownField(field);
  std::string_view word = field;
  if (!word.empty() && (word[0] == '-' || word[0] == '+')) word.remove_prefix(1);
  if (EqualsIgnoringCase(word, "inf") || EqualsIgnoringCase(word, "infinity")) {
    return Fail(ErrorCode::kUnreadableNumber,
                number,
                message + " is not a reading; leave the field empty if there is none");
  }
  if (IsNumber(field)) {
    return Fail(ErrorCode::kValueOutOfRange,
                number,
                message + (columns_[column].kind == Kind::kTime
                               ? " is out of range for a time; check its unit"
                               : " is too large for a reading"));
  }
  message += " is not a number";
  if (field.find('\0') != std::string_view::npos) {
    message += "; a log that was not closed ends in NUL bytes: cut them off";
  } else if (layout_.separator != ',' && field.find(',') != std::string_view::npos) {
    message += "; use a decimal point, not a comma";
  } else if (columns_[column].kind == Kind::kTime && field.find(':') != std::string_view::npos) {
    message +=
        "; convert dates and times of day to numbers, such as seconds since the start of the log";
  } else {
    message += "; correct the row, or remove it; leave a field empty where there is no reading";
  }
  return Fail(ErrorCode::kUnreadableNumber, number, message);
}

Error CsvReader::FieldCountError(const char* line_begin) const {
  const std::string_view line = LineAt(line_begin, chunk_end_);
  if (IsCutOff(line)) return CutOffError();
  const std::vector<std::string_view> fields = SplitFields(line, layout_.separator);
  const bool are_integers = std::all_of(fields.begin(), fields.end(), [](std::string_view field) {
    return field.find_first_not_of(" \t-+0123456789") == std::string_view::npos;
  });
  if (layout_.separator == ',' && are_integers && 2 * fields.size() > 3 * columns_.size() &&
      fields.size() <= 2 * columns_.size()) {
    return Fail(ErrorCode::kWrongFieldCount,
                0,
                "has " + std::to_string(fields.size()) + " whole numbers for " +
                    std::to_string(columns_.size()) +
                    " columns: are its decimals written with commas? Write decimal points");
  }
  return Fail(ErrorCode::kWrongFieldCount,
              0,
              "has " + std::to_string(fields.size()) + " fields; expected " +
                  std::to_string(columns_.size()) + " as in " +
                  (header_.empty() ? "the first row"
                                   : "the header (line " + std::to_string(header_line_) + ")") +
                  "; if this is intended, state `ragged: allow` in a manifest");
}

bool CsvReader::IsHeader(const char* line_begin) const {
  const std::string_view line = LineAt(line_begin, chunk_end_);
  const std::vector<std::string_view> fields = SplitFields(line, layout_.separator);
  return !header_.empty() &&
         std::equal(fields.begin(), fields.end(), header_.begin(), header_.end());
}

bool CsvReader::IsCutOff(std::string_view line) const {
  return file_->ended_mid_line() && line.data() + line.size() + 1 == chunk_end_;
}

Error CsvReader::CutOffError() const {
  return Error(
      ErrorCode::kDamagedFile,
      {path(), line_},
      "looks truncated: the last line is incomplete; copy the log again, or delete that line");
}

Error CsvReader::Fail(ErrorCode code, int column, const std::string& message) const {
  return Error(code, {path(), line_, column}, message);
}

}  // namespace truetriad

// SPDX-License-Identifier: Apache-2.0
//
// Converts ROS 2 bags in SQLite (.db3) to a recording. docs/converting.md.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sqlite3.h>

#include "tools/convert/common/converter.h"
#include "tools/convert/ros/bag_recording.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

namespace fs = std::filesystem;

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

std::string Text(sqlite3_stmt* statement, int column) {
  const unsigned char* const text = sqlite3_column_text(statement, column);
  const int size = sqlite3_column_bytes(statement, column);
  return text == nullptr
             ? std::string()
             : std::string(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
}

/// `path` escaped for a file: URI.
std::string Escaped(const std::string& path) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string uri;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '%' || c == '?' || c == '#' || byte < 0x21 || byte > 0x7e) {
      uri += {'%', kHex[byte / 16], kHex[byte % 16]};
    } else {
      uri += c;
    }
  }
  return uri;
}

class Db3 : public Bag {
 public:
  /// Error: not an SQLite database, or not the database of a bag.
  static Result<std::unique_ptr<Bag>> Open(const std::string& path) {
    std::error_code missing;
    if (!fs::is_regular_file(path, missing)) {
      return Error(ErrorCode::kUnreadableFile, path + ": cannot be read");
    }
    if (path.ends_with(".zstd")) {
      return Error(
          ErrorCode::kWrongFormat, {path}, "is compressed; unpack it first: zstd -d " + path);
    }
    // The -wal file of a crashed recorder belongs to the bag. Without such a file, `immutable`
    // makes SQLite never write, so that a read-only disk suffices.
    const bool has_log =
        fs::exists(path + "-wal", missing) && fs::file_size(path + "-wal", missing) > 0;
    const std::string uri =
        "file:" + Escaped(path) + (has_log ? "?mode=ro" : "?mode=ro&immutable=1");
    sqlite3_hard_heap_limit64(std::int64_t{512} << 20U);
    sqlite3* handle = nullptr;
    const int failure =
        sqlite3_open_v2(uri.c_str(), &handle, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    std::unique_ptr<Db3> bag(new Db3(path, Database(handle)));
    if (failure != SQLITE_OK) return bag->Fail("cannot be opened");
    constexpr int kLongestBlob = 64 << 20;  // 64 MiB; a longer message is damage.
    sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kLongestBlob);
    sqlite3_exec(
        handle, "PRAGMA cell_size_check=ON; PRAGMA trusted_schema=OFF", nullptr, nullptr, nullptr);
    Status topics = bag->ReadTopics();
    if (!topics) {
      // SQLite refuses a truncated file unless writable_schema is on.
      sqlite3_exec(handle, "PRAGMA writable_schema=ON", nullptr, nullptr, nullptr);
      topics = bag->ReadTopics();
    }
    TRUETRIAD_RETURN_IF_ERROR(topics);
    bag->CountMessages();
    return std::unique_ptr<Bag>(std::move(bag));
  }

  /// Passes on messages in the order in which they were written.
  Status Read(const Wants& wanted, const Take& take) override {
    std::string ids;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (wanted(i)) ids += (ids.empty() ? "" : ",") + std::to_string(ids_[i]);
    }
    if (ids.empty()) return {};
    // Reads the table itself instead of an index: this is fast, and works if the index is damaged.
    const std::string query =
        "SELECT id, topic_id, timestamp, data FROM messages NOT INDEXED WHERE id >= ?1 AND "
        "topic_id IN (" +
        ids + ") ORDER BY id";
    Statement statement = Prepare(query.c_str());
    if (!statement) return Fail("its messages cannot be read");
    const std::int64_t last = LastId();
    ProgressLine line("Converting");
    const ProgressCallback progress = line.callback();
    std::int64_t id = 0;
    for (std::int64_t from = 0;;) {
      sqlite3_reset(statement.get());
      sqlite3_bind_int64(statement.get(), 1, from);
      int step = SQLITE_ROW;
      while ((step = sqlite3_step(statement.get())) == SQLITE_ROW) {
        id = sqlite3_column_int64(statement.get(), 0);
        if (id < from) break;  // Rows of a damaged table can form a cycle.
        TakeRow(statement.get(), take);
        if (id == std::numeric_limits<std::int64_t>::max()) return {};  // No id is larger.
        from = id + 1;
        if (progress && last > 0) progress(static_cast<double>(id) / static_cast<double>(last));
      }
      if (step == SQLITE_DONE) return {};
      const std::optional<std::int64_t> next = NextReadable(&statement, from, last);
      ++damages_;
      const std::string lost =
          next ? "at most " + Counted(static_cast<std::uint64_t>(*next - from), "message")
               : std::string("all messages");
      Note(path_ + ": damaged (" + sqlite3_errmsg(database_.get()) + "): " + lost +
           " of all topics lost after message " + std::to_string(from - 1));
      if (!next) return {};
      from = *next;
    }
  }

  std::map<std::string, std::uint64_t> Damage() const override {
    return {{"damaged places", damages_}};
  }

 private:
  Db3(std::string path, Database database)
      : path_(std::move(path)), database_(std::move(database)) {}

  /// Determines the number and the times of each topic's messages. If the bag is too damaged for
  /// this, the numbers are marked as unknown.
  void CountMessages() {
    Statement all = Prepare(
        "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY "
        "topic_id");
    int step = SQLITE_ERROR;
    while (all && (step = sqlite3_step(all.get())) == SQLITE_ROW) {
      for (std::size_t i = 0; i < ids_.size(); ++i) {
        if (ids_[i] != sqlite3_column_int64(all.get(), 0)) continue;
        topics_[i].messages = static_cast<std::uint64_t>(sqlite3_column_int64(all.get(), 1));
        topics_[i].first_ns = sqlite3_column_int64(all.get(), 2);
        topics_[i].last_ns = sqlite3_column_int64(all.get(), 3);
      }
    }
    if (step == SQLITE_DONE) return;
    Note(path_ + ": is damaged; its messages cannot be counted in advance");
    for (Topic& topic : topics_) topic.is_counted = false;
  }

  Error Fail(const std::string& what) const {
    return Error(ErrorCode::kDamagedFile,
                 {path_},
                 what + ": " + (database_ ? sqlite3_errmsg(database_.get()) : "out of memory") +
                     "; expected a ROS 2 bag in SQLite (.db3). If the bag is damaged, "
                     "sqlite3's `.recover` may restore more of it");
  }

  Statement Prepare(const char* sql) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr);
    return Statement(statement);
  }

  Status ReadTopics() {
    Statement all = Prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    if (!all) return Fail("is not a ROS 2 bag");
    int step = SQLITE_DONE;
    while ((step = sqlite3_step(all.get())) == SQLITE_ROW) {
      Topic topic{.name = Text(all.get(), 1), .type = Text(all.get(), 2)};
      topic.definition = DefinitionOf(topic.type);
      if (Text(all.get(), 3) != "cdr") {
        topic.definition.clear();
        topic.type += " as " + Text(all.get(), 3) + ", not cdr";
      }
      ids_.push_back(sqlite3_column_int64(all.get(), 0));
      topics_.push_back(std::move(topic));
    }
    if (step != SQLITE_DONE && topics_.empty()) return Fail("its topics cannot be read");
    return {};
  }

  std::int64_t LastId() const {
    Statement last = Prepare("SELECT max(id) FROM messages");
    const bool is_known = last && sqlite3_step(last.get()) == SQLITE_ROW;
    // If the last id is unknown, returns a large number, which NextReadable reaches in sixty
    // doublings.
    return is_known ? sqlite3_column_int64(last.get(), 0) : std::int64_t{1} << 60U;
  }

  /// The first readable message after damage at `from` (not negative): steps double until a message
  /// is readable, then bisection finds the first one.
  static std::optional<std::int64_t> NextReadable(Statement* statement,
                                                  std::int64_t from,
                                                  std::int64_t last) {
    const auto readable = [&](std::int64_t id) {
      sqlite3_reset(statement->get());
      sqlite3_bind_int64(statement->get(), 1, id);
      const int step = sqlite3_step(statement->get());
      return step == SQLITE_ROW;
    };
    std::int64_t damaged = from;
    std::int64_t whole = from;
    bool found = false;
    for (std::uint64_t reach = 1; !found && damaged < last; reach *= 2) {
      const bool is_within = reach < static_cast<std::uint64_t>(last - from);
      whole = is_within ? from + static_cast<std::int64_t>(reach) : last;
      found = readable(whole);
      if (!found) damaged = whole;
    }
    if (!found) return std::nullopt;
    while (damaged + 1 < whole) {
      const std::int64_t middle = damaged + (whole - damaged) / 2;
      (readable(middle) ? whole : damaged) = middle;
    }
    return whole;
  }

  void TakeRow(sqlite3_stmt* row, const Take& take) const {
    const auto found = std::find(ids_.begin(), ids_.end(), sqlite3_column_int64(row, 1));
    if (found == ids_.end()) return;
    const void* const bytes = sqlite3_column_blob(row, 3);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, 3));
    take(static_cast<std::size_t>(found - ids_.begin()),
         sqlite3_column_int64(row, 2),
         bytes == nullptr ? std::string_view()
                          : std::string_view(static_cast<const char*>(bytes), size));
  }

  /// The definition of a type; bags have definitions since 2023.
  std::string DefinitionOf(const std::string& type) const {
    Statement found = Prepare(
        "SELECT encoded_message_definition FROM message_definitions WHERE topic_type = ?1 AND "
        "encoding = 'ros2msg'");
    if (!found) return {};
    sqlite3_bind_text(found.get(), 1, type.data(), static_cast<int>(type.size()), SQLITE_TRANSIENT);
    return sqlite3_step(found.get()) == SQLITE_ROW ? Text(found.get(), 0) : std::string();
  }

  std::string path_;
  Database database_;
  std::vector<std::int64_t> ids_;  ///< The database's ids of topics_.
  std::uint64_t damages_ = 0;
};

constexpr BagFormat kFormat = {.converter = "ros2-db3",
                               .source = "ros2-db3",
                               .ending = ".db3",
                               .encoding = Encoding::kCdr,
                               .open = Db3::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunBagConverter(truetriad::convert::kFormat, argc, argv);
}

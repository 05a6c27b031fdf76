// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "fleet/rows.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

enum class Access { kRead, kWrite };

/// A connection to a database that has the tables of schema.h: what SQLite and PostgreSQL do each
/// in its way. All functions: an error (bad input) where it cannot be reached, read or written.
class Database {
 public:
  virtual ~Database() = default;

  /// For messages, without secrets.
  virtual const std::string& name() const = 0;
  /// How many rows one statement is to insert.
  virtual std::size_t rows_at_once() const = 0;

  /// Does all of `work` or nothing of it; on the disk when it returns. `work` may be called several
  /// times: a connection that is lost is opened anew. Not to be nested.
  virtual Status Transact(Access access, const std::function<Status()>& work) = 0;
  /// How many rows a statement has inserted. In `work`.
  virtual Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) = 0;
  /// What a statement says. In `work`.
  virtual Result<Table> Ask(std::string_view sql, std::span<const Value> values) = 0;
  /// What a statement of somebody else says. Not in `work`. Error (usage): it is not understood,
  /// not one, or would change something.
  virtual Result<Table> AskAsGiven(const std::string& sql) = 0;
  /// Store::AllowTypedText. Not in `work`.
  virtual Status AllowTypedText() { return {}; }
  /// Store::TellNotes.
  virtual void TellNotes(std::function<void(const std::string&)> /*on_note*/) {}
};

}  // namespace truetriad::fleet

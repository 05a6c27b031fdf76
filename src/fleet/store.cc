// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <algorithm>
#include <string_view>

#include "base/named_values.h"
#include "fleet/database.h"
#include "fleet/postgres_store.h"
#include "fleet/sqlite_store.h"
#include "fleet/store_url.h"

namespace truetriad::fleet {
namespace {

constexpr NamedValues<RetestCounts, 3> kRetestCounts = {{
    {RetestCounts::kLast, "last"},
    {RetestCounts::kFirst, "first"},
    {RetestCounts::kBest, "best"},
}};

Status CheckLine(const std::string& what, const std::string& text, std::size_t longest) {
  const bool is_blank = text.find_first_not_of(" \t") == std::string::npos;
  const bool is_line = std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  if (!is_blank && is_line && text.size() <= longest) return {};
  return Error(ErrorCode::kInvalidArgument,
               "a disposition says " + what + " in one line of at most " + std::to_string(longest) +
                   " bytes");
}

Result<std::unique_ptr<Store>> Open(const std::string& url, Access access) {
  constexpr std::string_view kSqlite = "sqlite:";
  if (url.starts_with(kSqlite)) return OpenSqlite(url.substr(kSqlite.size()), access);
  if (PostgresOptions(url)) return OpenPostgres(url, access);
  if (const std::size_t scheme = url.find("://"); scheme != std::string::npos) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store=" + url.substr(0, scheme) +
                     "://…: expected a file, as in line.db or sqlite:line.db, or "
                     "postgresql://HOST/DATABASE");
  }
  return OpenSqlite(url, access);
}

}  // namespace

std::string_view RetestCountsName(RetestCounts counts) { return kRetestCounts.Name(counts); }

std::optional<RetestCounts> RetestCountsFromName(std::string_view name) {
  return kRetestCounts.Find(name);
}

Status CheckDisposition(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("who decided it", disposition.who, 200));
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("why", disposition.why, 2000));
  std::string verdicts;
  for (const Verdict verdict : kVerdictsOfPeople) {
    if (verdict == disposition.verdict) return {};
    verdicts.append(verdicts.empty() ? "" : ", ").append(VerdictName(verdict));
  }
  return Error(ErrorCode::kInvalidArgument,
               "people do not decide `" + std::string(VerdictName(disposition.verdict)) +
                   "`; expected one of " + verdicts);
}

std::string ShownStore(const std::string& url) {
  return PostgresOptions(url) ? ShownPostgres(url) : url;
}

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) {
  return Open(url, Access::kWrite);
}

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) {
  return Open(url, Access::kRead);
}

}  // namespace truetriad::fleet

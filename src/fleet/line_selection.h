// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Which units (or runs) are looked at; what is empty does not matter.
struct LineSelection {
  /// Measured since and until: moments, ISO 8601 UTC, or the beginning of one: "2026-11-24".
  std::string since = {}, until = {};
  std::string lot = {}, station = {};
  std::string where = {};  ///< SQL over the columns of `run` and the tags, each by its name.
};

/// The same with moments as FromWhere compares them. Error (usage): a moment that is none, or a lot
/// or station that no run of the store has.
Result<LineSelection> CheckedSelection(Store& store, LineSelection selection);

/// Error (usage): `tag`, which `flag` states, is not the name of a tag.
Status CheckIsTag(std::string_view flag, const std::string& tag);

/// Column of `standing`: why a unit is not good, by its run or by who decided otherwise.
inline constexpr std::string_view kReason =
    "CASE WHEN final_verdict <> verdict THEN 'decided by ' || disposed_by ELSE code END";

/// The order in which runs were measured, for ORDER BY; `of` is a name of the table in the
/// question.
std::string OrderOfTime(const std::string& of);
/// A text in SQL, whatever is in it.
std::string SqlText(std::string_view text);
/// " FROM … WHERE …": what is selected of the table or view `source`, with a column for each tag.
std::string FromWhere(std::string_view source, const LineSelection& selection);

}  // namespace truetriad::fleet

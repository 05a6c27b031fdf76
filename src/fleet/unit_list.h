// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The units that `words` name: logs; folders, with every log in them and below (ForEachLog);
/// patterns such as `line-3/*.csv`; and lists, CSV with a column `log` and perhaps `serial`,
/// `recorded` and tags (`lot`, `slot`, …), paths as seen from their folder. Each once, in the order
/// of their names; those of a list as there. `serial_pattern`: how a file is named, with {serial}
/// for that and * for anything else; empty: nothing is taken from names. Errors (bad input): a name
/// that is none, a folder without a log or that cannot be read, a list that is malformed, names no
/// log or one that is not there, a log that is there twice, a name that does not match the pattern
/// or is no UTF-8. Error (usage): no words, a pattern without {serial}.
Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern);

/// Without blanks in front and behind, which nobody sees.
std::string Trimmed(const std::string& text);

/// Error (usage): a pattern of serial numbers without {serial}. None: empty.
Status CheckSerialPattern(const std::string& pattern);

/// Error (usage): the experiment of `plan` states a serial number, and it would be that of more
/// than one of `units`.
Status CheckSerials(const WorkPlan& plan, const std::vector<UnitOrder>& units);
/// The same of units that are still to come: however many.
Status CheckSerialsToCome(const WorkPlan& plan, const std::string& serial_pattern);

/// Takes a unit's serial number from its log's name, unless it is known or `pattern` is empty.
/// Errors (bad input): the name does not match, is of another unit than is known, or is no UTF-8.
Status TakeSerial(const std::string& pattern, UnitOrder* unit);

/// The part of `units` that shard `index` of `count` does: by a hash of their places, so that each
/// belongs to one shard whatever else is in the list.
std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count);

}  // namespace truetriad::fleet

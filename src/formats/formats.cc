// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "base/spelling.h"
#include "formats/format.h"

namespace truetriad {

const std::vector<Format>& AllFormats() {
  static const auto& formats = *[] {
    auto* const all = new std::vector<Format>();
    for (const std::vector<Format>& some :
         {AutopilotFormats(), CountsFormats(), KalibrFormats(), ListedFormats()}) {
      all->insert(all->end(), some.begin(), some.end());
    }
    all->insert(all->end(), {MatlabFormat(), JsonFormat(), CHeaderFormat(), RecordFormat()});
    return all;
  }();
  return formats;
}

std::vector<FormatInfo> Formats() {
  std::vector<FormatInfo> infos;
  for (const Format& format : AllFormats()) infos.push_back(format.info);
  return infos;
}

Result<const Format*> FindFormat(std::string_view name) {
  // As the projects spell themselves, too: imu_tk.
  std::string wanted(name);
  std::replace(wanted.begin(), wanted.end(), '_', '-');
  std::vector<std::string_view> names;
  std::string list;
  for (const Format& format : AllFormats()) {
    if (format.info.name == wanted) return &format;
    names.push_back(format.info.name);
    list.append(list.empty() ? "" : ", ").append(format.info.name);
  }
  return Error(ErrorCode::kUnknownName,
               "`" + std::string(name) + "` is not a format" + DidYouMean(wanted, names) +
                   "; expected one of " + list);
}

Result<FormatInfo> InfoOfFormat(std::string_view name) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Format* const format, FindFormat(name));
  return format->info;
}

}  // namespace truetriad

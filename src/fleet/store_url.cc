// SPDX-License-Identifier: Apache-2.0
#include "fleet/store_url.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace truetriad::fleet {
namespace {

constexpr std::string_view kScheme = "postgresql:";

bool IsShown(std::string_view name) {
  constexpr std::array<std::string_view, 5> kShown = {"host", "hostaddr", "port", "dbname", "user"};
  return std::find(kShown.begin(), kShown.end(), name) != kShown.end();
}

/// "host=/tmp&password=x" with what may be shown.
std::string ShownQuery(std::string_view query) {
  std::string shown;
  while (!query.empty()) {
    const std::string_view item = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), item.size() + 1));
    if (!IsShown(item.substr(0, item.find('=')))) continue;
    shown.append(shown.empty() ? "?" : "&").append(item);
  }
  return shown;
}

/// "host:5432/day"; without what stands for the port and is no number.
std::string WithoutOddPort(std::string_view place) {
  const std::size_t slash = std::min(place.find('/'), place.size());
  const std::size_t colon = std::min(place.find(':'), slash);
  const std::string_view port = place.substr(colon, slash - colon);
  const bool is_odd = port.find_first_not_of(":0123456789") != std::string_view::npos;
  return std::string(place.substr(0, is_odd ? colon : slash)).append(place.substr(slash));
}

std::string ShownUri(std::string_view rest) {
  const std::size_t question = rest.find('?');
  const std::string_view place = rest.substr(0, question);
  const std::string_view query =
      question == std::string_view::npos ? "" : rest.substr(question + 1);
  // A @ after the question mark: part of a value, or the mark is part of a password.
  if (query.find('@') != std::string_view::npos) return "postgresql://";
  const std::size_t at = place.rfind('@');
  if (at == std::string_view::npos) {
    // IPv6 addresses have colons.
    return "postgresql://" + std::string(place.starts_with('[') ? place : WithoutOddPort(place)) +
           ShownQuery(query);
  }
  const std::string_view user = place.substr(0, std::min(place.find(':'), at));
  return "postgresql://" + std::string(user) + std::string(place.substr(at)) + ShownQuery(query);
}

/// "host=/tmp dbname='a b' password=x" with what may be shown.
std::string ShownValues(std::string_view text) {
  std::string shown(kScheme);
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) break;
    std::string_view name = text.substr(0, equals);
    while (!name.empty() && std::isspace(static_cast<unsigned char>(name.back())) != 0) {
      name.remove_suffix(1);
    }
    std::size_t end = std::min(text.find_first_not_of(" \t\r\n", equals + 1), text.size());
    const std::size_t begin = end;
    const bool is_quoted = end < text.size() && text[end] == '\'';
    if (is_quoted) ++end;
    for (; end < text.size(); ++end) {
      if (text[end] == '\\') {
        ++end;
      } else if (is_quoted ? text[end] == '\''
                           : std::isspace(static_cast<unsigned char>(text[end])) != 0) {
        break;
      }
    }
    if (is_quoted) ++end;
    end = std::min(end, text.size());
    if (IsShown(name)) {
      shown += shown.size() > kScheme.size() ? " " : "";
      shown.append(name).append("=").append(text.substr(begin, end - begin));
    }
    text.remove_prefix(end);
  }
  return shown;
}

}  // namespace

std::optional<std::string> PostgresOptions(const std::string& url) {
  if (url.starts_with("postgresql://") || url.starts_with("postgres://")) return url;
  if (url.starts_with(kScheme)) return url.substr(kScheme.size());
  return std::nullopt;
}

Status CheckStoreUrl(const std::string& url) {
  if (PostgresOptions(url)) return {};
  std::string_view path(url);
  for (const std::string_view scheme : {"sqlite:", "jsonl:"}) {
    if (!path.starts_with(scheme)) continue;
    path.remove_prefix(scheme.size());
    break;
  }
  constexpr std::array<std::string_view, 5> kOfServers = {
      "://", "password=", "host=", "dbname=", "service="};
  if (std::any_of(kOfServers.begin(), kOfServers.end(), [&](std::string_view part) {
        return path.find(part) != std::string_view::npos;
      })) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store: what is named looks like a connection to a server; expected "
                 "postgresql://HOST/DATABASE, \"postgresql:host=HOST dbname=DATABASE\", or a file, "
                 "as in line.db or shard-2.jsonl");
  }
  if (!path.empty() && !path.starts_with(':') && !path.starts_with("file:")) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--store=" + url +
                   " names no file, so that nothing would be kept; expected one, as in line.db");
}

std::string ShownPostgres(const std::string& url) {
  const std::size_t slashes = url.find("://");
  const bool is_uri = slashes != std::string::npos && slashes < kScheme.size();
  return is_uri ? ShownUri(std::string_view(url).substr(slashes + 3))
                : ShownValues(std::string_view(url).substr(kScheme.size()));
}

}  // namespace truetriad::fleet

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A log whose container a script reads in Node (tools/convert-node/lib/read.js), as frames that
/// come through a pipe: a letter, the length of what follows in 32 bits, and that.
class NodeLog {
 public:
  /// `request`: {"format": "ulog", "input": …}, and what the script of the format wants to know.
  /// Error: it cannot be started.
  static Result<std::unique_ptr<NodeLog>> Start(const Json& request);
  ~NodeLog();  ///< Ends the script.
  NodeLog(const NodeLog&) = delete;
  NodeLog& operator=(const NodeLog&) = delete;

  struct Frame {
    char kind = '\0';       ///< '\0': the log has ended.
    std::string_view body;  ///< Valid until the next call.
  };
  /// Says, or prints, what the script has to say, and gives the next other frame. Error: what
  /// the script has found, or that it ended before the log did. Throws Interrupted.
  Result<Frame> Next();

 private:
  NodeLog() = default;
  /// False where the script ended before that many bytes.
  bool Fill(std::size_t count);

  pid_t child_ = -1;
  int pipe_ = -1;
  std::string buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< Of the buffer, what was read and not yet taken.
};

}  // namespace truetriad::convert

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

/// From here on SIGINT and SIGTERM are noted and do not end the program, so that it can remove what
/// is half written; a second one of the kind does. A signal that is ignored (nohup) stays so.
void NoteInterruptions();

/// True once a signal has been noted.
bool IsInterrupted();

/// Ends the program as the noted signal would have done. Nothing to do without one.
void EndAsInterrupted();

}  // namespace truetriad

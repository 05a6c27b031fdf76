// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

/// From now on, SIGINT and SIGTERM are recorded instead of ending the program, so that the program
/// can remove incomplete files. A second signal ends the program. A signal that was ignored before
/// (nohup) stays ignored.
void NoteInterruptions();

/// Whether a signal was recorded.
bool IsInterrupted();

/// Ends the program as the recorded signal would have. Returns if no signal was recorded.
void EndAsInterrupted();

}  // namespace truetriad

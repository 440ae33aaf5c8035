/// The sentences of a rule: one table beside the rule, read in one sitting. Findings carry a kind and arguments, no
/// text; cli/report/sentences.h turns both into title, message and next step.
///
/// Templates:
///   {name}            the argument, in the notation of its type; it has to be set
///   {name:number}     a code, object or register without its meaning; {name:meaning}: only that
///   {name?is|are}     the first text if the number is 1, else the second
///   [ ... ]           left out unless all arguments in it are set and no flag in it is false; may be nested
///   {?name} {!name}   inside [ ... ]: writes nothing; the part needs the argument set (and true), or not set (or
///   false)
///   \{ \[ \] \\  these characters themselves
/// Of each finding there are besides: {frame}, {last_frame} and {count}. A sentence that begins with a word, frame or
/// count gets a capital. Line breaks and runs of blanks are one blank.
#pragma once

#include <string_view>

#include "analyzers/result/argument.h"

namespace ecaudit {

/// One way in which a rule is violated.
struct FindingKind {
  std::string_view name;     ///< public interface, unique in its rule: "refused"; JSON `kind`
  std::string_view title;    ///< at most 70 characters, without slave and frame; expected against actual
  std::string_view message;  ///< what was observed (frames) and expected (source)
  /// What to do, as for a finding without a cause; empty only where there is nothing to do. A consequence shows
  /// "Correct f1 (rule) first." instead, which only the writer of the report can make.
  std::string_view next;
  /// Names of the arguments that distinguish two findings of this kind, separated by blanks: no counts, times, frames.
  std::string_view identity = {};
  /// A consequence shows `next`, too: correcting the cause does not do it.
  bool next_stays = false;
};

/// A sentence that a finding may have besides, after its message and before the next step, in the order of being added.
struct NoteKind {
  std::string_view name;  ///< public interface, unique in its rule: "written-later"
  std::string_view text;
};

struct Note {
  const NoteKind* kind = nullptr;
  Arguments arguments;
};

}  // namespace ecaudit

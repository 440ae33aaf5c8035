/// The latch control word and the latch status word, as they came and as they stand.
#pragma once

#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"

namespace ecaudit::model {

/// A word as it came.
struct LatchWord {
  std::uint16_t value = 0;
  FrameRef frame;     ///< to cite
  FrameNo begun = 0;  ///< control: sent; status: no older than this
  FrameNo done = 0;   ///< control: in force after this; status: known to the master from here on
  bool by_sdo = false;
  bool inferred = false;
};

/// What the drive was commanded last.
struct LatchControl {
  bool known = false;
  std::uint16_t value = 0;
  FrameRef frame;                ///< it came last
  bool doubt = false;            ///< a word of which it is not known whether it was taken came since
  std::uint16_t doubt_zero = 0;  ///< bits that were 0 in it
  bool doubt_selector = false;   ///< its selector was another
  bool cyclic = false;           ///< it is in process data
  std::uint64_t words = 0;

  void Forget() {
    known = false;
    EndDoubt();
  }
  void EndDoubt() {
    doubt = doubt_selector = false;
    doubt_zero = 0;
  }
};

/// What the drive reported last.
struct LatchStatus {
  bool known = false;
  std::uint16_t value = 0;
  FrameRef frame;
  FrameNo begun = 0;
  bool gap = false;     ///< inputs are missing since
  bool cyclic = false;  ///< it is in process data
  std::uint64_t words = 0;
  std::uint64_t words_before = 0;  ///< of these, the ones before Forget()

  void Forget() {
    known = gap = false;
    words_before = words;
  }
  [[nodiscard]] std::uint64_t since_forget() const { return words - words_before; }
  /// It came once more.
  void Seen(const FrameRef& in, FrameNo not_before) {
    frame = in;
    begun = not_before;
    gap = false;
  }
};

}  // namespace ecaudit::model

/// Rows of `decode`: one for each datagram.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/options/slave_names.h"
#include "cli/stream/columns.h"
#include "cli/stream/row_sink.h"
#include "decoder/base/ids.h"
#include "decoder/bus/direction.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/header.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli {

struct DatagramTable {
  report::TimeMode time_mode = report::TimeMode::kRelative;
  SlaveNames names = {};
};

/// A datagram and what is known of it as of its frame.
struct DatagramRow {
  const wire::FrameView& frame;
  wire::DatagramView datagram;
  bus::Direction direction = bus::Direction::kForeign;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  std::optional<SlavePos> slave;               ///< the slave it addresses
  std::optional<mailbox::Direction> mailbox;   ///< it accesses the mailbox of the slave from its first byte on
  TimeColumn time;
  const mailbox::DiagnosisTexts* diagnosis_texts = nullptr;  ///< of the slave; null: none

  [[nodiscard]] bool outbound() const { return direction == bus::Direction::kOutbound; }
  [[nodiscard]] bool returned() const { return direction == bus::Direction::kReturned; }
};

/// A frame that is not sound; its datagrams, as far as there are any, have rows of their own.
struct UnsoundFrame {
  const wire::FrameView& frame;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  TimeColumn time;
};

class DatagramSink : public RowSink<DatagramTable, DatagramRow> {
 public:
  /// After the rows of the frame. Formats with a column for each field have no place for it.
  virtual void Unsound(const UnsoundFrame& /*frame*/) {}
};

}  // namespace ecaudit::cli

/// Rows of `events`: one for each event.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "analyzers/options/slave_names.h"
#include "cli/report/layout.h"
#include "cli/stream/columns.h"
#include "cli/stream/event_type.h"
#include "cli/stream/row_fields.h"
#include "cli/stream/row_sink.h"
#include "decoder/base/ids.h"

namespace ecaudit::cli {

struct EventTable {
  report::TimeMode time_mode = report::TimeMode::kRelative;
  bool types_chosen = false;  ///< --type names those that are shown
  SlaveNames names = {};
};

struct EventRecord {
  EventType type = EventType::kLeftOut;
  FrameRef frame;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  TimeColumn time;
  bool whole_bus = false;  ///< else of one slave, whose addresses may be unknown
  std::optional<SlavePos> slave;
  std::optional<StationAddress> station;
  const RowFields& fields;  ///< what this type of event has
  std::string_view text;    ///< the line for people; printable
  report::Style style = report::Style::kPlain;
  bool shown_elsewhere = false;  ///< another line shows the same to people; left out unless --type names this type
};

using EventSink = RowSink<EventTable, EventRecord>;

}  // namespace ecaudit::cli

/// What ENI and ESI files write in the same way; internal to their readers.
#pragma once

#include <string_view>

#include "decoder/device/mailbox_description.h"
#include "decoder/device/pdo_description.h"
#include "decoder/device/xml_cursor.h"

namespace ecaudit::device {

/// The use of a sync manager by its word: "MBoxOut", "Inputs", ..., and what follows from it.
inline void SetUse(SyncManagerRule& rule, std::string_view word) {
  rule.use = word == "MBoxOut"   ? SyncManagerUse::kMailboxOut
             : word == "MBoxIn"  ? SyncManagerUse::kMailboxIn
             : word == "Outputs" ? SyncManagerUse::kProcessOut
             : word == "Inputs"  ? SyncManagerUse::kProcessIn
                                 : SyncManagerUse::kUnused;
  rule.mailbox_mode = rule.use == SyncManagerUse::kMailboxOut || rule.use == SyncManagerUse::kMailboxIn;
  rule.master_writes = rule.use == SyncManagerUse::kMailboxOut || rule.use == SyncManagerUse::kProcessOut;
}

/// A PDO with what the attributes of the current element give.
[[nodiscard]] inline PdoContent PdoOfAttributes(XmlCursor& xml, PdoDirection direction, std::string_view source) {
  PdoContent content;
  content.direction = direction;
  content.fixed = xml.Flag("Fixed");
  content.mandatory = xml.Flag("Mandatory");
  content.sync_manager = xml.NumberAttribute<std::uint8_t>("Sm");
  content.source = source;
  return content;
}

}  // namespace ecaudit::device
